"""What happens to a job on a worker, or in this process: the same function for both."""

import functools
import json
import tempfile
import time
import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import Context
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from rigid.io.errors import EnvironmentFaultError, RigidError
from rigid.io.runtime import prepare
from rigid.io.version import __version__
from rigid.jobs.job import Given, digest, under
from rigid.jobs.memory import resident, shed

DEFECT = OUTSIDE = EnvironmentFaultError.status
"""Exit status of a defect of the program, and of a system that refuses something."""
FRAMES = 3
"""Calls of a failure that a row names, the innermost ones."""


class Done(NamedTuple):
    """What comes back of a job.

    - `text`: JSON: `needs` (paths of files that are not here), or `failed`, or `value`, with
      `cost`. - `files`: content of what the function left in its folder, by relative path.
    """

    text: str
    files: dict[str, bytes]


def carry_out(order: str, version: str, sent: Mapping[str, bytes] | None = None) -> Done:
    """Carry out a job.

    - `order`: as `rigid.jobs.job.order` makes it. - `version`: of the package that ordered it.
    - `sent`: content of its files by path; None: those at the paths themselves.

    Failures come back as a value; nothing that Python can catch is raised.
    """
    job = json.loads(order)
    if version != __version__:
        return _failed(DEFECT, f"the worker has rigid {__version__}, who asks has {version}")
    with placed(job["files"], sent) as root, tempfile.TemporaryDirectory(prefix="rigid-") as out:
        if root is None:
            return Done(json.dumps({"needs": sorted(job["files"])}), {})
        given = Given(job["arguments"], root, Path(out))
        began = time.process_time(), time.monotonic()
        try:
            prepare()
            # in a context of its own: what is being run here is none of the job's business
            found = {"value": Context().run(_function(job["function"]), given)}
            text = json.dumps(found | {"cost": _cost(began)}, allow_nan=False)
            files = _left_in(given.out)
        except RigidError as error:
            return _failed(error.status, str(error), _cost(began))
        except OSError as error:
            return _failed(OUTSIDE, f"the system refused: {error}", _cost(began))
        except Exception as error:  # a defect costs its job, not the run
            told = traceback.format_exception_only(error)[-1].strip()
            calls = traceback.extract_tb(error.__traceback__)[-FRAMES:]
            where = " > ".join(f"{Path(c.filename).name}:{c.lineno}" for c in calls)
            return _failed(DEFECT, f"{told} ({where})", _cost(began))
        finally:
            shed(_held())
    return Done(text, files)


def _failed(status: int, says: str, cost: Mapping[str, float] | None = None) -> Done:
    made = {
        "failed": {"status": status, "says": says},
        "cost": cost or {"cpu_s": 0.0, "wall_s": 0.0},
    }
    return Done(json.dumps(made), {})


def _cost(began: tuple[float, float]) -> dict[str, float]:
    """CPU seconds of this process, and wall seconds, since `began`."""
    used = time.process_time() - began[0], time.monotonic() - began[1]
    return {"cpu_s": round(used[0], 3), "wall_s": round(used[1], 3)}


@functools.cache
def _held() -> int:
    """Bytes that the process held when its first job was done."""
    return resident()


def _function(name: str) -> Any:
    """The function "module:name"."""
    module, attribute = name.split(":")
    return getattr(import_module(module), attribute)


def _left_in(folder: Path) -> dict[str, bytes]:
    """Content of all files in a folder, by path in it; hidden ones are of no use elsewhere."""
    paths = sorted(p for p in folder.rglob("*") if p.is_file() and not p.name.startswith("."))
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


@contextmanager
def placed(wanted: Mapping[str, str], sent: Mapping[str, bytes] | None) -> Iterator[Path | None]:
    """Give the root under which all files of a job lie; None: they have to be sent.

    - `wanted`: SHA-256 by absolute path.
    """
    if sent is None:
        here = all(_has(Path(path), sha) for path, sha in wanted.items())
        yield Path("/") if here else None
        return
    with tempfile.TemporaryDirectory(prefix="rigid-files-") as name:
        for path, content in sent.items():
            place = under(Path(name), Path(path))
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(content)
        yield Path(name)


def _has(path: Path, sha: str) -> bool:
    try:
        return digest(path.read_bytes()) == sha
    except OSError:
        return False

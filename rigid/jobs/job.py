"""A job, what its function is given, and the key by which a finished one is known."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rigid.io.errors import InputError


@dataclass(frozen=True)
class Job:
    """One independent piece of work, as a small value that any worker can carry out.

    - `name`: told in progress and rows; no two jobs of a run share one.
    - `arguments`: of the function; what JSON can hold: text of a spec, seed, numbers.
    - `files`: absolute paths of files that the function reads. A worker that has none of the same
      content at the same path is sent them.
    """

    name: str
    arguments: Mapping[str, Any] = field(default_factory=dict)
    files: tuple[Path, ...] = ()


@dataclass(frozen=True)
class Given:
    """What the function of a job gets on the worker.

    - `arguments`: as they are in the job. - `root`: under which its files lie.
    - `out`: an empty folder; what the function leaves there comes back with the row.
    """

    arguments: Mapping[str, Any]
    root: Path
    out: Path

    def path(self, name: Path | str) -> Path:
        """Where a file of the job lies here.

        - `name`: its absolute path where the job was made.
        """
        return under(self.root, Path(name))


def under(root: Path, path: Path) -> Path:
    """Place of an absolute path below another root."""
    return root / path.relative_to(path.anchor)


def digest(content: bytes) -> str:
    """SHA-256 of a content."""
    return hashlib.sha256(content).hexdigest()


def order(function: str, job: Job) -> str:
    """Text that a worker is sent: function, arguments and the SHA-256 of every file.

    - `function`: "module:name" of a function that takes a `Given` and returns a dict.

    Raises InputError for arguments that JSON cannot hold and for a file that cannot be read.
    """
    made = {"function": function, "name": job.name, "arguments": dict(job.arguments)}
    try:
        made["files"] = {str(p.absolute()): digest(p.read_bytes()) for p in job.files}
    except OSError as error:
        raise InputError(f"job {job.name}: {error.filename}: {error.strerror}") from None
    try:
        return json.dumps(made, sort_keys=True, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise InputError(f"job {job.name}: {error}; arguments are what JSON can hold") from None


def contents(job: Job) -> dict[str, bytes]:
    """Content of the files of a job, by absolute path."""
    return {str(path.absolute()): path.read_bytes() for path in job.files}

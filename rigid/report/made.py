"""The provenance of a section, gathered at the moment the section is made."""

import datetime
import os
import platform
from collections.abc import Iterable
from typing import Any

from rigid.io.provenance import commit, invocation, versions
from rigid.io.version import __version__
from rigid.report.content import Provenance
from rigid.spec import Spec


def made(
    spec: Spec, seed: int | None, sha256: Iterable[tuple[str, str]], **cost: Any
) -> Provenance:
    """Say what was run, when, from which state of the program, on which files, at what cost.

    - `sha256`: (file or record, digest) of what was read. - `cost`: fields of `Provenance` in
      place of those of the command as a whole.
    """
    return made_of(spec.path.stem, spec.text, seed, sha256, **cost)


def made_of(
    name: str, text: str, seed: int | None, sha256: Iterable[tuple[str, str]], **cost: Any
) -> Provenance:
    """The same of what is no spec.

    - `name`, `text`: of what was read, shown as a spec is; an empty text is not shown.
    """
    run = invocation()
    machine = f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}"
    taken: dict[str, Any] = {"wall_s": run.wall_s, "cpu_s": run.cpu_s, "machine": machine} | cost
    return Provenance(
        version=__version__,
        commit=commit(),
        command=run.command,
        date=datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M UTC"),
        seed=seed,
        spec_name=name,
        spec_text=text,
        sha256=tuple(dict.fromkeys(sha256)),  # both cylinders of a run may lie in one file
        versions=tuple(versions().items()),
        **taken,
    )

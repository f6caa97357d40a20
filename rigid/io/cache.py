"""The one store of what a run has worked out, so that a run that goes on does not do it again.

An entry is a file: its SHA-256 in the first line, then text and arrays. It is written whole or not
at all and is on the disk itself before the run goes on. One that is damaged is set aside and told.
"""

import hashlib
import io
import json
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple
from zipfile import BadZipFile

import numpy as np

from rigid.io.errors import EnvironmentFaultError, InputError
from rigid.io.files import read_bytes, replacing, write_fault
from rigid.io.values import Kinds, Known, pack, unpack

MOST = 1 << 33
"""Bytes of an entry."""
DIGEST = 65
"""Bytes of the first line."""


def _to_stderr(line: str) -> None:
    sys.stderr.write(line + "\n")


def _first_line(content: memoryview) -> bytes:
    return hashlib.sha256(content).hexdigest().encode() + b"\n"


class Entry(NamedTuple):
    """An entry as it is on disk: what it depends on, and the value as text and arrays."""

    mark: dict[str, str]
    tree: Any
    arrays: dict[str, np.ndarray]


@dataclass(frozen=True)
class Shelf:
    """A folder in which values stand by name.

    - `folder`: None: nothing is kept. - `mark`: what they depend on, by name; only a run with the
      same reads them. - `reads`: whether what an earlier run left may be read.
    - `tell`: is given a sentence where something that is there is not used.
    """

    folder: Path | None = None
    mark: Mapping[str, str] = field(default_factory=dict)
    reads: bool = False
    tell: Callable[[str], None] = _to_stderr

    def once(
        self, name: str, make: Callable[[], Any], kinds: Kinds = (), known: Known | None = None
    ) -> Any:
        """Read a value if it is there, or make it and keep it.

        - `kinds`: classes that it is made of. - `known`: parts of it that are not kept, by name.
        """
        found = self.read(name, kinds, known)
        if found is None:
            found = make()
            self.put(name, found, known)
        return found

    def read(self, name: str, kinds: Kinds = (), known: Known | None = None) -> Any:
        """The value of a name; None where there is none that this run may use."""
        entry = self._entry(name)
        if entry is None:
            return None
        if other := self.differs(entry):
            self.tell(f"{self._path(name)}: made with another {', '.join(other)}; made again")
            return None
        try:
            return unpack(entry.tree, entry.arrays, kinds, known or {})
        except (KeyError, ValueError, TypeError, RecursionError):
            return self._aside(name, "it is not what this version of rigid keeps")

    def put(self, name: str, value: Any, known: Known | None = None) -> None:
        """Keep a value; it is on the disk once this has returned.

        Raises EnvironmentFaultError when the disk does not take it.
        """
        if self.folder is None:
            return
        tree, arrays = pack(value, known or {})
        body = io.BytesIO()
        text = np.array(json.dumps({"mark": dict(self.mark), "value": tree}))
        np.savez(body, allow_pickle=False, text=text, **arrays)
        content = body.getbuffer()
        path = self._path(name)
        try:
            with replacing(path) as temporary, temporary.open("wb") as file:
                file.write(_first_line(content))
                file.write(content)
        except EnvironmentFaultError as error:
            raise EnvironmentFaultError(f"{error}, then --resume goes on") from error

    def others(self, name: str) -> list[str]:
        """What an entry was made with that this run has otherwise; none where there is none."""
        entry = self._entry(name)
        return [] if entry is None else self.differs(entry)

    def differs(self, entry: Entry) -> list[str]:
        """Names in the marks of an entry and of this run that do not say the same."""
        both = {**entry.mark, **self.mark}
        return [key for key in both if entry.mark.get(key) != self.mark.get(key)]

    def clear(self, *names: str) -> None:
        """Take values away that nothing needs any more; without a name, all of them.

        - `names`: `*` in one stands for any letters.
        """
        if self.folder is None:
            return
        for path in [p for name in names or ("*",) for p in self.folder.glob(f"{name}.kept")]:
            path.unlink(missing_ok=True)
        if not names:
            with suppress(OSError):  # what was set aside is left where it is
                self.folder.rmdir()

    def _path(self, name: str) -> Path:
        assert self.folder is not None  # whoever asks has looked
        return self.folder / f"{name}.kept"

    def _entry(self, name: str) -> Entry | None:
        """An entry whose digest is right; None where there is none."""
        if self.folder is None or not self.reads:
            return None
        try:
            content = read_bytes(self._path(name), MOST)
        except FileNotFoundError:
            return None
        except InputError:
            return self._aside(name, "it is no regular file")
        except OSError as error:
            raise write_fault(self._path(name), error) from error
        body = memoryview(content)[DIGEST:]
        if content[:DIGEST] != _first_line(body):
            return self._aside(name, "its SHA-256 is not the one in its first line")
        try:
            with np.load(io.BytesIO(body), allow_pickle=False) as file:
                arrays = {key: file[key] for key in file.files}
            told = json.loads(str(arrays.pop("text")))
            return Entry(told["mark"], told["value"], arrays)
        except (OSError, ValueError, KeyError, TypeError, RecursionError, BadZipFile):
            return self._aside(name, "it is not what this version of rigid keeps")

    def _aside(self, name: str, why: str) -> None:
        """Set an entry aside that is of no use, and tell."""
        path = self._path(name)
        aside = path.with_name(f"{path.name}.damaged")
        path.replace(aside)
        self.tell(f"{path}: damaged ({why}); set aside as {aside.name}, and made again")


NOTHING_KEPT = Shelf()

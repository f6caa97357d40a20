"""Results of long steps on disk, so that a run that goes on does not take them again."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from rigid.io.files import replacing

Arrays = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Shelf:
    """A folder in which results stand by name.

    - `folder`: None: nothing is kept. - `mark`: what they depend on, by name; only a run with the
      same reads them. - `reads`: whether what an earlier run left may be read.
    """

    folder: Path | None = None
    mark: Mapping[str, str] = field(default_factory=dict)
    reads: bool = False

    def once(self, name: str, make: Callable[[], Arrays]) -> Arrays:
        """Read a result if it is there, or make it and keep it."""
        if self.folder is None:
            return make()
        path = self.folder / f"{name}.npz"
        known = self._read(path) if self.reads else None
        if known is not None:
            return known
        made = make()
        with replacing(path) as temporary, temporary.open("wb") as file:
            np.savez(file, allow_pickle=False, mark=self._said(), **made)
        return made

    def clear(self, name: str) -> None:
        """Take a result away, where nothing needs it any more."""
        if self.folder is not None:
            (self.folder / f"{name}.npz").unlink(missing_ok=True)

    def _said(self) -> np.ndarray:
        return np.array(json.dumps(dict(self.mark), sort_keys=True))

    def _read(self, path: Path) -> Arrays | None:
        try:
            with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
                arrays = {name: file[name] for name in file.files}
        except (OSError, ValueError, KeyError, BadZipFile):
            return None  # not there or damaged: made again
        if str(arrays.pop("mark", "")) != str(self._said()):
            return None
        return arrays

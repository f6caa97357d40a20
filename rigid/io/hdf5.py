"""HDF5 files that hold all that they name: nothing outside them is read for their sake."""

from pathlib import Path

import h5py

from rigid.io.errors import InputError
from rigid.io.files import require_regular

MOST_BYTES = 64 << 30
"""Of a chain or a posterior."""


def require_own(path: Path) -> None:
    """Raise InputError for an HDF5 file that reaches outside itself.

    External and soft links, data kept in other files and virtual data sets: rigid writes none of
    them, and a file from a stranger could have any file of the reader's read through them.

    Raises OSError for what is no HDF5 file.
    """
    require_regular(path, path.stat(), MOST_BYTES)
    with h5py.File(path, "r") as file:
        _look(path, file)


def _look(path: Path, group: h5py.Group) -> None:
    for name in map(str, group):
        link = group.get(name, getlink=True)
        if not isinstance(link, h5py.HardLink):
            raise _outside(path, group, name, "a link to another place")
        held = group[name]
        if isinstance(held, h5py.Group):
            _look(path, held)
        elif isinstance(held, h5py.Dataset) and (held.external or held.is_virtual):
            raise _outside(path, group, name, "data kept in another file")


def _outside(path: Path, group: h5py.Group, name: str, what: str) -> InputError:
    place = f"{group.name}/{name}".replace("//", "/")
    return InputError(
        f"{path}: {place} is {what}, which rigid never writes; the file is refused. "
        "Make it again with `python -m rigid.fit`"
    )

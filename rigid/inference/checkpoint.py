"""The chain on disk: an HDF5 file to which each block of steps is added in one go.

The file has room for more blocks than it holds. Adding one writes numbers into room that is
already there and touches no structure of the file; then, once these are on the disk, the count of
complete blocks goes up by one. A run that is killed at any moment leaves a file that opens, and
what was half written lies beyond the count, where nobody looks. When the room is used up, a file
with twice the room takes its place.
"""

import errno
import json
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from types import TracebackType
from typing import Any

import h5py
import numpy as np

from rigid.inference.chain import Block, EnsembleBlock, EnsembleState, Layout
from rigid.inference.proposal import MixtureProposal, Mode
from rigid.io.errors import EnvironmentFaultError, InputError
from rigid.io.files import fsync, replacing, write_fault
from rigid.io.hdf5 import require_own

NAME = "chain.h5"
SCHEMA = 1
FIRST_ROOM = 8  # blocks; doubles as often as need be
KEYS = 624  # words of state of the Mersenne Twister that emcee draws from


class Checkpoint:
    """The file `chain.h5` of a folder.

    - directory: where it stands; made if need be. The caller holds `rigid.io.files.locked` on it
    - fingerprint: what the chain depends on, by name: sha256 of the spec and of each record,
      version. Put in nothing that only decides when to stop: a chain can go on under another rule
    - resume: go on with the chain that is there, if there is one; else start anew

    Use it as a context manager, or call `close`.

    Raises InputError when there is a chain but not one this run can go on with.
    """

    def __init__(
        self, directory: Path | str, fingerprint: Mapping[str, str], resume: bool = False
    ) -> None:
        self.path = Path(directory) / NAME
        self._fingerprint = dict(fingerprint)
        self._file: h5py.File | None = None
        if resume and self.path.exists():
            self._file = _open(self.path)
            try:
                _check_fingerprint(self._file, self.path, self._fingerprint)
            except InputError:
                self.close()
                raise

    @property
    def blocks(self) -> int:
        """Number of complete blocks on disk."""
        return 0 if self._file is None else int(_dataset(self._file, "complete")[0])

    @property
    def proposal(self) -> MixtureProposal | None:
        """The proposal the chain was begun with, so that a search need not run again."""
        return None if self._file is None else _read_proposal(self._file)

    def begin(self, layout: Layout, proposal: MixtureProposal) -> None:
        """Make a file for a new chain, or see that the one opened has the same layout.

        Raises InputError when it has not.
        """
        if self._file is None:
            with replacing(self.path) as temporary, h5py.File(temporary, "w") as file:
                _create(file, layout, proposal, self._fingerprint, FIRST_ROOM)
            self._file = _open(self.path)
            return
        there = _layout(self._file)
        for field in fields(Layout):
            old, new = getattr(there, field.name), getattr(layout, field.name)
            if old != new:
                raise InputError(
                    f"{self.path}: the chain was drawn with {field.name} = {old}, this run has "
                    f"{new}; set it back, or run without --resume to start anew"
                )

    def append(self, block: Block) -> None:
        """Put a complete block on the disk; it counts once this has returned.

        Raises EnvironmentFaultError when the disk does not take it.
        """
        file = self._opened()
        count = self.blocks
        try:
            if count == len(_dataset(file, "seconds")):
                file = self._grow(2 * count)
            for name, value in _columns(block).items():
                _dataset(file, name)[count] = value
            self._to_disk(file)
            _dataset(file, "complete")[0] = count + 1
            self._to_disk(file)
        except OSError as error:
            fault = write_fault(self.path, error)
            raise EnvironmentFaultError(f"{fault}, then --resume goes on") from error

    def read(self) -> list[Block]:
        """All complete blocks, in order."""
        file = self._opened()
        return [_block(file, i) for i in range(self.blocks)]

    def close(self) -> None:
        """Let go of the file."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def __enter__(self) -> "Checkpoint":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _opened(self) -> h5py.File:
        if self._file is None:
            raise RuntimeError("begin() comes first")
        return self._file

    def _to_disk(self, file: h5py.File) -> None:
        file.flush()
        fsync(self.path)

    def _grow(self, room: int) -> h5py.File:
        old = self._opened()
        proposal = _read_proposal(old)
        with replacing(self.path) as temporary:
            with h5py.File(temporary, "w") as new:
                _create(new, _layout(old), proposal, self._fingerprint, room)
                for i in range(self.blocks):
                    for name, value in _columns(_block(old, i)).items():
                        _dataset(new, name)[i] = value
                _dataset(new, "complete")[0] = self.blocks
            self.close()
        self._file = _open(self.path)
        return self._file


def _open(path: Path) -> h5py.File:
    try:
        require_own(path)
        file = h5py.File(path, "r+")
    except OSError as error:
        if error.errno in (errno.EAGAIN, errno.EWOULDBLOCK):
            raise EnvironmentFaultError(
                f"{path}: in use by another run; wait for it to end, or choose another folder "
                "with --out"
            ) from error
        if isinstance(error, PermissionError):
            raise EnvironmentFaultError(f"{path}: may not be read and written") from error
        raise _damaged(path) from error
    if file.attrs.get("schema") != SCHEMA or "complete" not in file:
        file.close()
        raise _damaged(path)
    return file


def _damaged(path: Path) -> InputError:
    return InputError(
        f"{path}: not a chain this version can read, or damaged; run without --resume to start anew"
    )


def _check_fingerprint(file: h5py.File, path: Path, wanted: dict[str, str]) -> None:
    there: dict[str, str] = json.loads(str(file.attrs["fingerprint"]))
    differ = [key for key in {**there, **wanted} if there.get(key) != wanted.get(key)]
    if differ:
        raise InputError(
            f"{path}: the chain was drawn with another {', '.join(differ)}, so it cannot be "
            "gone on with; run without --resume to start anew, or choose another folder with --out"
        )


def _create(
    file: h5py.File,
    layout: Layout,
    proposal: MixtureProposal,
    fingerprint: Mapping[str, str],
    room: int,
) -> None:
    file.attrs["schema"] = SCHEMA
    file.attrs["fingerprint"] = json.dumps(dict(fingerprint))
    for name, value in asdict(layout).items():
        file.attrs[name] = value
    for name, value in _proposal_arrays(proposal).items():
        file[f"proposal/{name}"] = value
    file["complete"] = np.zeros(1, dtype=np.int64)
    for name, (shape, dtype) in _shapes(layout).items():
        _reserve(file, name, (room, *shape), dtype)


def _reserve(file: h5py.File, name: str, shape: tuple[int, ...], dtype: Any) -> None:
    """Room in the file itself, in one piece, taken at once and not filled."""
    plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plan.set_layout(h5py.h5d.CONTIGUOUS)
    plan.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    plan.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    space = h5py.h5s.create_simple(shape)
    h5py.h5d.create(file.id, name.encode(), h5py.h5t.py_create(np.dtype(dtype)), space, plan)


def _shapes(layout: Layout) -> dict[str, tuple[tuple[int, ...], Any]]:
    """Shape and kind of each dataset, for one block."""
    e, w, d = layout.ensembles, layout.walkers, layout.dimension
    return {
        "z": ((e, layout.block, w, d), np.float64),
        "log_prob": ((e, layout.block, w), np.float64),
        "accepted": ((e, w), np.int64),
        "evaluations": ((e,), np.int64),
        "failed": ((e,), np.int64),
        "seconds": ((), np.float64),
        "state_coords": ((e, w, d), np.float64),
        "state_log_prob": ((e, w), np.float64),
        "state_keys": ((e, KEYS), np.uint32),
        "state_position": ((e,), np.int64),
        "state_has_gauss": ((e,), np.int64),
        "state_cached": ((e,), np.float64),
    }


_OF_BLOCK = ("z", "log_prob", "accepted", "evaluations", "failed")
_OF_STATE = ("coords", "log_prob", "keys", "position", "has_gauss", "cached")


def _columns(block: Block) -> dict[str, Any]:
    parts = block.ensembles
    columns = {name: np.stack([getattr(p, name) for p in parts]) for name in _OF_BLOCK}
    for name in _OF_STATE:
        columns[f"state_{name}"] = np.stack([getattr(p.state, name) for p in parts])
    return {**columns, "seconds": block.seconds}


def _block(file: h5py.File, index: int) -> Block:
    columns = {name: _dataset(file, name)[index] for name in (*_OF_BLOCK, "seconds")}
    states = {name: _dataset(file, f"state_{name}")[index] for name in _OF_STATE}
    parts = []
    for i in range(len(columns["z"])):
        words = {name: value[i] for name, value in states.items()}
        for name, kind in (("position", int), ("has_gauss", int), ("cached", float)):
            words[name] = kind(words[name])
        rest: dict[str, Any] = {name: columns[name][i] for name in _OF_BLOCK}
        for name in ("evaluations", "failed"):
            rest[name] = int(rest[name])
        parts.append(EnsembleBlock(**rest, state=EnsembleState(**words)))
    return Block(tuple(parts), float(columns["seconds"]))


def _layout(file: h5py.File) -> Layout:
    return Layout(**{field.name: int(str(file.attrs[field.name])) for field in fields(Layout)})


def _proposal_arrays(proposal: MixtureProposal) -> dict[str, Any]:
    return {
        "means": np.stack([mode.mean for mode in proposal.modes]),
        "factors": np.stack([mode.covariance_factor for mode in proposal.modes]),
        "log_posteriors": np.array([mode.log_posterior for mode in proposal.modes]),
        "weights": proposal.weights,
        "dof": np.array(proposal.dof),
    }


def _read_proposal(file: h5py.File) -> MixtureProposal:
    names = ("means", "factors", "log_posteriors", "weights", "dof")
    means, factors, logs, weights, dof = (_dataset(file, f"proposal/{n}")[()] for n in names)
    modes = tuple(Mode(m, f, float(p)) for m, f, p in zip(means, factors, logs, strict=True))
    return MixtureProposal(modes, weights, float(dof))


def _dataset(file: h5py.File, name: str) -> h5py.Dataset:
    item = file[name]
    if not isinstance(item, h5py.Dataset):
        raise _damaged(Path(str(file.filename)))
    return item

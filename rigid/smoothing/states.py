"""What is known before each block of a record, on disk, so that memory does not grow with draws."""

from pathlib import Path
from tempfile import TemporaryFile

import jax.numpy as jnp
import numpy as np

from rigid.io.files import write_fault
from rigid.smoothing.kalman import Filtered


class States:
    """States of a batch of draws, appended one after another and read back by their number.

    - `folder`: of the file, which has no name there and is gone with the process; None: where the
      system keeps such files.

    Raises EnvironmentFaultError where the disk is full.
    """

    def __init__(self, folder: Path | None = None):
        self._folder = folder
        self._file = TemporaryFile(dir=folder)  # noqa: SIM115 - open as long as the states are
        self._shapes: tuple[tuple[int, ...], ...] = ()
        self._size = 0

    def append(self, state: Filtered) -> None:
        """Keep the state before the next block; all are of the same shapes."""
        leaves = [np.asarray(leaf, dtype=float) for leaf in state]
        self._shapes = tuple(leaf.shape for leaf in leaves)
        flat = np.concatenate([leaf.ravel() for leaf in leaves])
        self._size = flat.nbytes
        try:
            self._file.write(flat.tobytes())
        except OSError as error:
            raise write_fault(self._folder or Path("temporary file"), error) from error

    def __getitem__(self, number: int) -> Filtered:
        """Return the state before block `number`."""
        self._file.seek(number * self._size)
        flat = np.frombuffer(self._file.read(self._size))
        ends = np.cumsum([int(np.prod(shape)) for shape in self._shapes])[:-1]
        parts = np.split(flat, ends)
        return Filtered(
            *(jnp.asarray(p.reshape(s)) for p, s in zip(parts, self._shapes, strict=True))
        )

    def close(self) -> None:
        """Let go of the file."""
        self._file.close()

"""A test whose load is sought as the smoother meets it: readings, blocks, a rough path."""

import dataclasses
from collections.abc import Mapping

import numpy as np
from scipy.ndimage import gaussian_filter1d

from rigid.smoothing.inputs import Inputs
from rigid.smoothing.plant import Rough

BLOCK = 512
"""Samples in one compiled stretch."""

NODE = 16
"""Samples between two nodes of the rig: in 0.16 s the oil column changes by 1 % at most."""

ROUGH_SPAN = 8.0
"""Samples over which the rough path of the rig is smoothed."""

STEPPED = 3.0
"""Times the median change from sample to sample beyond which a reading has moved."""


@dataclasses.dataclass(frozen=True)
class Channel:
    """What one series of readings is: its quantity, and the cylinder or joint it is read at."""

    quantity: str
    place: str

    @property
    def label(self) -> str:
        """As in the names of its gain, zero and noise."""
        return f"{self.quantity},{self.place}"


@dataclasses.dataclass(frozen=True)
class Setup:
    """What is read in a test, what drives it, and how readings tell its rough path.

    - `channels`; `inputs`. - `moved` (channels, coordinates): by how much each reading changes with
      each coordinate. - `oil`: of each column of oil, the channel of its pressure; None where none
      reads it. - `recorded`: of each recorded input, its channel. - `lively`: channels that tell
      where the load moves. - `node`: samples between two nodes; `ahead`: by how many a node
      lies behind its sample; `span`: over which the path is smoothed.
    """

    channels: tuple[Channel, ...]
    inputs: Inputs
    moved: tuple[tuple[float, ...], ...]
    oil: tuple[int | None, ...]
    recorded: tuple[int, ...] = ()
    lively: tuple[int, ...] = (0,)
    node: int = NODE
    ahead: float = 0.0
    span: float = ROUGH_SPAN

    @property
    def read(self) -> tuple[int, ...]:
        """Channels that are explained, not given."""
        return tuple(i for i in range(len(self.channels)) if i not in self.recorded)


QUANTITIES = ("load", "stroke", "pressure")
"""What is read of a cylinder of the rig, in this order."""


def rig_setup(cylinder: str) -> Setup:
    """Return what is read of a cylinder of the rig: the plunger moves, and there is one oil."""
    channels = tuple(Channel(quantity, cylinder) for quantity in QUANTITIES)
    return Setup(channels, Inputs((cylinder,), (cylinder,)), ((0.0,), (1.0,), (0.0,)), (2,))


@dataclasses.dataclass(frozen=True, eq=False)
class Field:
    """One cylinder in one field record, or one test of a machine.

    - `name`, `kind`; `place`: the cylinder, "" where it is a whole machine. - `files`: sha256 of
      each, by what was read in it. - `first`, `interval` [s].
    - `reading` (samples, channels) SI, `known` (samples, channels): 1 or 0. - `setup`.
    """

    name: str
    place: str
    files: Mapping[str, str]
    first: float
    interval: float
    reading: np.ndarray
    known: np.ndarray
    setup: Setup
    kind: str = "field"

    @property
    def samples(self) -> int:
        """Number of samples."""
        return len(self.reading)

    @property
    def blocks(self) -> int:
        """Number of blocks, the last one padded."""
        return -(-self.samples // BLOCK)

    @property
    def label(self) -> str:
        """Name and cylinder, as in results."""
        return f"{self.name},{self.place}" if self.place else self.name

    def without(self, aside: np.ndarray) -> "Field":
        """Return the record in which some readings (samples, channels) are not known."""
        return dataclasses.replace(self, known=np.where(aside, 0.0, self.known))

    def cut(self, first: int, last: int) -> "Field":
        """Return the samples from `first` to before `last`."""
        return dataclasses.replace(
            self,
            first=self.first + first * self.interval,
            reading=self.reading[first:last],
            known=self.known[first:last],
        )


def rough(field: Field) -> Rough:
    """Return the rough path of a record at its nodes, one more than whole blocks hold."""
    setup, index = field.setup, np.arange(field.samples)
    read = np.stack(
        [_filled(*pair, index) for pair in zip(field.reading.T, field.known.T, strict=True)]
    )
    smooth = gaussian_filter1d(read, setup.span, axis=1, mode="nearest")
    place = smooth.T @ np.linalg.pinv(np.array(setup.moved)).T
    speed = np.gradient(place, field.interval, axis=0)
    pressure = np.zeros((field.samples, len(setup.oil)))
    for oil, channel in enumerate(setup.oil):
        if channel is not None:
            pressure[:, oil] = smooth[channel]
    nodes = np.arange(field.blocks * BLOCK // setup.node + 1) * setup.node + setup.ahead

    def at_nodes(columns: np.ndarray) -> np.ndarray:
        out = np.empty((len(nodes), columns.shape[1]))
        for i, column in enumerate(columns.T):
            out[:, i] = np.interp(nodes, index, column)
        return out

    moved = at_nodes(place), at_nodes(speed)
    return Rough(*moved, at_nodes(pressure), at_nodes(read[list(setup.recorded)].T))


def _filled(reading: np.ndarray, known: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Readings with straight lines over what was not read; zeros where nothing was."""
    read = known > 0
    return np.interp(index, index[read], reading[read]) if read.any() else np.zeros(len(index))


def liveliest(field: Field, blocks: int) -> slice:
    """Samples of the `blocks` blocks in which what tells of the load changes most often."""
    if field.blocks <= blocks:
        return slice(0, field.samples)
    lively = field.reading[:, list(field.setup.lively)]
    change = np.abs(np.diff(lively, axis=0, prepend=lively[:1]))
    moved = (change > STEPPED * np.median(change, axis=0)).sum(axis=1)
    count = np.add.reduceat(moved, np.arange(0, field.samples, BLOCK))
    first = int(np.argmax(np.convolve(count, np.ones(blocks, dtype=int), "valid"))) * BLOCK
    return slice(first, min(first + blocks * BLOCK, field.samples))


def node_places(node: int) -> np.ndarray:
    """Place of every sample of a block on the way from the node before it to the next."""
    return (np.arange(BLOCK) % node) / node

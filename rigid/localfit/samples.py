"""All samples of a campaign as one long list, and their likelihood around expected readings."""

import dataclasses
from collections.abc import Container, Mapping
from functools import cached_property
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.io.compiled import compiled
from rigid.likelihood.channels import SensorSheet
from rigid.likelihood.problem import Problem
from rigid.likelihood.set_aside import Aside, listed
from rigid.localfit.families import Swept


class ChannelKey(NamedTuple):
    """One quantity in one record: `track` is "record,cylinder", `sensor` "quantity,cylinder"."""

    track: str
    kind: str
    quantity: str
    sensor: str
    interval: float


class Stretch(NamedTuple):
    """Samples of one quantity in one group of records, channel after channel.

    - `sheet`: of their sensors. - `size`: how many. - `sensors`: number of each channel's sensor.
    """

    sheet: SensorSheet
    size: int
    sensors: tuple[int, ...]


@dataclasses.dataclass(frozen=True)
class Layout:
    """Where each sample stands; n samples, piece after piece, channel after channel.

    - `problem`: whose pieces they are.
    - `channels`; `channel` (n,): number of each sample's channel. - `time` (n,) [s].
    - `weight` (n,): 0 where nothing was read, below 1 where a sample is less than one fact, above
      where it is quieter than its sensor's usually are.
    - `tails`: degrees of freedom of the noise, by quantity, where the weights take it for
      Student's. - `loud` (n,): variance of a sample's noise over that of its sensor.
    """

    problem: Problem
    channels: tuple[ChannelKey, ...]
    channel: np.ndarray
    time: np.ndarray
    weight: np.ndarray
    loud: np.ndarray
    tails: Mapping[str, float] = dataclasses.field(default_factory=dict)

    @cached_property
    def read(self) -> np.ndarray:
        """Where something was read (n,)."""
        return self.weight > 0.0

    @cached_property
    def floor(self) -> np.ndarray:
        """Least root mean square of the residuals of each sample's sensor (n,)."""
        sheets = [p.sheet.floor for p in self.problem.pieces for _ in p.tracks]
        return np.array(sheets)[self.channel]

    @cached_property
    def tracks(self) -> tuple[str, ...]:
        """Labels of the records, "record,cylinder"."""
        return tuple(dict.fromkeys(c.track for c in self.channels))

    @cached_property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of the records."""
        return tuple(dict.fromkeys(c.kind for c in self.channels))

    def of_kinds(self, kinds: Container[str]) -> np.ndarray:
        """Which samples are of records of some kinds (n,)."""
        return np.array([c.kind in kinds for c in self.channels])[self.channel]

    @cached_property
    def track(self) -> np.ndarray:
        """Number of each sample's record (n,)."""
        numbers = np.array([self.tracks.index(c.track) for c in self.channels])
        return numbers[self.channel]

    def of_record(self, name: str) -> np.ndarray:
        """Which samples are of a record, whatever its cylinders (n,)."""
        return self._records[name]

    @cached_property
    def _records(self) -> dict[str, np.ndarray]:
        """Which samples are of each record, by its name."""
        names = np.array([self.problem.track(label).name for label in self.tracks])
        return {name: (names == name)[self.track] for name in dict.fromkeys(names.tolist())}

    @cached_property
    def sensor(self) -> np.ndarray:
        """Number of each sample's sensor (n,), in the order of `problem.sensors`."""
        listed = self.problem.sensors
        return np.array([listed.index(c.sensor) for c in self.channels])[self.channel]

    @cached_property
    def spreads(self) -> np.ndarray:
        """Prior sds of gain [-] and zero of every sensor (sensors, 2)."""
        pieces = self.problem.pieces
        sheets = {p.sensor(i): p.sheet.spread for p in pieces for i in range(len(p.tracks))}
        return np.array([sheets[sensor] for sensor in self.problem.sensors])

    @cached_property
    def stretches(self) -> tuple[Stretch, ...]:
        """The samples, piece after piece."""
        listed = self.problem.sensors
        return tuple(
            Stretch(p.sheet, p.data.size, tuple(listed.index(p.sensor(i)) for i in range(count)))
            for p in self.problem.pieces
            for count in (len(p.tracks),)
        )

    def mean_weights(self) -> dict[tuple[str, str], float]:
        """Mean weight of what was read, by label of the record and quantity."""
        found = {}
        for number, channel in enumerate(self.channels):
            read = self.weight[(self.channel == number) & self.read]
            if len(read):
                found[channel.track, channel.quantity] = float(read.mean())
        return found

    @property
    def weighed_problem(self) -> Problem:
        """The problem with these weights."""
        weights, at = {}, 0
        for p in self.problem.pieces:
            here = self.weight[at : at + p.data.size]
            weights[p.group, p.quantity] = here.reshape(p.data.shape[::-1]).T
            at += p.data.size
        return self.problem.with_weights(weights)

    def weighed(self, weight: np.ndarray) -> "Layout":
        """Return the same samples with other weights (n,)."""
        return dataclasses.replace(self, weight=weight)


def lay_out(problem: Problem) -> Layout:
    """List the samples of a problem with the weights it has."""
    channels, number, time, weight = [], [], [], []
    for piece in problem.pieces:
        tracks = problem.groups[piece.group].tracks
        for i, t in enumerate(piece.tracks):
            track, rows = tracks[t], piece.data.shape[0]
            number.append(np.full(rows, len(channels)))
            channels.append(
                ChannelKey(track.label, track.kind, piece.quantity, piece.sensor(i), track.interval)
            )
            time.append(float(track.first) + track.interval * np.arange(rows))
            weight.append(np.asarray(piece.weight[:, i]))
    channel, when, weights = (np.concatenate(part) for part in (number, time, weight))
    return Layout(problem, tuple(channels), channel, when, weights, np.ones(len(weights)))


def flat_readings(layout: Layout, swept: list[dict[str, np.ndarray]]) -> np.ndarray:
    """Ideal readings (or slopes) of all samples (n, lanes) from those of the groups."""
    parts = []
    for piece in layout.problem.pieces:
        series = swept[piece.group][piece.quantity]
        parts += [series[:, t] for t in piece.tracks]
    return np.concatenate(parts)


def split_swept(layout: Layout, swept: Swept) -> tuple[np.ndarray, np.ndarray]:
    """Readings and slopes of all samples, (n, lanes) each."""
    readings = flat_readings(layout, [one for one, _ in swept])
    return readings, flat_readings(layout, [two for _, two in swept])


class Terms(NamedTuple):
    """Log-likelihood of each sample (n,), its slope and minus its curvature by the reading."""

    value: np.ndarray
    score: np.ndarray
    curvature: np.ndarray


@compiled
def _terms(
    stretches: tuple[Stretch, ...], residual: Array, sigma: Array
) -> list[tuple[Array, Array, Array]]:
    """Terms of each stretch, weights left out; `residual` (n,), `sigma` (sensors,)."""
    parts, at = [], 0
    for one in stretches:
        here = residual[at : at + one.size].reshape(len(one.sensors), -1)
        at += one.size
        law = one.sheet.noise_model(sigma[np.array(one.sensors), None])
        point = law(here)
        parts.append((point.value.ravel(), point.slope.ravel(), -point.curvature.ravel()))
    return parts


def terms(layout: Layout, residual: np.ndarray, sigma: np.ndarray) -> Terms:
    """Likelihood of all samples.

    - `residual` (n,): recorded less expected. - `sigma` (sensors,): noise levels.
    """
    parts = _terms(layout.stretches, jnp.asarray(residual), jnp.asarray(sigma))
    together = (np.concatenate([np.asarray(x) for x in part]) for part in zip(*parts, strict=True))
    return Terms(*(layout.weight * part for part in together))


def data_of(layout: Layout) -> np.ndarray:
    """What was read, (n,)."""
    return np.concatenate([np.asarray(p.data).T.ravel() for p in layout.problem.pieces])


def aside_of(layout: Layout) -> tuple[Aside, ...]:
    """Samples that were read but do not count, by channel."""
    return listed(layout.problem, lay_out(layout.problem).read & ~layout.read)

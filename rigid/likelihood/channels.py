"""From ideal readings to a log-likelihood: every sensor with its own gain, zero and noise.

A sensor is a quantity on a cylinder; its gain and zero are the same in every record. Weights
carry two things: 0 where nothing was read, and below 1 where residuals are correlated in time, so
that a channel counts as many facts as it holds (see `rigid.likelihood.correlation`).
"""

import dataclasses
from collections.abc import Callable, Mapping
from functools import partial, reduce
from operator import add

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.likelihood import noise
from rigid.likelihood.groups import AbstractGroup
from rigid.likelihood.noise import Spread
from rigid.likelihood.tracks import Series

BLOCK = 64
"""Samples summed at a time; a block of all tracks and walkers stays in the processor's cache."""


@dataclasses.dataclass(frozen=True)
class SensorSheet:
    """What a sensor's sheet says of it, SI.

    - `step`: of the converter, 0 where there is none. - `noise`: sd of one sample before it.
    - `gain_sd` [-], `zero_sd`: spread of gain and zero between sensors.
    - `stated_step`: what the sheet says where the converter was found to be coarser; None: `step`.
    """

    step: float
    noise: float
    gain_sd: float
    zero_sd: float
    stated_step: float | None = None

    @property
    def floor(self) -> float:
        """Least root mean square of residuals that the sheet allows: noise and rounding."""
        step = self.step if self.stated_step is None else self.stated_step
        return float(np.sqrt(self.noise**2 + step**2 / 12.0))

    @property
    def spread(self) -> Spread:
        """Prior spread of gain and zero."""
        return Spread(self.gain_sd, self.zero_sd)


class Piece(eqx.Module):
    """One quantity of one group of records.

    - `group`: its number. - `quantity`. - `sheet`: of its sensors.
    - `tracks`: which tracks of the group have it. - `cylinders`: on which cylinder each is.
    - `data`, `weight` (samples, len(tracks)).
    """

    group: int = eqx.field(static=True)
    quantity: str = eqx.field(static=True)
    sheet: SensorSheet = eqx.field(static=True)
    tracks: tuple[int, ...] = eqx.field(static=True)
    cylinders: tuple[str, ...] = eqx.field(static=True)
    data: Array = eqx.field(converter=jnp.asarray)
    weight: Array = eqx.field(converter=jnp.asarray)

    def sensor(self, i: int) -> str:
        """Label of the sensor that read track `i` of the piece: "quantity,cylinder"."""
        return f"{self.quantity},{self.cylinders[i]}"

    def sigma(self, values: Mapping[str, Array]) -> Array:
        """Noise of each track (tracks, walkers)."""
        return jnp.stack([values[f"noise[{self.sensor(i)}]"] for i in range(len(self.tracks))])

    def reading(self, predictions: list[dict[str, Array]]) -> Array:
        """Ideal readings (samples, tracks, walkers)."""
        series = predictions[self.group][self.quantity]
        everything = self.tracks == tuple(range(series.shape[1]))
        return series if everything else series[:, np.array(self.tracks)]

    def summed(self, terms: Callable, reading: Array) -> tuple[Array, ...]:
        """Sum `terms(data, weight, reading)` over all samples, a block of them at a time.

        - `terms`: returns a tuple of arrays (tracks, walkers), summed over the first axis of its
          arguments. - `reading` (samples, tracks, walkers).
        """
        blocks = -(-self.data.shape[0] // BLOCK)
        room = blocks * BLOCK - self.data.shape[0]

        def cut(series: Array) -> Array:
            padded = jnp.pad(series, ((0, room),) + ((0, 0),) * (series.ndim - 1))
            return padded.reshape(blocks, BLOCK, *series.shape[1:])

        series = (self.data[..., None], self.weight[..., None], reading)
        like = jax.eval_shape(terms, *(s[:1] for s in series))
        start = tuple(jnp.zeros(x.shape) for x in like)

        def add(sums: tuple, block: tuple) -> tuple[tuple, None]:
            return tuple(a + b for a, b in zip(sums, terms(*block), strict=True)), None

        return jax.lax.scan(add, start, tuple(cut(s) for s in series))[0]


def make_pieces(
    groups: tuple[AbstractGroup, ...],
    series: Mapping[str, Series],
    sheets: Mapping[str, SensorSheet],
) -> tuple[Piece, ...]:
    """List what there is to explain, quantity by quantity in every group.

    - `series`: what was read, by the label of the track.
    """
    pieces = []
    for number, group in enumerate(groups):
        read = [series[t.label] for t in group.tracks]
        for quantity in group.quantities:
            tracks = tuple(i for i, s in enumerate(read) if s.has(quantity))
            if not tracks:
                continue
            data = [read[i].padded(quantity, group.samples) for i in tracks]
            pieces.append(
                Piece(
                    number,
                    quantity,
                    sheets[quantity],
                    tracks,
                    tuple(group.tracks[i].cylinder for i in tracks),
                    np.stack([d for d, _ in data], axis=1),
                    np.stack([w for _, w in data], axis=1),
                )
            )
    return tuple(pieces)


def calibrations(
    pieces: tuple[Piece, ...], predictions: list[dict[str, Array]], values: Mapping[str, Array]
) -> dict[str, noise.Calibration]:
    """Return every sensor's most probable gain and zero under Gaussian noise, (walkers,)."""
    sums: dict[str, noise.Sums] = {}
    spreads = {}
    for piece in pieces:
        variance = piece.sigma(values) ** 2 + piece.sheet.step**2 / 12.0
        sums_here = piece.summed(noise.moments, piece.reading(predictions))
        sums_here = noise.Sums(*(x / variance for x in sums_here))
        for i in range(len(piece.tracks)):
            label = piece.sensor(i)
            mine = noise.Sums(*(x[i] for x in sums_here))
            known = sums.get(label)
            if known is not None:
                mine = noise.Sums(*(a + b for a, b in zip(known, mine, strict=True)))
            sums[label] = mine
            spreads[label] = piece.sheet.spread
    return {label: noise.least_squares(s, spreads[label]) for label, s in sums.items()}


@dataclasses.dataclass(frozen=True)
class Fitted:
    """Log-likelihood with gains and zeros integrated out, and what came of the sensors.

    - `value` (walkers,). - `sensors`: marginal law of each sensor's gain and zero.
    - `tracks`: by (group, track), the log-likelihood of its samples at the expansion point.
    """

    value: Array
    sensors: dict[str, noise.Marginal]
    tracks: dict[tuple[int, int], Array]


def fitted(
    pieces: tuple[Piece, ...], predictions: list[dict[str, Array]], values: Mapping[str, Array]
) -> Fitted:
    """Integrate gain and zero of every sensor out of the likelihood of all samples."""
    at = calibrations(pieces, predictions, values)
    expansions: dict[str, noise.Quadratic] = {}
    spreads, tracks = {}, {}
    for piece in pieces:
        labels = [piece.sensor(i) for i in range(len(piece.tracks))]
        law = noise.sample_law(piece.sigma(values), piece.sheet.step, piece.sheet.noise)
        expand = partial(
            noise.quadratic,
            law,
            jnp.stack([at[label].gain for label in labels]),
            jnp.stack([at[label].zero for label in labels]),
        )
        sums = piece.summed(expand, piece.reading(predictions))
        for i, label in enumerate(labels):
            mine = noise.Quadratic(*(x[i] for x in sums))
            expansions[label] = mine + expansions[label] if label in expansions else mine
            spreads[label] = piece.sheet.spread
            key = (piece.group, piece.tracks[i])
            tracks[key] = tracks.get(key, 0.0) + mine.value
    sensors = {
        label: noise.marginal(expansion, at[label], spreads[label])
        for label, expansion in expansions.items()
    }
    return Fitted(reduce(add, (s.value for s in sensors.values())), sensors, tracks)

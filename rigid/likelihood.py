"""From ideal readings to a log-likelihood: every sensor with its own gain, zero and noise.

A sensor is a quantity on a cylinder; its gain and zero are the same in every record. Weights
carry two things: 0 where nothing was read, and below 1 where residuals are correlated in time, so
that a channel counts as many facts as it holds (see `rigid.correlation`).
"""

import dataclasses
from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid import noise
from rigid.groups import AbstractGroup


@dataclasses.dataclass(frozen=True)
class SensorSheet:
    """What a sensor's sheet says of it, SI.

    - `step`: of the converter, 0 where there is none. - `noise`: sd of one sample before it.
    - `gain_sd` [-], `zero_sd`: spread of gain and zero between sensors.
    """

    step: float
    noise: float
    gain_sd: float
    zero_sd: float

    @property
    def floor(self) -> float:
        """Least root mean square of residuals: noise and rounding together."""
        return float(np.sqrt(self.noise**2 + self.step**2 / 12.0))

    @property
    def spread(self) -> noise.Spread:
        """Prior spread of gain and zero."""
        return noise.Spread(self.gain_sd, self.zero_sd)


@dataclasses.dataclass(frozen=True)
class Piece:
    """One quantity of one group of records.

    - `group`: its number. - `quantity`. - `sheet`: of its sensors.
    - `tracks`: which tracks of the group have it. - `cylinders`: on which cylinder each is.
    - `data`, `weight` (samples, len(tracks)).
    """

    group: int
    quantity: str
    sheet: SensorSheet
    tracks: tuple[int, ...]
    cylinders: tuple[str, ...]
    data: np.ndarray
    weight: np.ndarray

    def sensor(self, i: int) -> str:
        """Label of the sensor that read track `i` of the piece: "quantity,cylinder"."""
        return f"{self.quantity},{self.cylinders[i]}"

    def sigma(self, values: Mapping[str, Array]) -> Array:
        """Noise of each track (tracks, walkers)."""
        return jnp.stack([values[f"noise[{self.sensor(i)}]"] for i in range(len(self.tracks))])

    def reading(self, predictions: list[dict[str, Array]]) -> Array:
        """Ideal readings (samples, tracks, walkers)."""
        return predictions[self.group][self.quantity][:, np.array(self.tracks)]


def make_pieces(
    groups: tuple[AbstractGroup, ...], sheets: Mapping[str, SensorSheet]
) -> tuple[Piece, ...]:
    """List what there is to explain, quantity by quantity in every group."""
    pieces = []
    for number, group in enumerate(groups):
        for quantity, sheet in sheets.items():
            weight = group.stacked("weight", quantity)
            tracks = tuple(int(i) for i in np.flatnonzero(weight.any(axis=0)))
            explained = ("acceleration",) if group.tracks[0].onset is not None else (
                "load", "stroke", "pressure")
            if not tracks or quantity not in explained:
                continue
            data = group.stacked("data", quantity)[:, tracks]
            cylinders = tuple(group.tracks[i].cylinder for i in tracks)
            pieces.append(
                Piece(number, quantity, sheet, tracks, cylinders, data, weight[:, tracks])
            )
    return tuple(pieces)


def calibrations(
    pieces: tuple[Piece, ...], predictions: list[dict[str, Array]], values: Mapping[str, Array]
) -> dict[str, noise.Calibration]:
    """Return the most probable gain and zero of every sensor under Gaussian noise, (walkers,) each."""
    sums: dict[str, noise.Sums] = {}
    spreads = {}
    for piece in pieces:
        m = piece.reading(predictions)
        variance = piece.sigma(values) ** 2 + piece.sheet.step**2 / 12.0
        w = jnp.asarray(piece.weight)[..., None]
        r = jnp.asarray(piece.data)[..., None] - m
        sums_here = noise.Sums(
            *(noise.total(w * x) / variance for x in (jnp.ones_like(m), m, m * m, r, r * m))
        )
        for i in range(len(piece.tracks)):
            label = piece.sensor(i)
            mine = noise.Sums(*(x[i] for x in sums_here))
            known = sums.get(label)
            sums[label] = mine if known is None else noise.Sums(
                *(a + b for a, b in zip(known, mine, strict=True))
            )
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
        m, sigma = piece.reading(predictions), piece.sigma(values)
        labels = [piece.sensor(i) for i in range(len(piece.tracks))]
        gain = jnp.stack([at[label].gain for label in labels])
        zero = jnp.stack([at[label].zero for label in labels])
        r = jnp.asarray(piece.data)[..., None] - (1.0 + gain) * m - zero
        point = noise.sample(r, sigma, piece.sheet.step, piece.sheet.noise)
        total = noise.quadratic(point, m, jnp.asarray(piece.weight)[..., None])
        for i, label in enumerate(labels):
            mine = noise.Quadratic(*(x[i] for x in total))
            expansions[label] = mine + expansions[label] if label in expansions else mine
            spreads[label] = piece.sheet.spread
            key = (piece.group, piece.tracks[i])
            tracks[key] = tracks.get(key, 0.0) + mine.value
    sensors = {
        label: noise.marginal(expansion, at[label], spreads[label])
        for label, expansion in expansions.items()
    }
    return Fitted(sum(s.value for s in sensors.values()), sensors, tracks)


def deviance_residuals(
    pieces: tuple[Piece, ...],
    predictions: list[dict[str, Array]],
    values: Mapping[str, Array],
    corrections: Mapping[str, noise.Calibration],
) -> Array:
    """Stack the weighted deviance residuals of all samples read, for a least-squares solver."""
    rows = []
    for piece in pieces:
        m, sigma = piece.reading(predictions), piece.sigma(values)
        labels = [piece.sensor(i) for i in range(len(piece.tracks))]
        gain = jnp.stack([corrections[label].gain for label in labels])
        zero = jnp.stack([corrections[label].zero for label in labels])
        r = jnp.asarray(piece.data)[..., None] - (1.0 + gain) * m - zero
        deviance = noise.deviance_residual(r, sigma, piece.sheet.step, piece.sheet.noise)
        rows.append((jnp.sqrt(jnp.asarray(piece.weight))[..., None] * deviance)[..., 0].ravel())
    return jnp.concatenate(rows)

"""From ideal readings to a log-likelihood: every sensor with its own gain, zero and noise.

A sensor is a quantity on a cylinder; its gain and zero are the same in every record. Weights
carry two things: 0 where nothing was read, and below 1 where residuals are correlated in time, so
that a channel counts as many facts as it holds (see `rigid.likelihood.correlation`).
"""

import dataclasses
from collections.abc import Callable, Mapping

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.likelihood import noise
from rigid.likelihood.groups import AbstractGroup
from rigid.likelihood.noise import Spread
from rigid.likelihood.quantisation import Point
from rigid.likelihood.tracks import Series


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
    def nodes(self) -> int:
        """Of the law of a sample that is the interval of values that round to it; 0: a density."""
        return noise.rounding(self.step, self.noise)

    def noise_model(self, sigma: Array) -> Callable[[Array], Point]:
        """Log-probability of samples by their residuals, at noise levels `sigma`."""
        return noise.sample_law(sigma, self.step, self.nodes)

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

    @property
    def sensors(self) -> list[str]:
        """Labels of the sensors, track by track."""
        return [self.sensor(i) for i in range(len(self.tracks))]

    def sigma(self, values: Mapping[str, Array]) -> Array:
        """Noise of each track (tracks, walkers)."""
        return jnp.stack([values[f"noise[{label}]"] for label in self.sensors])

    def reading(self, predictions: list[dict[str, Array]]) -> Array:
        """Ideal readings (samples, tracks, walkers)."""
        series = predictions[self.group][self.quantity]
        everything = self.tracks == tuple(range(series.shape[1]))
        return series if everything else series[:, np.array(self.tracks)]


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

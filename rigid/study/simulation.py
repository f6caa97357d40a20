"""Readings that given numbers would make the sensors of a study show."""

from collections.abc import Mapping

import jax
import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from rigid.io.compiled import compiled
from rigid.likelihood.parameters import require_known
from rigid.likelihood.problem import Problem

Readings = dict[str, dict[str, Array]]
"""By "record,cylinder", then by quantity, (samples,)."""


def simulate(problem: Problem, values: Mapping[str, ArrayLike], key: Array | None) -> Readings:
    """Return the readings of every sensor.

    - `values`: SI scalars by label; those left out are at their prior medians. `gain[load,A]` [1]
      and `zero[load,A]` [SI] correct a sensor; left out they are 0.
    - `key`: of random numbers, to add noise and rounding; None: as an ideal sensor reads.

    Raises InputError for labels that nothing answers to.
    """
    medians = problem.parameters.values(jnp.zeros((1, problem.parameters.size)))
    faults = {f"{fault}[{sensor}]" for sensor in problem.sensors for fault in ("gain", "zero")}
    require_known(values, medians.keys() | faults, "simulate")
    given = {label: jnp.reshape(jnp.asarray(v, float), (1,)) for label, v in values.items()}
    lengths = {track.label: int(track.samples) for track in problem.tracks}
    readings = {
        label: {quantity: series[: lengths[label]] for quantity, series in channels.items()}
        for label, channels in _readings(problem, medians | given).items()
    }
    if key is None:
        return readings
    return _noisy(problem, readings, medians | given, key)


@compiled
def _readings(problem: Problem, values: dict[str, Array]) -> Readings:
    """Readings with gains and zeros, without noise, on the grids of the groups."""
    out: Readings = {}
    for group, predicted in zip(problem.groups, problem.predict(values), strict=True):
        for i, track in enumerate(group.tracks):
            out[track.label] = {
                quantity: _corrected(series[:, i, 0], f"{quantity},{track.cylinder}", values)
                for quantity, series in predicted.items()
            }
    return out


def _corrected(reading: Array, sensor: str, values: Mapping[str, Array]) -> Array:
    """Put a sensor's gain and zero into its readings."""
    gain, zero = (values.get(f"{fault}[{sensor}]", jnp.zeros(1))[0] for fault in ("gain", "zero"))
    return (1.0 + gain) * reading + zero


def _noisy(
    problem: Problem, readings: Readings, values: Mapping[str, Array], key: Array
) -> Readings:
    """Add noise, and round to the converter's steps, where the sensor was read."""
    out = {label: dict(channels) for label, channels in readings.items()}
    for piece in problem.pieces:
        sigma = piece.sigma(values)[:, 0]
        for i, place in enumerate(piece.tracks):
            key, own = jax.random.split(key)
            label = problem.groups[piece.group].tracks[place].label
            reading = readings[label][piece.quantity]
            made = reading + sigma[i] * jax.random.normal(own, reading.shape)
            step = piece.sheet.step
            out[label][piece.quantity] = jnp.round(made / step) * step if step > 0.0 else made
    return out

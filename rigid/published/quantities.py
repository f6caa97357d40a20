"""What a rig would show of each number that the paper prints.

A release is linear here: its motion is a sum of exponentials, one for each eigenvalue of the rig's
Jacobian at rest, each with a share given by the state under the preload.
"""

from collections.abc import Mapping
from functools import cache
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Complex, Float, Int

from rigid.effects.base import AbstractEffect
from rigid.effects.pump_curve import HALF_DROP, MEAN_FLOW
from rigid.physics.rig import CORE_SCALES, FREE, build_rig
from rigid.physics.step_matrices import jacobian

WATCHED = 0.04
"""Seconds over which the strongest oscillation is judged; the impulses of Fig. 8 last as long."""

SLOWEST = 2 * np.pi * 5.0
"""rad/s below which a motion is no oscillation in a record of 40 ms."""

FULL_FLOW = MEAN_FLOW + HALF_DROP
"""m^3/s of the pump at low pressure, eq. (22)."""

Effects = tuple[type[AbstractEffect], ...]
Values = Mapping[str, np.ndarray]


class Response(NamedTuple):
    """A release as a sum of exponentials.

    - `rates` [1/s]: eigenvalues, (n, modes).
    - `acceleration` [m/s^2] (n, modes), `pressure` [Pa] (n, cylinders, modes): their shares at once
      after the release; a sum over modes of share times exp(rate t) is the motion.
    """

    rates: Complex[np.ndarray, "n modes"]
    acceleration: Complex[np.ndarray, "n modes"]
    pressure: Complex[np.ndarray, "n cylinders modes"]


def response(effects: Effects, values: Values) -> Response:
    """Part the release of a rig into its modes.

    - `effects`: what acts. - `values`: SI by label, (n,) each, `preload` [N] among them.
    """
    given = {label: jnp.asarray(v) for label, v in values.items()}
    matrix = _linear(effects)(given)
    scale = np.array(CORE_SCALES + tuple(s for e in effects for s in e.scales))
    balanced = np.moveaxis(np.asarray(matrix), -1, 0) * scale / scale[:, None]
    rates, shapes = np.linalg.eig(balanced)
    shares = _shares(shapes, at_rest(values, len(scale)) / scale)
    return Response(
        rates.astype(complex),
        rates * shapes[:, 3] * shares * scale[3],
        (shapes[:, 4] * shares * scale[4])[:, None],
    )


def at_rest(values: Values, size: int) -> Float[np.ndarray, "n size"]:
    """State at rest under the preload: the load-cell end pressed in, the oil at F/S, else 0.

    Holds for a linear load-cell end, whatever else is linear (tests hold it against the solver's).
    """
    start = np.zeros((len(values["k_LC"]), size))
    start[:, 0] = start[:, 2] = -values["preload"] / values["k_LC"]
    start[:, 4] = values["preload"] / values["S_Pl"]
    return start


@cache
def _linear(effects: Effects):
    """Compiled: values to the Jacobian at rest, (n, n, points)."""

    def made(values: Mapping[str, Array]):
        rig = build_rig(effects, values)
        return jacobian(rig, FREE, rig.column)

    return jax.jit(made)


def _shares(shapes: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Coefficients of `start` (n, d) in the eigenvectors (n, d, d).

    A free root has two equal eigenvalues 0 with one vector; where rounding leaves them exactly
    alike the matrix is tilted by rounding errors, which no oscillating share sees.
    """
    right = start[..., None].astype(complex)
    try:
        return np.linalg.solve(shapes, right)[..., 0]
    except np.linalg.LinAlgError:
        d = start.shape[1]
        tilt = 1e-12 * np.random.default_rng(0).standard_normal((d, d))
        return np.linalg.solve(shapes + tilt, right)[..., 0]


def superposed(
    parts: list[Response], weights: list[np.ndarray], sides: list[tuple[float, ...]]
) -> Response:
    """Responses of one cylinder each that do not touch each other, added up.

    - `weights`: of the accelerations, (n,) each. - `sides`: what a part adds to the pressure of
      each cylinder, 1 or -1.
    """
    return Response(
        np.concatenate([p.rates for p in parts], 1),
        np.concatenate(
            [p.acceleration * w[:, None] for p, w in zip(parts, weights, strict=True)], 1
        ),
        np.concatenate(
            [p.pressure * np.array(s)[:, None] for p, s in zip(parts, sides, strict=True)], 2
        ),
    )


def strongest(found: Response) -> Int[np.ndarray, " n"]:
    """Index of the oscillation with the greatest share of the recorded acceleration, squared.

    -1 where nothing oscillates.
    """
    swings = np.imag(found.rates) > SLOWEST
    decay = np.maximum(-2.0 * np.real(found.rates), 1e-9)
    power = np.abs(found.acceleration) ** 2 * -np.expm1(-decay * WATCHED) / decay
    power = np.where(swings, power, -1.0)
    best = np.argmax(power, axis=1)
    return np.where(power[np.arange(len(best)), best] > 0.0, best, -1)


def period(found: Response) -> Float[np.ndarray, " n"]:
    """Period [s] of the strongest oscillation; infinite where nothing oscillates."""
    best = strongest(found)
    swing = np.imag(found.rates)[np.arange(len(best)), best]
    return np.where(best < 0, np.inf, 2 * np.pi / np.where(best < 0, 1.0, swing))


def e_folding(found: Response) -> Float[np.ndarray, " n"]:
    """Seconds in which the strongest oscillation falls by e; 0 where nothing oscillates."""
    best = strongest(found)
    decay = -np.real(found.rates)[np.arange(len(best)), best]
    return np.where(best < 0, 0.0, 1.0 / np.maximum(decay, 1e-9))


def visible(found: Response, share: np.ndarray) -> Float[np.ndarray, " n"]:
    """Seconds until every oscillation has fallen below a share (n,) of the strongest at first."""
    swings = np.imag(found.rates) > SLOWEST
    height = np.where(swings, np.abs(found.acceleration), 0.0)
    least = np.maximum(height.max(axis=1) * share, 1e-30)[:, None]
    decay = np.maximum(-np.real(found.rates), 1e-9)
    lasts = np.log(np.maximum(height, 1e-30) / least) / decay
    return np.maximum(np.where(swings, lasts, 0.0).max(axis=1), 0.0)


def least_pressure(
    found: Response, until: float = 0.03, steps: int = 151
) -> Float[np.ndarray, " n"]:
    """Least oil pressure [Pa, gauge] in any cylinder within `until` seconds.

    As if oil could be pulled; within 1 % of the swing for periods above 2 ms.
    """
    now, turn = found.pressure, np.exp(found.rates * until / (steps - 1))[:, None]
    least = np.full(len(found.rates), np.inf)
    for _ in range(steps):
        least = np.minimum(least, np.sum(now, axis=2).real.min(axis=1))
        now = now * turn
    return least


def acceleration(found: Response, time: np.ndarray) -> Float[np.ndarray, "n times"]:
    """Acceleration of the plate [m/s^2] at times [s] after the release."""
    return np.stack(
        [np.sum(found.acceleration * np.exp(found.rates * t), axis=1).real for t in time], axis=1
    )


def frame_stroke(load: float, values: Values) -> Float[np.ndarray, " n"]:
    """Stroke [m] at a load [N] in the frame, eqs. (15) and (16), the offset taken off."""
    return load / values["k_LC"] + load / values["k_frame"]


def running_speed(fraction: float, area: float = 44.2e-4) -> float:
    """Speed [m/s] of a plunger that runs free with a flow fraction of the pump at low pressure."""
    return fraction * FULL_FLOW / area

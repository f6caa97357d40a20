"""Runs of the package's own solver that stand in for records that are not public."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from rigid.effects.base import AbstractEffect
from rigid.io.compiled import compiled
from rigid.physics.full import solved
from rigid.physics.rest import rest_under
from rigid.physics.rig import Surroundings, build_rig
from rigid.published.walk.constants import Constants

TOLERANCE = 1e-6
"""Of the solver: a hundredth of what a page shows of a curve."""

History = tuple[np.ndarray, np.ndarray]
"""Times [s], rising, and the load [N] on the plate there, compression positive: F_Ice of (20) with
its sign mended."""
NO_LOAD: History = (np.array([0.0, 1.0]), np.zeros(2))


@dataclass(frozen=True)
class Stretch:
    """A part of a run in which nothing outside the rig changes but a load of a history.

    - `until` [s]. - `flow_fraction` [1]. - `in_frame`: whether the frame is in the way.
    """

    until: float
    flow_fraction: float = 0.0
    in_frame: bool = False


@dataclass(frozen=True, eq=False)
class Trajectory:
    """What a rig did, by draw of its constants; index 0 has the constants as printed.

    - `time` (times,) [s]. - `stroke`, `plunger` [m], `pressure` [Pa], `load` [N]: (draws, times).
    """

    time: Float[np.ndarray, " times"]
    stroke: Float[np.ndarray, "draws times"]
    plunger: Float[np.ndarray, "draws times"]
    pressure: Float[np.ndarray, "draws times"]
    load: Float[np.ndarray, "draws times"]

    def band(self, name: str) -> Float[np.ndarray, "3 times"]:
        """As printed, and 5 and 95 % of the draws, of one of the quantities."""
        values = getattr(self, name)
        return np.stack([values[0], *np.percentile(values, (5, 95), axis=0)])


class _Course(NamedTuple):
    """What is done in a run, stretch after stretch, as arrays: runs of one shape share a program.

    - `begin`, `end` (stretches,) [s]; `times` (stretches, most) [s]: asked for in each, and its end
      again and again behind them. - `flow_fraction`, `in_frame` (stretches,).
    - `knots`, `loads` (knots,): the history of the load.
    """

    begin: Array
    end: Array
    times: Array
    flow_fraction: Array
    in_frame: Array
    knots: Array
    loads: Array


def run(
    effects: Sequence[type[AbstractEffect]],
    drawn: Sequence[Constants],
    stretches: Sequence[Stretch],
    times: Float[np.ndarray, " times"],
    history: History = NO_LOAD,
) -> Trajectory:
    """Solve one history for several rigs.

    - `drawn`: constants and parameters of the effects [SI] by label; `kappa_factor` in them
      multiplies the flow fractions. - `times` [s]: rising, from 0, when the rig is at rest.
    - `history`: of the load; stretches end where it bends.
    """
    values = {label: jnp.asarray([one[label] for one in drawn]) for label in drawn[0]}
    ends = np.array([stretch.until for stretch in stretches])
    part = np.minimum(np.searchsorted(ends, times, side="right"), len(ends) - 1)
    inside = [times[part == number] for number in range(len(ends))]
    most = max(len(one) for one in inside)
    asked = [
        np.append(one, np.full(most - len(one), end)) for one, end in zip(inside, ends, strict=True)
    ]
    course = _Course(
        jnp.asarray([0.0, *ends[:-1]]),
        jnp.asarray(ends),
        jnp.asarray(asked),
        jnp.asarray([stretch.flow_fraction for stretch in stretches]),
        jnp.asarray([float(stretch.in_frame) for stretch in stretches]),
        *(jnp.asarray(one) for one in history),
    )
    states, loads = (np.asarray(one) for one in _solve(tuple(effects), values, course))
    place = np.concatenate([np.arange(len(one)) for one in inside])
    states, loads = states[:, part, place], loads[:, part, place]
    return Trajectory(times, states[..., 2] - states[..., 0], states[..., 2], states[..., 4], loads)


@compiled
def _solve(
    effects: tuple[type[AbstractEffect], ...], values: Mapping[str, Array], course: _Course
) -> tuple[Array, Array]:
    """States (draws, stretches, most, n) and loads F_LC [N] (draws, stretches, most)."""

    def one(values: Mapping[str, Array]) -> tuple[Array, Array]:
        rig = build_rig(effects, values)
        factor = values.get("kappa_factor", jnp.asarray(1.0))

        def stretch(flat: Array, now: _Course) -> tuple[Array, tuple[Array, Array]]:
            def outside(time: Array) -> Surroundings:
                pressed = -jnp.interp(time, course.knots, course.loads)
                contact = now.in_frame * values["k_frame"]
                return Surroundings(contact, pressed, factor * now.flow_fraction, time)

            def rates(time: Array, flat: Array) -> Array:
                moved = rig.motion(flat, outside(time)).rates
                return jnp.stack([jnp.broadcast_to(rate, ()) for rate in moved])

            def load(flat: Array, time: Array) -> Array:
                return jnp.broadcast_to(rig.motion(flat, outside(time)).load, ())

            asked = jnp.append(now.times, now.end)
            when = (now.begin, now.end), asked
            path = solved(rates, rig.scales, flat, when, TOLERANCE, np.inf)
            states = jnp.where(path.ended, path.states, jnp.nan)
            return states[-1], (states[:-1], jax.vmap(load)(states[:-1], now.times))

        steps = course._replace(knots=None, loads=None)
        return jax.lax.scan(stretch, rest_under(rig, 0.0), steps)[1]

    return jax.lax.map(one, values)

"""Runs of the package's own solver that stand in for records that are not public."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Float

from rigid.effects.base import AbstractEffect, Action, State
from rigid.physics.full import integrate
from rigid.physics.rest import rest_under
from rigid.physics.rig import Rig, Surroundings, build_rig
from rigid.published.walk.constants import Constants

History = tuple[np.ndarray, np.ndarray]
"""Times [s], rising, and the load [N] on the plate there, compression positive."""


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


def loaded(history: History) -> type[AbstractEffect]:
    """An effect that presses on the plate as a history says: F_Ice of (20) with its sign mended."""
    times, loads = (jnp.asarray(part) for part in history)

    class LoadHistory(AbstractEffect):
        """A load on the plate over time."""

        name: ClassVar[str] = "load-history"
        equation: ClassVar[str] = "plunger-momentum"
        source: ClassVar[str] = "paper, eq. (20) and the text on Fig. 10"

        def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
            """Return the force on the plunger."""
            return Action(on_plunger=-jnp.interp(state.time, times, loads))

    return LoadHistory


def run(
    effects: Sequence[type[AbstractEffect]],
    drawn: Sequence[Constants],
    stretches: Sequence[Stretch],
    times: Float[np.ndarray, " times"],
) -> Trajectory:
    """Solve one history for several rigs.

    - `drawn`: constants and parameters of the effects [SI] by label; `kappa_factor` in them
      multiplies the flow fractions. - `times` [s]: rising, from 0, when the rig is at rest.
    """
    labels = drawn[0].keys()
    values = {label: jnp.asarray([one[label] for one in drawn]) for label in labels}
    solve = eqx.filter_jit(_solver(tuple(effects), tuple(stretches), times))
    states, loads = jax.lax.map(solve, values)
    states = np.asarray(states)
    return Trajectory(
        times, states[..., 2] - states[..., 0], states[..., 2], states[..., 4], np.asarray(loads)
    )


def _solver(
    effects: tuple[type[AbstractEffect], ...],
    stretches: tuple[Stretch, ...],
    times: np.ndarray,
) -> Callable[[dict[str, Array]], tuple[Array, Array]]:
    """Return a function of one rig's values to its states (times, n) and loads (times,)."""
    begins = (0.0, *(s.until for s in stretches[:-1]))

    def solve(values: dict[str, Array]) -> tuple[Array, Array]:
        rig = build_rig(effects, values)
        factor = values.get("kappa_factor", jnp.asarray(1.0))
        flat = rest_under(rig, 0.0)
        parts, loads = [], []
        for stretch, begin in zip(stretches, begins, strict=True):
            last = stretch is stretches[-1]
            inside = (times >= begin) & (
                (times <= stretch.until) if last else times < stretch.until
            )
            grid = np.unique([begin, *times[inside], stretch.until])
            contact = values["k_frame"] if stretch.in_frame else jnp.asarray(0.0)
            outside = Surroundings(contact, 0.0, factor * stretch.flow_fraction, 0.0)
            path = integrate(rig, outside, flat, jnp.asarray(grid))
            flat = path[-1]
            kept = path[np.searchsorted(grid, times[inside])]
            parts.append(kept)
            loads.append(_loads(rig, kept, outside, times[inside]))
        return jnp.concatenate(parts), jnp.concatenate(loads)

    return solve


def _loads(rig: Rig, states: Array, outside: Surroundings, times: np.ndarray) -> Array:
    """F_LC [N] along a path."""

    def load(flat: Array, time: Array) -> Array:
        return jnp.broadcast_to(rig.motion(flat, outside._replace(time=time)).load, ())

    return jax.vmap(load)(states, jnp.asarray(times))

"""Which strokes a rig will come through, roughly: where its step matrices are to be made.

Masses and friction are left out. Of the oil that flows in, one part moves the plunger against
the springs in its way, load cell and frame in series, and the rest is compressed: with K of the
springs and K_oil = S^2 dp/dV of the oil column, dx/dt = q/S K_oil/(K + K_oil) and p = K x/S.

Arrays carry the walkers on their last axis: every operation is elementwise over it.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.physics.drive import Drives
from rigid.physics.rig import Rig, Surroundings
from rigid.physics.step_matrices import mean_growth

PARTS = 16
"""Steps a stretch of the valve's programme; the pump's flow changes with pressure within it."""

MOST_GROWTH = 2.0
"""Growth of a flow back to the tank, which rises as the pressure falls, soon comes to its end."""

SHORTENED = 1e-3
"""Compression of the load-cell end [m] at which its stiffness is taken."""

LEAST_RANGE = 1e-3
"""Nodes of interpolation [m] stand this far apart at least."""


class Strokes(NamedTuple):
    """Rough strokes; they place interpolation nodes, no more.

    - `low`, `high` (walkers,) [m]: the range of the group.
    - `switch` (tracks, switches, walkers) [m]: at each switch of the valve.
    """

    low: Array
    high: Array
    switch: Array

    def place(self, column: Array, stroke: Array) -> Array:
        """Place of a stroke between the least (0) and the greatest (1), in 1 over the oil column.

        The column enters the rig as its inverse. Where friction holds a plunger back, strokes stay
        far below those foreseen, and a parabola in the stroke was off by 2 % in what a sample does.

        - `column` (walkers,) [m]: of oil at no stroke.
        """
        linear = (stroke - self.low) / (self.high - self.low)
        return linear * (column + self.high) / (column + stroke)

    def at(self, column: Array, place: float) -> Array:
        """Stroke (walkers,) at a place."""
        first, last = 1.0 / (column + self.low), 1.0 / (column + self.high)
        return 1.0 / (first + place * (last - first)) - column


def foreseen(rig: Rig, contact: Array, fractions: Array, drives: Drives) -> Strokes:
    """Foresee the strokes of a group of slow records; arguments as of `slow.march`.

    Nothing is differentiated through them: a node of interpolation is no result.
    """
    rig, contact, fractions = jax.tree.map(jax.lax.stop_gradient, (rig, contact, fractions))
    begin, length, level = _stretches(drives)
    track = jnp.arange(fractions.shape[1])
    spring = _spring(rig, contact)
    none = jnp.zeros((len(rig.scales), *fractions.shape[1:]))

    def speed(stroke: Array, outside: Surroundings) -> Array:
        column, flat = rig.column + stroke, none.at[4].set(spring * stroke / rig.area)
        filling = rig.motion(flat, outside, column).rates[4]
        squeezed = filling - rig.motion(flat.at[3].set(1.0), outside, column).rates[4]
        return rig.area * filling / (spring + rig.area * squeezed)

    def part(stroke: Array, step: tuple[Array, ...]) -> tuple[Array, Array]:
        now, span, passed = step
        outside = Surroundings(contact, 0.0, fractions[passed, track], now[:, None])
        along = (stroke,), (jnp.ones_like(stroke),)
        moved, slope = jax.jvp(lambda x: speed(x, outside), *along)
        # Where the flow falls with pressure, at the bend of the pump's curve, this is stiff.
        growth = mean_growth(jnp.minimum(span[:, None] * slope, MOST_GROWTH))
        stroke = stroke + span[:, None] * growth * moved
        return stroke, stroke

    times = begin[:, None] + length[:, None] * (np.arange(PARTS)[:, None] + 0.5) / PARTS
    steps = (
        times.reshape(-1, len(drives.samples)),
        jnp.repeat(length / PARTS, PARTS, axis=0),
        jnp.repeat(level, PARTS, axis=0),
    )
    path = jax.lax.scan(part, none[0], steps)[1]
    low = jnp.minimum(jnp.min(path, axis=(0, 1)), 0.0)
    high = jnp.maximum(jnp.max(path, axis=(0, 1)), low + LEAST_RANGE)
    switch = jnp.moveaxis(path[PARTS - 1 :: PARTS], 0, 1)
    return Strokes(low, high, switch)


def _stretches(drives: Drives) -> tuple[Array, Array, Array]:
    """Begin and length [s] of all stretches between switches, flow; (stretches, tracks)."""
    last = drives.end[:, None]
    bounds = jnp.concatenate([jnp.zeros_like(last), drives.switches, last], axis=1)
    bounds = jnp.clip(bounds, 0.0, last)
    return bounds[:, :-1].T, jnp.diff(bounds, axis=1).T, drives.levels.T


def _spring(rig: Rig, contact: Array) -> Array:
    """Stiffness [N/m] of load cell and frame in series; 0 out of load."""
    flat = jnp.zeros((len(rig.scales), *rig.column.shape)).at[0].set(-SHORTENED)
    cell = jnp.asarray(rig.motion(flat, Surroundings(), rig.column).load) / SHORTENED
    together = jnp.where(cell + contact > 0.0, cell + contact, 1.0)
    return jnp.where(contact > 0.0, cell * contact / together, 0.0)

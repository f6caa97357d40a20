"""The rig between two samples as a linear step, made of its own equations.

The state is the rig's flat state and three numbers that nobody records: the ice load F [N]
(compression positive), its slope [N/s], and kappa, the share of the pump's flow. Within a short
step of length h the rig is linear about a rough path known from the record, and the load moves on
a straight line, so that

    y(t + h) = E y(t) + c + G w

is exact for a linear rig: E is the matrix exponential of the Jacobian of `Rig.motion`. What changes
slowly (the oil column, what the pump gives) is taken at nodes along the record, and the steps
between them are interpolated.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from rigid.physics.rig import Rig, Surroundings
from rigid.physics.sensors import readings
from rigid.physics.step_matrices import step_matrix

LATENT_SCALES = (1e3, 1e5, 1e-1)
"""Typical size of the ice load [N], its slope [N/s] and kappa [-]."""

LOAD, SLOPE, KAPPA = -3, -2, -1
"""Places of the latent numbers in the state."""

QUANTITIES = ("load", "stroke", "pressure")
"""What a field record holds, in the order of every array here."""

SHOWN = 3
"""Numbers that are reported: ice load, displacement of the plate, kappa."""


class Reference(NamedTuple):
    """The rough path that a record shows, at its nodes, (nodes,) each.

    - `stroke` [m], `speed` [m/s], `pressure` [Pa].
    """

    stroke: Array
    speed: Array
    pressure: Array


class Calibration(NamedTuple):
    """What the sensors add to an ideal reading m, (3,) each: (1 + `gain`) m + `zero` [SI]."""

    gain: Array
    zero: Array


class Nodes(NamedTuple):
    """Steps and sensors at the nodes of one draw, in units of `scales`.

    - `step` (nodes, n, n): E. - `drift` (nodes, n): c. - `entry` (nodes, n, 3): G, how movements of
      the load, its slope and kappa enter a step.
    - `sense` (nodes, 3, n), `offset` (nodes, 3): readings are `sense` y + `offset`, SI.
    """

    step: Array
    drift: Array
    entry: Array
    sense: Array
    offset: Array


def scales(rig: Rig) -> Array:
    """Typical size of each entry of the state."""
    return jnp.asarray(rig.scales + LATENT_SCALES)


def shown(rig: Rig) -> Array:
    """Return the rows that take load, displacement and kappa out of a state in units of scales."""
    size = scales(rig)
    n = size.shape[0]
    rows = jnp.zeros((SHOWN, n))
    for row, place in enumerate((n + LOAD, 2, n + KAPPA)):
        rows = rows.at[row, place].set(size[place])
    return rows


def nodes(rig: Rig, path: Reference, sensors: Calibration, length: float) -> Nodes:
    """Linearise one draw of the rig along the path; `length` [s] is that of a step."""
    return jax.vmap(lambda p: _node(rig, p, sensors, length))(path)


def _node(rig: Rig, at: Reference, sensors: Calibration, length: float) -> Nodes:
    n = len(rig.scales)
    size = scales(rig)
    column = rig.column + at.stroke
    point = jnp.zeros(n).at[2].set(at.stroke).at[3].set(at.speed).at[4].set(at.pressure)

    def rates(flat: Array, force: Array, kappa: Array) -> Array:
        moved = rig.motion(flat, Surroundings(0.0, -force, kappa), column).rates
        return jnp.stack([jnp.broadcast_to(r, ()) for r in moved])

    none = jnp.zeros(())
    given = jax.jacfwd(rates, 2)(point, none, none)[4]
    kappa = -rates(point, none, none)[4] / given  # what keeps the pressure where it is
    by_state, by_load, by_kappa = jax.jacfwd(rates, (0, 1, 2))(point, none, kappa)
    rest = rates(point, none, kappa) - by_state @ point - by_kappa * kappa
    matrix = jnp.zeros((n + 3, n + 3)).at[:n, :n].set(by_state)
    matrix = matrix.at[:n, LOAD].set(by_load).at[:n, KAPPA].set(by_kappa)
    matrix = matrix.at[n + 3 + LOAD, SLOPE].set(1.0)
    phi = step_matrix(matrix, length, tuple(rig.scales) + LATENT_SCALES)
    step = (jnp.eye(n + 3) + matrix @ phi) * size / size[:, None]
    drift = phi @ jnp.concatenate([rest, jnp.zeros(3)]) / size
    ramp = step[:, SLOPE] * (LATENT_SCALES[0] / (length * LATENT_SCALES[1]))
    ramp = ramp.at[SLOPE].set(0.0)
    unit = jnp.eye(n + 3)
    entry = jnp.stack([ramp, unit[:, SLOPE], unit[:, KAPPA]], axis=1)
    return Nodes(step, drift, entry, *_sensed(rig, point, sensors))


def _sensed(rig: Rig, point: Array, sensors: Calibration) -> tuple[Array, Array]:
    """What sensors with gain and zero read, linear in the state in units of scales."""

    def read(flat: Array) -> Array:
        made = readings(rig, flat, Surroundings())[:3]
        return jnp.stack([jnp.broadcast_to(r, ()) for r in made])

    slope = jax.jacfwd(read)(point)
    rest = read(point) - slope @ point
    wide = jnp.concatenate([slope * jnp.asarray(rig.scales), jnp.zeros((3, 3))], axis=1)
    gain = 1.0 + sensors.gain
    return gain[:, None] * wide, gain * rest + sensors.zero

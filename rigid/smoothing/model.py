"""A plant between two samples as a linear step, made of its own equations.

The state is the plant's flat state and the numbers that drive it from outside, which nobody
recorded: loads [N] (compression positive), their slopes [N/s], and what valves pass. Within a short
step of length h the plant is linear about a rough path known from the record, and loads move on
straight lines, so that

    y(t + h) = E y(t) + c + G w

is exact for a linear plant: E is the matrix exponential of the Jacobian of its rates. What changes
slowly (the oil column, what the pump gives) is taken at nodes along the record, and the steps
between them are interpolated.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from rigid.physics.step_matrices import step_matrix
from rigid.smoothing.plant import AbstractPlant, Rough


class Calibration(NamedTuple):
    """What sensors add to an ideal reading m, (channels,) each: (1 + `gain`) m + `zero` [SI]."""

    gain: Array
    zero: Array


class Nodes(NamedTuple):
    """Steps and sensors at the nodes of one draw, in units of `scales`.

    - `step` (nodes, n, n): E. - `drift` (nodes, n): c. - `entry` (nodes, n, inputs): G, how
      movements of loads, slopes and flow fractions enter a step.
    - `sense` (nodes, channels, n), `offset` (nodes, channels): readings are `sense` y + `offset`,
      SI.
    """

    step: Array
    drift: Array
    entry: Array
    sense: Array
    offset: Array


def scales(plant: AbstractPlant) -> Array:
    """Typical size of each entry of the state."""
    return jnp.asarray(plant.scales + plant.inputs.scales)


def shown(plant: AbstractPlant) -> Array:
    """Return the rows that take what is told of a test out of a state in units of scales."""
    inputs, size = plant.inputs, scales(plant)
    n, whole = len(plant.scales), size.shape[0]
    moved = jax.jacfwd(plant.displaced)(jnp.zeros(n))
    unit = jnp.eye(whole)
    loads = unit[n : n + len(inputs.loads)]
    displaced = jnp.zeros((len(inputs.loads), whole)).at[:, :n].set(moved)
    flows = unit[whole - len(inputs.flows) :]
    return jnp.concatenate([loads, displaced, flows]) * size


def nodes(plant: AbstractPlant, path: Rough, sensors: Calibration, length: float) -> Nodes:
    """Linearise one draw of a plant along the path; `length` [s] is that of a step."""
    return jax.vmap(lambda at: _node(plant, at, sensors, length))(path)


def _node(plant: AbstractPlant, at: Rough, sensors: Calibration, length: float) -> Nodes:
    inputs, own = plant.inputs, len(plant.scales)
    straight, many = inputs.straight, len(inputs.flows)
    size, whole = scales(plant), own + inputs.count
    slopes = own + straight
    about = _about(plant, at)
    by_state, by_straight, by_flows = jax.jacfwd(plant.rates, (0, 1, 2))(*about)
    linear = by_state @ about[0] + by_straight @ about[1] + by_flows @ about[2]
    rest = plant.rates(*about) - linear
    matrix = jnp.zeros((whole, whole)).at[:own, :own].set(by_state)
    matrix = matrix.at[:own, own:slopes].set(by_straight).at[:own, whole - many :].set(by_flows)
    matrix = matrix.at[own:slopes, slopes : slopes + straight].set(jnp.eye(straight))
    phi = step_matrix(matrix, length, plant.scales + inputs.scales)
    step = (jnp.eye(whole) + matrix @ phi) * size / size[:, None]
    drift = phi @ jnp.concatenate([rest, jnp.zeros(inputs.count)]) / size
    unit = jnp.eye(whole)
    ramps = step[:, slopes : slopes + straight] * (
        size[own:slopes] / (length * size[slopes : slopes + straight])
    )
    ramps = ramps.at[slopes : slopes + straight].set(0.0)
    entry = jnp.concatenate([ramps, unit[:, slopes:]], axis=1)
    return Nodes(step, drift, entry, *_sensed(plant, about, sensors))


def _about(plant: AbstractPlant, at: Rough) -> tuple[Array, Array, Array]:
    """State, straight inputs and flow fractions about which a plant is linearised.

    Flow fractions that nobody recorded are those that hold what is balanced where it is.
    """
    point, balanced = plant.point(at), jnp.asarray(plant.balanced, int)
    given = jnp.concatenate([jnp.zeros(len(plant.inputs.loads)), at.recorded])
    shut = jnp.zeros(len(plant.inputs.flows))
    moved = plant.rates(point, given, shut)[balanced]
    filled = jax.jacfwd(plant.rates, 2)(point, given, shut)[balanced]
    return point, given, -moved / jnp.diagonal(filled)


def _sensed(
    plant: AbstractPlant, about: tuple[Array, Array, Array], sensors: Calibration
) -> tuple[Array, Array]:
    """What sensors with gain and zero read, linear in the state in units of scales."""
    slopes = jax.jacfwd(plant.read, (0, 1, 2))(*about)
    rest = plant.read(*about) - sum(by @ here for by, here in zip(slopes, about, strict=True))
    by_state, by_straight, by_flows = slopes
    unmoved = jnp.zeros_like(by_straight)  # no sensor reads how fast a load rises
    wide = jnp.concatenate([by_state, by_straight, unmoved, by_flows], axis=1) * scales(plant)
    gain = 1.0 + sensors.gain
    return gain[:, None] * wide, gain * rest + sensors.zero

"""What each sensor would read of a simulated state, before gain, zero and converter."""

from typing import NamedTuple

from jax import Array

from rigid.physics.rig import Motion, Rig, Surroundings

UNITS = {
    "load": "N",
    "stroke": "m",
    "pressure": "Pa",
    "acceleration": "m/s^2",
    "position": "m",
    "force": "N",
}
"""What the sensors read, by quantity, and its SI unit; the last two on other machines."""


class Readings(NamedTuple):
    """Ideal readings; each broadcasts over tracks and walkers.

    - `load` [N]: force in the load-cell end, compression positive.
    - `stroke` [m]: plunger relative to cylinder.
    - `pressure` [Pa]: gauge.
    - `acceleration` [m/s^2]: of the plate.
    """

    load: Array | float
    stroke: Array
    pressure: Array
    acceleration: Array


def readings(rig: Rig, flat: Array | tuple, outside: Surroundings) -> Readings:
    """Return what ideal sensors read of a flat state."""
    return readings_of(rig.motion(flat, outside), flat)


def readings_of(motion: Motion, flat: Array | tuple) -> Readings:
    """Return what ideal sensors read of a flat state whose motion is known."""
    beside = motion.distortion
    return Readings(
        motion.load + beside.load,
        flat[2] - flat[0] + beside.stroke,
        flat[4] + beside.pressure,
        motion.plunger_acceleration + beside.acceleration,
    )

"""What drives a test and what is read of it: the rig's equations of motion as a smoother sees them.

A plant is one draw of a rig or a machine, with the effects that act on it.
"""

from abc import abstractmethod
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.physics.rig import Rig, Surroundings
from rigid.physics.sensors import readings
from rigid.smoothing.inputs import Inputs


class Rough(NamedTuple):
    """The rough path that a record shows, at its nodes (nodes, ...), or at one of them.

    - `place`, `speed` (..., coordinates): of what moves [m or rad, and /s]. - `pressure`
      (..., oils) [Pa]. - `recorded` (..., recorded): forces [N] and commands, as recorded.
    """

    place: Array | np.ndarray
    speed: Array | np.ndarray
    pressure: Array | np.ndarray
    recorded: Array | np.ndarray


class AbstractPlant(eqx.Module):
    """One draw of what a test drives; `inputs`: what drives it."""

    inputs: eqx.AbstractVar[Inputs]

    @property
    @abstractmethod
    def scales(self) -> tuple[float, ...]:
        """Typical size of each entry of its flat state."""

    @property
    @abstractmethod
    def balanced(self) -> tuple[int, ...]:
        """Entries of the state, one a flow fraction, that it holds where they are on its path."""

    @abstractmethod
    def point(self, at: Rough) -> Array:
        """Return the flat state (n,) about which it is linearised."""

    @abstractmethod
    def rates(self, flat: Array, straight: Array, flows: Array) -> Array:
        """Return the rates (n,) of a flat state under loads and recorded inputs, and flows."""

    @abstractmethod
    def read(self, flat: Array, straight: Array, flows: Array) -> Array:
        """Return what ideal sensors read (channels,), SI."""

    @abstractmethod
    def displaced(self, flat: Array) -> Array:
        """Return how far it has moved against each load (loads,) [m]; linear in the state."""


class RigPlant(AbstractPlant):
    """One cylinder of the rig that presses on ice, eqs. (19)-(22)."""

    rig: Rig
    inputs: Inputs = eqx.field(static=True)

    @property
    def scales(self) -> tuple[float, ...]:
        """As the rig's."""
        return self.rig.scales

    @property
    def balanced(self) -> tuple[int, ...]:
        """The oil pressure."""
        return (4,)

    def point(self, at: Rough) -> Array:
        """Return a rig at rest but for its plunger and its oil."""
        flat = jnp.zeros(len(self.scales))
        return flat.at[2].set(at.place[0]).at[3].set(at.speed[0]).at[4].set(at.pressure[0])

    def rates(self, flat: Array, straight: Array, flows: Array) -> Array:
        """Return the rates under the ice load and kappa; the oil column is that of the path."""
        column = self.rig.column + jax.lax.stop_gradient(flat[2] - flat[0])
        moved = self.rig.motion(flat, Surroundings(0.0, -straight[0], flows[0]), column).rates
        return jnp.stack([jnp.broadcast_to(rate, ()) for rate in moved])

    def read(self, flat: Array, straight: Array, flows: Array) -> Array:
        """Return load, stroke and pressure."""
        outside = Surroundings(force=-straight[0], flow_fraction=flows[0])
        read = readings(self.rig, flat, outside)[:3]
        return jnp.stack([jnp.broadcast_to(one, ()) for one in read])

    def displaced(self, flat: Array) -> Array:
        """Return where the plate is."""
        return flat[2:3]

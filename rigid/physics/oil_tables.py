"""Step matrices of rigs that are not steady: made at work, and moved with what the oil gives way.

A step matrix is a polynomial in a place: of the oil column between two of them, or, where air makes
the oil many times softer at rest than at work, its stiffness.
"""

from collections.abc import Callable, Sequence
from functools import reduce
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.physics.rig import Rig, Surroundings
from rigid.physics.step_matrices import apply, step_matrix

AT_WORK = (-1e-3, 0.0, 1e-3, 0.0, 136e5)
"""State at which the Jacobian is taken [m, m/s, m, m/s, Pa]: 60 kN, in contact."""


SOFT = np.linspace(0.0, 1.0, 4)
"""Stiffness of the oil, as a share of that at work, at which step matrices are made where it is
soft at rest."""


def at_work(rig: Rig, outside: Surroundings, column: Array) -> Array:
    """Jacobian (n, n, *column.shape) of the rig at work."""
    n = len(rig.scales)
    state = _working(rig, column)
    shape = state.shape[1:]

    def rates(flat: Array) -> Array:
        moved = rig.motion(flat, outside, column).rates
        return jnp.stack([jnp.broadcast_to(r, shape) for r in moved])

    def along(i: Array) -> Array:
        return jax.jvp(rates, (state,), (jnp.zeros_like(state).at[i].set(1.0),))[1]

    return jnp.moveaxis(jax.vmap(along)(jnp.arange(n)), 0, 1)


def _working(rig: Rig, column: Array) -> Array:
    """Flat state (n, *column.shape) of the rig at work."""
    shape = jnp.broadcast_shapes(column.shape, rig.column.shape)
    core = jnp.stack([jnp.full(shape, v) for v in AT_WORK])
    return jnp.concatenate([core, jnp.zeros((len(rig.scales) - len(AT_WORK), *shape))])


class Table(NamedTuple):
    """A, Phi(h) and Phi(h/2) of one rig as polynomials in a place: coefficients (n, n, ...).

    A goes along with the oil as Phi does: with one A for all of a record, errors are of first order
    in h.
    """

    matrix: tuple[Array, ...]
    whole: tuple[Array, ...]
    half: tuple[Array, ...]


def _between_columns(matrix: Array, length: Array | float, rig: Rig) -> Table:
    """Table for matrices (n, n, 2, ...) at two strokes: place 0 and 1."""
    whole = step_matrix(matrix, length, rig.scales)
    half = step_matrix(matrix, 0.5 * jnp.asarray(length), rig.scales)
    return Table(*((a[:, :, 0], a[:, :, 1] - a[:, :, 0]) for a in (matrix, whole, half)))


def _between_stiffnesses(matrix: Array, length: Array | float, rig: Rig) -> Table:
    """Table for a matrix (n, n, ...) at work: the place is the stiffness of the oil, 1 at work.

    The rate of pressure goes with it, and nothing else does.
    """
    pressed = jnp.zeros_like(matrix).at[4].set(matrix[4])
    still = matrix - pressed
    nodes = SOFT.reshape(-1, *(1,) * (matrix.ndim - 2))
    each = still[:, :, None] + nodes * pressed[:, :, None]
    inverse = np.linalg.inv(np.vander(SOFT, increasing=True))

    def through(length: Array | float) -> tuple[Array, ...]:
        found = step_matrix(each, length, rig.scales)
        return tuple(jnp.tensordot(inverse, found, axes=(1, 2)))

    return Table((still, pressed), through(length), through(0.5 * jnp.asarray(length)))


class Oil(NamedTuple):
    """Where the oil of a rig stands in its tables.

    - `at`: place of a stroke between two oil columns. - `worked`: oil that a pascal more took in at
      work [m^3/Pa] where the place is a stiffness; None where it is that of the column.
    """

    at: Callable[[Array], Array]
    worked: Array | None

    @classmethod
    def of(cls, rig: Rig, outside: Surroundings, column: Array, at: Callable) -> "Oil":
        """The oil of a rig; where it is soft, matrices are made at this column [m] alone."""
        soft = any(effect.softens for effect in rig.effects)
        worked = rig.yielding(_working(rig, column), outside, column) if soft else None
        return cls(at, worked)

    def table(self, matrix: Array, length: Array | float, rig: Rig) -> Table:
        """Table for matrices (n, n, 2, ...) at two columns."""
        if self.worked is None:
            return _between_columns(matrix, length, rig)
        return _between_stiffnesses(matrix[:, :, 0], length, rig)

    def place(self, rig: Rig, flat: Array, outside: Surroundings, stroke: Array) -> Array:
        """Place of a state in the table."""
        if self.worked is None:
            return self.at(stroke)
        return self.worked / rig.yielding(flat, outside, rig.column + stroke)


def at_place(powers: Sequence[Array], place: Array) -> Array:
    """Polynomial at a place, the lowest power first."""
    return reduce(lambda total, power: power + place * total, reversed(powers))


def times(powers: tuple[Array, ...], place: Array, vector: Array) -> Array:
    """Matrix of a table at a place, times a vector."""
    return at_place([apply(matrix, vector) for matrix in powers], place)

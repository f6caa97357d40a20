"""The log-posterior of a study as a function of one vector, for samplers of one's own."""

from dataclasses import dataclass

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from rigid.io.runtime import require_double
from rigid.likelihood.problem import Problem, evaluate


@dataclass(frozen=True, eq=False)
class LogPosterior:
    """Log-posterior density of z, to be called, differentiated, mapped and compiled.

    - `problem`: of the spec and its records.

    z has an entry for each of `names`, standard normal a priori: the prior law of a parameter maps
    the standard normal to its SI value (`values`); the log-prior is -z.z/2 - len(z)/2 log(2 pi).
    Gains and zeros of the sensors are integrated out. Where the model fails, the density is -inf.
    """

    problem: Problem

    @property
    def names(self) -> tuple[str, ...]:
        """Labels of the entries of z."""
        return self.problem.parameters.labels

    @property
    def size(self) -> int:
        """Length of z."""
        return self.problem.parameters.size

    def __call__(self, z: ArrayLike) -> Array:
        """Return the density of z (size,), a scalar, or of rows of z (n, size), (n,)."""
        return self._by_row(evaluate(self.problem, self._rows(z)).log_posterior, z)

    def log_likelihood(self, z: ArrayLike) -> Array:
        """Return the density less the prior's, as nested samplers ask for it.

        They get z from their unit cube by `jax.scipy.special.ndtri`.
        """
        rows = self._rows(z)
        prior = -0.5 * jnp.sum(rows * rows, axis=1) - 0.5 * self.size * jnp.log(2.0 * jnp.pi)
        return self._by_row(evaluate(self.problem, rows).log_posterior - prior, z)

    def values(self, z: ArrayLike) -> dict[str, Array]:
        """Return SI values by label, known ones included: scalars of z (size,), (n,) of rows."""
        found = self.problem.parameters.values(self._rows(z))
        return {label: self._by_row(value, z) for label, value in found.items()}

    def _rows(self, z: ArrayLike) -> Array:
        require_double()
        rows = jnp.asarray(z, float)
        if rows.ndim not in (1, 2) or rows.shape[-1] != self.size:
            raise ValueError(
                f"z has the shape {rows.shape}; it must be ({self.size},) or (n, {self.size})"
            )
        return rows if rows.ndim == 2 else rows[None]

    def _by_row(self, found: Array, z: ArrayLike) -> Array:
        return found if jnp.ndim(z) == 2 else found[0]

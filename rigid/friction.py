"""mu(omega) of draws: its dissipative and its storage part over frequency."""

from collections.abc import Mapping
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax.typing import ArrayLike

from rigid.effects import AbstractEffect
from rigid.parameters import scoped
from rigid.problem import Problem
from rigid.rig import friction_of

FREQUENCIES = np.union1d(np.logspace(-2, 3, 61), [80.0])
"""Hz: from the slowest record to beyond the rig's second mode; 80 Hz is where a release rings."""


class Friction(NamedTuple):
    """Friction over frequency, each (draws, frequencies).

    - `dissipative` [N s/m]: Re mu. - `storage` [N/m]: -omega Im mu.
    """

    dissipative: np.ndarray
    storage: np.ndarray

    @property
    def magnitude(self) -> np.ndarray:
        """|mu| [N s/m], given the frequencies are FREQUENCIES."""
        return np.hypot(self.dissipative, self.storage / (2 * np.pi * FREQUENCIES))


def friction(
    effects: tuple[type[AbstractEffect], ...],
    values: Mapping[str, ArrayLike],
    scope: tuple[str, ...],
) -> Friction:
    """Friction of draws as records of a `scope` see it.

    - `values`: SI by label, (draws,) each.
    """
    omega = jnp.asarray(2 * np.pi * FREQUENCIES)[:, None]
    seen = {k: jnp.asarray(v) for k, v in scoped(values, scope).items()}
    mu = friction_of(tuple(effect.build(seen) for effect in effects), omega)
    return Friction(np.asarray(mu.real).T, np.asarray(-omega * mu.imag).T)


def scopes(problem: Problem) -> dict[str, tuple[str, ...]]:
    """Views of the rig that differ in friction, by label; one, "", where nothing varies.

    None where no record is of the rig: frequencies at which a rig rings say nothing then.
    """
    if not problem.of_the_rig:
        return {}
    varied = {p.label.rpartition("[")[2][:-1] for p in problem.parameters.sampled if p.varies}
    if not varied:
        return {"": ()}
    return {label: (label,) for label in sorted(varied)}

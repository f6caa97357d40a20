"""mu(omega) of draws: its dissipative and its storage part over frequency."""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from rigid.effects import AbstractEffect
from rigid.io.compiled import compiled
from rigid.likelihood.parameters import Scoped
from rigid.likelihood.problem import Problem
from rigid.physics.rig import friction_of

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


ROWS = 512
"""Draws that are worked out at once: one shape does for any number of them."""


def in_rows(draws: np.ndarray) -> Iterator[np.ndarray]:
    """Cut draws (n, ...) into pieces of ROWS, the last one filled up with its last."""
    for begin in range(0, len(draws), ROWS):
        rows = draws[begin : begin + ROWS]
        yield np.pad(rows, ((0, ROWS - len(rows)), *((0, 0),) * (rows.ndim - 1)), mode="edge")


@compiled
def _seen(
    effects: tuple[type[AbstractEffect], ...], values: dict[str, Array], omega: Array
) -> Array:
    return friction_of(tuple(effect.build(values) for effect in effects), omega)


def friction(
    effects: tuple[type[AbstractEffect], ...],
    values: Mapping[str, ArrayLike],
    scope: tuple[str, ...],
) -> Friction:
    """Friction of draws as records of a `scope` see it.

    - `values`: SI by label, (draws,) each.
    """
    omega = 2 * np.pi * FREQUENCIES[:, None]
    names = [label for effect in effects for label in effect.labels()]
    seen, draws = Scoped(values, scope), max(np.size(v) for v in values.values())
    columns = [np.broadcast_to(np.asarray(seen[name], dtype=float), draws) for name in names]
    table = np.array(columns).reshape(len(names), draws).T
    parts = [
        _seen(effects, dict(zip(names, jnp.asarray(rows).T, strict=True)), jnp.asarray(omega))
        for rows in in_rows(table)
    ]
    whole = [np.broadcast_to(np.asarray(p), (len(omega), ROWS)) for p in parts]
    mu = np.concatenate(whole, axis=1)[:, :draws]
    return Friction(np.real(mu).T, (-omega * np.imag(mu)).T)


def scopes(problem: Problem) -> dict[str, tuple[str, ...]]:
    """Views of the rig that differ in friction, by label; one, "", where nothing varies.

    None where no record is of the rig: frequencies at which a rig rings say nothing then.
    """
    if not problem.of_the_rig:
        return {}
    varied = {p.view for p in problem.parameters.sampled if p.varies}
    if not varied:
        return {"": ()}
    return {label: (label,) for label in sorted(varied)}

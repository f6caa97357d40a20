"""The trace that each candidate effect would leave: how the records change when it comes in.

Simulations are differentiable, so the change of every sample with a small amplitude of an effect
is one forward derivative at the amplitude where it is absent, all candidates of a program at once.
"""

import dataclasses
from collections.abc import Mapping
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.discovery.candidates import Candidate, batches
from rigid.groups import AbstractGroup
from rigid.newton import is_noise, joined, samples
from rigid.rig import acting
from rigid.search import Found


class Expansion(NamedTuple):
    """The log-likelihood of all samples around a fit; n samples, piece after piece.

    - `score`, `bend` (n,): slope and minus curvature by the expected record.
    - `design` (n, size): slope of the expected record by what the fit adjusts, in prior sds.
    - `reads` (n,): 1 + gain of each sample's sensor.
    """

    score: np.ndarray
    bend: np.ndarray
    design: np.ndarray
    reads: np.ndarray


def expansion(found: Found) -> Expansion:
    """Expand the likelihood around the best fit of a search."""
    problem, best = found.problem, found.optima[0]
    w = joined(problem, best.z, best.standard)
    z_noise = best.z[is_noise(problem)]
    pieces = samples(problem, jnp.asarray(w), jnp.asarray(z_noise))
    reads = []
    for piece in problem.pieces:
        at = [problem.sensors.index(piece.sensor(i)) for i in range(len(piece.tracks))]
        gain = 1.0 + best.standard[at, 0] * piece.sheet.spread.gain
        reads.append(np.broadcast_to(gain, piece.data.shape).ravel())
    return Expansion(
        np.concatenate([np.asarray(p.score) for p in pieces]),
        np.concatenate([np.asarray(p.bend) for p in pieces]),
        np.concatenate([np.asarray(p.design) for p in pieces]),
        np.concatenate(reads),
    )


def traces(found: Found, listed: tuple[Candidate, ...]) -> np.ndarray:
    """Change of every sample's expected record per unit amplitude, (samples, candidates)."""
    order = {id(one): i for i, one in enumerate(listed)}
    columns: list[np.ndarray | None] = [None] * len(listed)
    reads = expansion(found).reads
    for lot in batches(listed):
        slopes = _lot(found, lot)
        for one, column in zip(lot, slopes.T, strict=True):
            columns[order[id(one)]] = column * reads
    return np.stack([c for c in columns if c is not None], axis=1)


def _lot(found: Found, lot: tuple[Candidate, ...]) -> np.ndarray:
    """Derivatives of ideal readings by the amplitudes of candidates that share a program."""
    problem = found.problem
    effects = tuple(dict.fromkeys(one.effect for one in lot))
    groups = tuple(with_effects(group, effects) for group in problem.groups)
    z = jnp.broadcast_to(jnp.asarray(found.optima[0].z), (len(lot), problem.parameters.size))
    values = dict(problem.parameters.values(z))
    labels = {label: one.shape[label] for one in lot for label in one.shape}
    tangents = {}
    for label, elsewhere in labels.items():
        values[label] = jnp.asarray([one.shape.get(label, elsewhere) for one in lot])
        tangents[label] = jnp.asarray([1.0 if one.amplitude == label else 0.0 for one in lot])
    slopes = _slopes(groups, values, tangents)
    return np.concatenate(
        [
            np.asarray(piece.reading(slopes)).reshape(-1, len(lot)) for piece in problem.pieces
        ]
    )  # fmt: skip


def with_effects(group: AbstractGroup, effects: tuple) -> AbstractGroup:
    """Return a group of the same tracks in which further effects act, where they do."""
    more = acting(effects, group.tracks[0].kind)
    return dataclasses.replace(group, effects=group.effects + more)


@eqx.filter_jit
def _slopes(
    groups: tuple[AbstractGroup, ...], values: Mapping[str, Array], tangents: Mapping[str, Array]
) -> list[dict[str, Array]]:
    """Derivative of the readings of all groups along tangents of some of the values."""

    def predict(moved: Mapping[str, Array]) -> list[dict[str, Array]]:
        return [group.predict({**values, **moved}) for group in groups]

    return jax.jvp(predict, ({k: values[k] for k in tangents},), (dict(tangents),))[1]

"""How the ends of a machine's joints move in its runs, which says where something hidden may be."""

from collections.abc import Mapping
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.io.compiled import compiled
from rigid.likelihood.machine_group import MachineGroup
from rigid.localfit.hidden_inputs import CYLINDER_SPEED, LOAD, PRESSURE, SPEED, STROKE, Followed
from rigid.localfit.local import LocalFit
from rigid.physics.machine import Reading

Span = tuple[float, float]
"""From where to where a state goes, SI."""


class Path(NamedTuple):
    """What a joint does in all runs.

    - `runs`: names. - `lasts` [s]: the longest. - `spans`: of each state.
    """

    runs: tuple[str, ...]
    lasts: float
    spans: Mapping[Followed, Span]


def paths_at_joints(local: LocalFit) -> dict[str, Path]:
    """Follow every joint of a machine in a fit, by name, whether sensors read it or not."""
    problem, runs, lasts = local.layout.problem, [], 0.0
    seen: dict[str, list[dict[Followed, np.ndarray]]] = {p.name: [] for p in problem.places}
    values = {k: jnp.full(1, v) for k, v in local.hypothesis.every(local.w).items()}
    for group in problem.groups:
        assert isinstance(group, MachineGroup)  # a machine's records are runs
        read = _everywhere(group, values)
        interval = group.drives.interval
        for number, run in enumerate(group.runs):
            runs.append(run)
            count = max(int(t.samples) for t in group.tracks if t.name == run)
            lasts = max(lasts, (count - 1) * interval)
            for joint, name in enumerate(group.joints):
                stroke, pressure, position = (
                    np.asarray(series)[:count, joint, number, 0]
                    for series in (read.stroke, read.pressure, read.position)
                )
                behind = position - stroke
                seen[name].append({
                    STROKE: stroke,
                    PRESSURE: pressure,
                    SPEED: np.gradient(stroke, interval),
                    CYLINDER_SPEED: np.gradient(behind, interval),
                    LOAD: behind,
                })  # fmt: skip
    return {
        name: Path(
            tuple(runs), lasts, {key: _span([one[key] for one in parts]) for key in parts[0]}
        )
        for name, parts in seen.items()
    }


@compiled
def _everywhere(group: MachineGroup, values: dict[str, Array]) -> Reading:
    return group.grid.everywhere(group.inputs(values))


def _span(parts: list[np.ndarray]) -> Span:
    return float(min(p.min() for p in parts)), float(max(p.max() for p in parts))

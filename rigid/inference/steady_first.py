"""Where a search begins: anywhere in the prior, or where the steady part of a rig fits best.

A simulation of a rig that is not steady costs many times that of a steady one. Dry friction, air or
an event are mostly small beside what the steady rig does, so that its optima, found cheaply from
many starts, lie next to those of the whole. A few starts from the prior go all the way, lest an
optimum that only the whole rig has be missed.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rigid.effects import AbstractEffect
from rigid.inference.search import prior_draws, search
from rigid.likelihood.assemble import assemble, chosen_effects
from rigid.likelihood.parameters import Parameters
from rigid.likelihood.per_record import PUMP_ANGLE
from rigid.likelihood.problem import Problem
from rigid.records.record import Record
from rigid.spec import Spec
from rigid.spec.record import RecordSpec

ALL_THE_WAY = 8
"""One start in so many goes all the way from its draw of the prior."""


class Beginning(NamedTuple):
    """Points from which the descents of a search set out.

    - `z` (n, size). - `counts` (n,): how many starts led to each.
    """

    z: np.ndarray
    counts: np.ndarray


def beginnings(
    spec: Spec,
    records: tuple[Record, ...],
    problem: Problem,
    seed: int,
    report: Callable[[int], None] = lambda _: None,
) -> Beginning:
    """Return where the search of a problem begins, as many starts as the spec says.

    - `problem`: of `spec` and `records`. - `report(done)`: after each start of the steady rig.
    """
    starts = spec.sampler.starts
    drawn = prior_draws(problem, starts, seed)
    easier = steady_part(spec)
    if easier is None or starts == 1:
        return Beginning(drawn, np.ones(starts, dtype=int))
    eased = with_ease(starts)
    rig = assemble(easier, records)
    found = search(rig, eased, seed, report)
    led = np.stack([_placed(problem.parameters, rig.parameters, o.z) for o in found.optima])
    reached = np.maximum([o.reached for o in found.optima], 1)
    return Beginning(
        np.concatenate([led, drawn[: starts - eased]]),
        np.concatenate([reached, np.ones(starts - eased, dtype=int)]),
    )


def with_ease(starts: int) -> int:
    """How many of so many starts begin with the steady rig."""
    return starts - -(-starts // ALL_THE_WAY)


def steady_part(spec: Spec) -> Spec | None:
    """Return the spec without the effects that make its rig unsteady.

    None for a machine of its own, whose steps cost the same whatever acts; where there are none,
    where a rig cannot be without one of them, or where no friction would be left.
    """
    if spec.machine is not None:
        return None
    effects = dict(zip(spec.model.effects, chosen_effects(spec), strict=True))
    moving = {name: effect for name, effect in effects.items() if not effect.steady}
    left = tuple(name for name in effects if name not in moving)
    if not moving or not all(effect.may_lack() for effect in moving.values()):
        return None
    if not any(_rubs(effects[name]) for name in left):
        return None
    gone = {i.name for e in moving.values() for i in e.parameters()} | {PUMP_ANGLE}
    gone |= {label for e in moving.values() for label in e.labels()}
    places = {place for r in spec.records for place in _places(r)}
    gone_priors = gone | {f"{name}[{place}]" for name in gone for place in places}
    model = spec.model.model_copy(
        update={
            "effects": left,
            "only": {k: v for k, v in spec.model.only.items() if k in left},
            "vary": {k: v for k, v in spec.model.vary.items() if k not in gone},
        }
    )
    priors = {k: v for k, v in spec.priors.items() if k not in gone_priors}
    return spec.model_copy(update={"model": model, "priors": priors})


def _places(record: RecordSpec) -> tuple[str, ...]:
    """What stands in the brackets of a number that is not the same in all records."""
    name, cylinder = record.name, record.cylinder
    return record.kind, name, cylinder, f"{name},{cylinder}"


def _rubs(effect: type[AbstractEffect]) -> bool:
    """Whether an effect is a friction."""
    return effect.friction is not AbstractEffect.friction


def _placed(whole: Parameters, part: Parameters, z: np.ndarray) -> np.ndarray:
    """Place z of a part of the parameters among all; what the part lacks is at its centre."""
    at = {p.label: value for p, value in zip(part.sampled, z, strict=True)}
    return np.array([at.get(p.label, 0.0) for p in whole.sampled])

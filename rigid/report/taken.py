"""What a result took for exactly known, what it set aside, what solved it: entries, sentences."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rigid.effects import AbstractEffect
from rigid.kinds import KINDS
from rigid.likelihood.problem import Problem
from rigid.likelihood.set_aside import Aside
from rigid.plots.metrology import significant
from rigid.spec import Spec

MOST_TIMES = 3
"""Instants of one channel that a sentence tells."""


def taken(
    spec: Spec,
    problem: Problem,
    aside: Sequence[Aside],
    added: Iterable[type[AbstractEffect]] = (),
) -> dict[str, Any]:
    """Entries `held_exact`, `set_aside` and `why_solver` of a result.

    - `aside`: samples that were set aside. - `added`: effects that came to those of the problem.
    """
    effects = (*problem.effects, *added)
    exact = [
        _exact(p.label, f"{p.label} = {significant(value, p.unit, 4)}", value, p.unit)
        for p in problem.parameters.known
        for value in (float(p.prior.from_standard(0.0)),)
    ]
    lasting = any(effect.gradual() for effect in effects)
    kinds = {
        track.of.name: track.of.exact
        for track in problem.tracks
        if track.of.solver != "release" or not lasting
    }
    exact += _told({one.name: one.exact for one in effects} | kinds)
    put_aside = [one.values() for one in aside]
    return {"held_exact": exact, "set_aside": put_aside, "why_solver": spec.why_solver or None}


def taken_over(
    effects: Iterable[type[AbstractEffect]], kinds: Iterable[str], aside: Iterable[Aside]
) -> dict[str, Any]:
    """Entries `held_exact` and `set_aside` of a result that rests on a calibration.

    - `effects`: those of the calibration. - `kinds`: of the records.
    """
    own = "what the calibration held exact"
    exact = _told(
        {one.name: one.exact for one in effects}
        | {name: KINDS[name].exact for name in kinds}
        | {"calibration": own}
    )
    return {"held_exact": exact, "set_aside": [one.values() for one in aside]}


def _told(exact: Mapping[str, str]) -> list[dict[str, Any]]:
    """Entries of what is held exact in words, by what holds it."""
    return [_exact(name, says) for name, says in exact.items() if says]


def _exact(
    name: str, says: str, value: float | None = None, unit: str | None = None
) -> dict[str, Any]:
    return {"name": name, "value": value, "unit": unit, "says": says}


def sentences(made: Mapping[str, Any]) -> tuple[str, ...]:
    """What was held exact and set aside, and what solved it, for a page; `made` has the entries."""
    exact = "; ".join(dict.fromkeys(one["says"] for one in made["held_exact"]))
    solved = (f"Solver: {made['why_solver']}.",) if made.get("why_solver") else ()
    return (f"Held exact: {exact}.", *map(_aside, made["set_aside"]), *solved)


def lines(made: Mapping[str, Any]) -> list[str]:
    """The same for the terminal, in short."""
    says = "; ".join(dict.fromkeys(one["says"] for one in made["held_exact"]))
    aside = (
        f"set aside: {one['samples']} of {one['channel']} of {one['record']},{one['cylinder']}"
        for one in made["set_aside"]
    )
    return [f"held exact: {says}", *aside]


def _aside(one: Mapping[str, Any]) -> str:
    times, count = one["time_s"], one["samples"]
    told = ", ".join(f"{t:.4f}" for t in times[:MOST_TIMES])
    more = f" and {count - MOST_TIMES} more" if count > MOST_TIMES else ""
    return (
        f"Set aside: {count} {'sample' if count == 1 else 'samples'} of {one['channel']} in "
        f"{one['record']},{one['cylinder']} ({told} s{more}), far off both neighbours or beyond "
        "the sensor's range."
    )

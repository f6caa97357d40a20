"""Every law fitted to the records, in two programs: viscous friction, and dry friction."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rigid.choosing.laws import BRISTLES, DRY, MEMORY, VISCOUS, Law
from rigid.choosing.starts import constant_starts, dry_starts, prior_starts
from rigid.choosing.together import Place, descended, led, simulated
from rigid.discovery.families import Family, families
from rigid.discovery.hypothesis import Hypothesis
from rigid.discovery.local import Local, expand, with_weights
from rigid.discovery.samples import Layout, lay_out
from rigid.discovery.weights import facts
from rigid.newton import is_noise
from rigid.priors import AbstractLaw
from rigid.problem import Problem

STARTS = 4
"""Starts of the model with memory: the centre of its priors, and draws from them."""
FIRST_TURNS = 10
"""Turns of the program after which only the best start goes on."""
BEGINNINGS = {BRISTLES: 2}
"""Starts of a law of dry friction; one of the others."""
FIRST_DRY_TURNS, MOST_DRY_TURNS, LAST_DRY_TURNS = 2, 4, 2
"""Turns after which only the best start of each law of dry friction goes on, how many more at most,
and how many once all samples have their weights."""
WIDTH = 16
"""Simulations side by side in the program of dry friction: one turn serves a step of all its laws;
three turns of 5 take twice as long."""
FAR = 0.3
"""Prior sds by which a law may move the rest of the model before all slopes are made anew."""

OUT_OF_QUESTION = 40.0
"""Nats below the best law at which no more work goes into one."""

Report = Callable[[str], None]


class Programs(NamedTuple):
    """The compiled programs."""

    viscous: Family
    dry: Family

    def of(self, law: Law) -> Family:
        """The one that holds a law."""
        return self.viscous if law.dry is None else self.dry


@dataclasses.dataclass(frozen=True)
class Fitted:
    """All laws at their best, the same weights of samples in all.

    - `programs`; `laws`. - `fits`: by name of the law.
    """

    programs: Programs
    laws: tuple[Law, ...]
    fits: Mapping[str, Local]


def fit_laws(
    problem: Problem,
    laws: tuple[Law, ...],
    given: Mapping[str, AbstractLaw],
    seed: int,
    report: Report,
) -> Fitted:
    """Fit every law.

    - `problem`: with viscous friction and memory. - `given`: priors that go before the effects'
      own, by label. - `seed`: of the starts.

    How many facts a sample is gets judged once every law has had its say: what the best of them
    leaves over, and what none of them could take away, is noise.
    """
    viscous = families(problem, (), together=True)[0]
    dry = dataclasses.replace(families(problem, DRY, together=True)[0], width=WIDTH)
    programs = Programs(viscous, dry)
    layout = lay_out(problem)
    layout = layout.weighed((layout.weight > 0.0).astype(float))
    report("fitting constant friction and friction with memory")
    fits = _viscous(viscous, Hypothesis(problem, given=given), layout, laws[0], seed)
    listed = [law for law in laws if law.dry is not None]
    base = fits[MEMORY if listed[0].memory else VISCOUS]
    report("fitting dry friction")
    starts = dry_starts(base, dry, listed, BEGINNINGS)
    fits |= _dry(dry, [(name, p) for name, places in starts.places.items() for p in places])
    best_one = max(fits.values(), key=lambda one: one.log_evidence)
    weight = facts(best_one, starts.changes)
    report("fitting all laws again, correlated residuals at their worth")
    again = led(viscous, [with_weights(fits[n], weight) for n in (VISCOUS, MEMORY)], False)
    out = dict(zip((VISCOUS, MEMORY), again, strict=True))
    names = [law.name for law in listed]
    last = led(dry, [with_weights(fits[name], weight) for name in names], True, LAST_DRY_TURNS)
    out |= _renewed(dry, dict(zip(names, last, strict=True)), base)
    return Fitted(programs, laws, out)


def _viscous(
    family: Family, hypothesis: Hypothesis, layout: Layout, constant: Law, seed: int
) -> dict[str, Local]:
    """Fits with memory, and without."""
    none = np.zeros(hypothesis.size), np.zeros(int(is_noise(hypothesis.problem).sum()))
    like = expand(hypothesis, (family, layout), *none)
    memory = _best(family, prior_starts(like, STARTS, seed))
    return {VISCOUS: _best(family, constant_starts(memory, constant)), MEMORY: memory}


def _best(family: Family, places: Sequence[Place]) -> Local:
    """The best of several starts after a few turns, led to its end.

    Those at which nothing can be simulated are left out.
    """
    begun = [one for one in simulated(family, places) if np.isfinite(one.value)]
    ends = descended(family, begun, False, FIRST_TURNS)
    return led(family, [max(ends, key=lambda one: one.value)], False)[0]


def _dry(family: Family, begun: Sequence[tuple[str, Place]]) -> dict[str, Local]:
    """The best end of each law."""
    here = simulated(family, [place for _, place in begun])
    ends = descended(family, here, True, FIRST_DRY_TURNS)
    found: dict[str, Local] = {}
    for (name, _), end in zip(begun, ends, strict=True):
        if name not in found or end.value > found[name].value:
            found[name] = end
    return dict(zip(found, led(family, list(found.values()), True, MOST_DRY_TURNS), strict=True))


def _renewed(family: Family, fits: dict[str, Local], base: Local) -> dict[str, Local]:
    """Slopes made anew, and the fits led on, where dry friction moved the rest of the model.

    Laws that are out of the question stay as they are.
    """
    count = len(base.hypothesis.parameters)
    best = max(base.value, *(one.value for one in fits.values()))
    far = [
        name
        for name, one in fits.items()
        if np.abs(one.w[:count] - base.w[:count]).max() > FAR and one.value > best - OUT_OF_QUESTION
    ]
    if not far:
        return fits
    anew = simulated(family, [Place(fits[name], fits[name].w, False) for name in far])
    return fits | dict(zip(far, led(family, anew, True, MOST_DRY_TURNS), strict=True))

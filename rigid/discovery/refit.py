"""The few best candidates fitted in full: every parameter free, the effect with its own priors."""

import dataclasses
from collections.abc import Iterator, Mapping
from functools import cached_property
from types import MappingProxyType
from typing import NamedTuple
from zlib import crc32

import numpy as np

from rigid.discovery.fitted import Fitted
from rigid.discovery.weighing.discrepancy import borne
from rigid.discovery.weighing.explain import Explained
from rigid.inference.settled import stands
from rigid.io.cache import NOTHING_KEPT, Shelf
from rigid.localfit.ascent import given_up, refined
from rigid.localfit.candidates import Candidate, standard_of
from rigid.localfit.evidence import amplitudes, most_probable
from rigid.localfit.expansion import Point, expanded
from rigid.localfit.families import Family
from rigid.localfit.hypothesis import Hypothesis, widened
from rigid.localfit.local import LocalFit
from rigid.localfit.noise.follows import pooled
from rigid.localfit.samples import Layout, Terms
from rigid.localfit.settled import another_law, below, labels_of, nearer_priors, state_of, unsettled

MOST = 4
"""Effects that are fitted in full, at most."""
WITHIN, MUCH, SHARE = 8.0, 100.0, 0.75
"""Effects whose log Bayes factor lies further below the best are not: odds of 1 in 3,000. Around a
fit that lacks as much as the second, what signatures promise is a part of what fits bring, another
part for each: of what is more than that the best may be ahead by the share."""
ANEW = 4
"""Times that a fit which stopped short of its top is led on, at most: turns that bring little, one
after the other, end it each time."""
KEPT = "discovery-refit-*"
"""What refits are called on the shelf, `*` standing for effects added before, the candidate, where
it began, and whether it could be given up: one that was may be tried again, to its end."""
BEFORE_STEPS, FIRST_STEPS = 9, 6
"""Turns that the model without the effect gets in the program of the effect, and that each effect
gets before it is said which of them to follow first."""


@dataclasses.dataclass(frozen=True)
class Refit:
    """An effect added and everything fitted again.

    - `candidate`: where it began. - `before`, `after`: fits without and with it, in one program.
    - `log_bayes`: of the effect against its absence, by Laplace's method, with what pooling its
      likelihood with one whose noise follows the fit changes, `pooled`.
    - `ahead`: name of the effect that explains so much more that this fit was given up before its
      optimum, and `log_bayes` is less than it could be; mostly empty.
    - `earlier`: evidence for the effects that were added before, in nats.
    """

    candidate: Candidate
    before: LocalFit
    after: LocalFit
    log_bayes: float
    ahead: str = ""
    earlier: float = 0.0
    pooled: float = 0.0

    @property
    def unsettled(self) -> str:
        """Why the fit with the effect cannot be believed, in a sentence; empty where it can."""
        return unsettled(self.after, self.before, borne(self.log_bayes + self.earlier))

    @cached_property
    def another(self) -> str:
        """Which numbers of the effect make another law of it, in words; mostly empty."""
        effect = self.candidate.effect
        numbers = another_law(self.after, effect) if self.after.finite else ()
        return ", ".join(stands(*one) for one in numbers)


class Begun(NamedTuple):
    """The first turns of a fit with an effect.

    - `number`: of its best candidate. - `before`: the fit without it. - `after`: how far the other
      has come. - `at`: name of the effect whose fit it began at, empty where at none.
    """

    number: int
    before: LocalFit
    after: LocalFit
    at: str = ""

    @property
    def height(self) -> float:
        """Log-posterior so far."""
        return _height(self.after)


class Lead(NamedTuple):
    """The best fit with an effect so far: its name, and its log-posterior."""

    name: str
    height: float


NO_LEAD = Lead("", -np.inf)


def lead_of(name: str, one: Refit) -> Lead:
    """The lead that a fit with the effect `name` has.

    What pooling takes from its evidence is no ground to give others up for; what it adds it may
    add to others as well. What its numbers make another law of is none of the effect.
    """
    if one.another:
        return NO_LEAD
    return Lead(name, _height(one.after) + min(one.pooled, 0.0))


def contained(refits: Mapping[str, Refit], name: str) -> list[str]:
    """Names of the laws that the law `name` contains, and that explain less in their fits.

    A law contains another if it has all its numbers: Stribeck's friction that of Coulomb.
    """
    all_, most = _numbers(refits[name]), refits[name].log_bayes
    inside = (n for n, one in refits.items() if n != name and _numbers(one) <= all_)
    return [n for n in inside if refits[n].log_bayes < most]


def _numbers(one: Refit) -> set[str]:
    return {info.name for info in one.candidate.effect.parameters()}


def worth_refitting(evidence: Mapping[str, float], alone: Mapping[str, float]) -> list[str]:
    """Names of the effects that are worth a fit in full, the best first.

    - `evidence`: what speaks for each, alone or with another; `alone`: alone; log Bayes factors.

    In turn the next by the one and the next by the other: whatever goes well with the best has much
    beside it, and would leave no room for what explains half as much by itself. One that is worth
    something only beside another comes last: a fit of it alone tells little.
    """
    best = max(evidence.values(), default=0.0)
    least = max(best - max(WITHIN, SHARE * (best - MUCH)), 0.0)
    near = sorted((n for n in evidence if evidence[n] > least), key=lambda n: -evidence[n])
    worth = [name for name in near if alone[name] > 0.0]
    by_itself = sorted(worth, key=lambda name: -alone[name])
    both = (name for two in zip(worth, by_itself, strict=True) for name in two)
    return list(dict.fromkeys((*both, *near)))


class InitialGuess(NamedTuple):
    """Where a fit with an effect may begin in place of the fit without it.

    - `w` (size,): of the fit without it. - `own`: SI values of the effect's numbers, by label, that
      go before those of its candidate. - `at`: name of the effect whose fit this is.
    """

    w: np.ndarray
    own: Mapping[str, float] = MappingProxyType({})
    at: str = ""


def guess_of(one: Refit, base: LocalFit) -> InitialGuess:
    """Where a fit begins that shares numbers with another: at that one.

    - `one`: with a twin of the effect, or with the effect itself beside others. - `base`: the fit
      to which it is to be added.

    Numbers that both have by one name, such as the force of dry friction, stay what they are.
    """
    hypothesis, w = one.after.hypothesis, one.after.w
    known = dict(zip(labels_of(hypothesis), w, strict=True))
    values = {label: value for label, (value, _) in hypothesis.values(w).items()}
    shared = np.array([known[label] for label in labels_of(base.hypothesis)])
    return InitialGuess(shared, values, one.candidate.effect.name)


def begin(fit: Fitted, found: Explained, name: str, guess: InitialGuess | None = None) -> Begun:
    """Take the first turns of a fit with the effect `name`, from its best candidate on.

    - `fit`: without it. - `guess`: where to begin in place of where that stands.
    """
    base, number = fit.local, found.best_of(name)
    candidate = found.listed[number]
    family = fit.program((*base.hypothesis.added, candidate.effect))
    before = base
    if any(not e.steady for e in family.effects):
        before = refined(expanded(family, Point.beside(base, base.w)), BEFORE_STEPS)
    start = _start(before, found, number, family, guess)
    after = refined(start, FIRST_STEPS) if start.finite else start
    return Begun(number, before, after, guess.at if guess else "")


def refit(
    fit: Fitted, found: Explained, begun: Begun, lead: Lead, shelf: Shelf = NOTHING_KEPT
) -> Refit:
    """Fit the model with an effect added.

    - `fit`: without it. Where it has left the priors, for want of the effect perhaps, the refit
      begins nearer to them, too; where it ends below the fit without the effect, at its absence.
    - `lead`: another effect, which this one may be too far behind to follow. - `shelf`: keeps it.
    """
    base, candidate = fit.local, found.listed[begun.number]
    family, hypothesis = begun.after.family, begun.after.hypothesis
    known = {"base": base, "hypothesis": base.hypothesis, "extended": hypothesis, "family": family}
    known |= {one: getattr(base.layout, one) for one in ("problem", "channels", "channel", "time")}
    began = [f"at-{begun.at.replace(' ', '-')}"] if begun.at else []
    whole = [] if lead.name else ["whole"]
    name = [*_came_in(base.hypothesis), str(begun.number), *began, *whole]
    before, after = shelf.once(
        KEPT.replace("*", "-".join(name)),
        lambda: (begun.before, _followed(found, begun, lead.height)),
        (LocalFit, Layout, Terms),
        known,
    )
    places = len({one.only for one in found.listed if one.effect is candidate.effect})
    log_bayes = after.log_evidence - before.log_evidence - float(np.log(places))
    change = pooled(before, after) if after.finite else 0.0
    ahead = lead.name if given_up(after, lead.height) else ""
    return Refit(candidate, before, after, log_bayes + change, ahead, pooled=change)


def _came_in(hypothesis: Hypothesis) -> Iterator[str]:
    """What was added and absorbed, as parts of a file's name."""
    yield from (effect.name.replace(" ", "-") for effect in hypothesis.added)
    yield from (f"absorbed-{crc32(one.columns.tobytes()):08x}" for one in hypothesis.absorbed)


def _followed(found: Explained, begun: Begun, rival: float) -> LocalFit:
    """The best fit with an effect, from all places that are worth beginning at.

    - `rival`: log-posterior which it is given up below.
    """
    number, before, after = begun.number, begun.before, begun.after
    starts = [after]
    starts += [
        _start(before, found, number, after.family, InitialGuess(w)) for w in nearer_priors(before)
    ]
    for start in starts:
        if start.finite:
            after = max(after, refined(start, rival=max(rival, _height(after))), key=_height)
    if not after.finite or below(after, before):
        absent = _start(before, found, number, after.family, absent=True)
        if absent.finite:
            after = max(after, refined(absent), key=_height)
    for _ in range(ANEW):
        if not after.finite or given_up(after, rival) or state_of(after).flat:
            break
        after = max(after, refined(after, rival=rival), key=_height)
    return after


def _start(
    before: LocalFit,
    found: Explained,
    number: int,
    family: Family,
    guess: InitialGuess | None = None,
    absent: bool = False,
) -> LocalFit:
    """The likelihood with an effect where a fit with it begins.

    - `before`: the fit without. - `number`: of the candidate. - `guess`: in place of that fit's.
    - `absent`: with its amplitude as near to absence as its prior goes.
    """
    one, guess = found.listed[number], InitialGuess(before.w) if guess is None else guess
    extended = before.hypothesis.plus(one.effect, one.only, one.priors)
    own = _beginning(found, number, extended, absent, guess.own)
    w = widened(before.hypothesis, guess.w, own)
    return expanded(family, Point(extended, before.layout, w, before.z_noise))


def _height(local: LocalFit) -> float:
    """Log-posterior of a fit, least where it is no number."""
    return local.value if local.finite else -np.inf


def _beginning(
    found: Explained,
    number: int,
    extended: Hypothesis,
    absent: bool,
    own: Mapping[str, float],
) -> list[float]:
    """Standard normal quantiles of an added effect's parameters at its best candidate.

    - `absent`: with its amplitude as near to absence as its prior goes. - `own`: values that go
      before the candidate's.
    """
    one = found.listed[number]
    slope = float(found.screening.slope[number])
    information = float(found.screening.information[number, number])
    quantile = most_probable(slope, information, amplitudes(one.prior, one.absent))
    amplitude = one.absent if absent else one.departure(quantile)
    values = dict(one.shape) | {one.amplitude: amplitude} | dict(own)
    out = []
    for parameter in extended.brought_by(one.effect):
        if parameter.label not in values:  # a record's own, of which the candidate says nothing
            out.append(0.0)
            continue
        value = values[parameter.label]
        # A second amplitude that the candidate leaves absent begins small, not at minus infinity.
        out.append(float(np.clip(standard_of(parameter.prior, value), -3.0, 3.0)))
    return out

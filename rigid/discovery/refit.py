"""The few best candidates fitted in full: every parameter free, the effect with its own priors."""

import dataclasses
from collections.abc import Mapping

import numpy as np

from rigid.discovery.fitted import Fitted
from rigid.discovery.weighing.explain import Explained
from rigid.io.cache import NOTHING_KEPT, Shelf
from rigid.localfit.ascent import refined
from rigid.localfit.candidates import Candidate, standard_of
from rigid.localfit.evidence import amplitudes, most_probable
from rigid.localfit.expansion import Point, expanded
from rigid.localfit.families import Family
from rigid.localfit.hypothesis import Hypothesis, widened
from rigid.localfit.local import LocalFit
from rigid.localfit.samples import Layout, Terms
from rigid.localfit.settled import below, nearer_priors, unsettled

MOST = 3
"""Effects that are fitted in full, at most."""
WITHIN = 8.0
"""Effects whose log Bayes factor lies further below the best are not: odds of 1 in 3,000."""
KEPT = "discovery-refit-*"
"""What refits are called on the shelf, `*` standing for effects added before and the candidate."""
BEFORE_STEPS = 3
"""Steps that the model without the effect gets in the program of the effect."""


@dataclasses.dataclass(frozen=True)
class Refit:
    """An effect added and everything fitted again.

    - `candidate`: where it began. - `before`, `after`: fits without and with it, in one program.
    - `log_bayes`: of the effect against its absence, by Laplace's method.
    """

    candidate: Candidate
    before: LocalFit
    after: LocalFit
    log_bayes: float

    @property
    def unsettled(self) -> str:
        """Why the fit with the effect cannot be believed, in a sentence; empty where it can."""
        return unsettled(self.after, self.before)


def worth_refitting(evidence: Mapping[str, float], alone: Mapping[str, float]) -> list[str]:
    """Names of the effects to fit in full, the best first.

    - `evidence`: what speaks for each, alone or with another; `alone`: alone; log Bayes factors.

    One that is worth something only beside another comes last: a fit of it alone tells little, and
    must not take the place of a rival of the best.
    """
    least = max(max(evidence.values(), default=0.0) - WITHIN, 0.0)
    near = [name for name in evidence if evidence[name] > least]
    return sorted(near, key=lambda name: (alone[name] <= 0.0, -evidence[name]))[:MOST]


def refit(fit: Fitted, found: Explained, name: str, shelf: Shelf = NOTHING_KEPT) -> Refit:
    """Fit the model with the effect `name` added, from its best candidate on.

    - `fit`: without it. Where it has left the priors, for want of the effect perhaps, the refit
      begins nearer to them, too; where it ends below the fit without the effect, at its absence.
    - `shelf`: keeps the refit.
    """
    base, number = fit.local, found.best_of(name)
    candidate, added = found.listed[number], base.hypothesis.added
    family = fit.program((*added, candidate.effect))
    extended = base.hypothesis.plus(candidate.effect, candidate.only, candidate.priors)
    known = {"base": base, "hypothesis": base.hypothesis, "extended": extended, "family": family}
    known |= {one: getattr(base.layout, one) for one in ("problem", "channels", "channel", "time")}
    before, after = shelf.once(
        KEPT.replace("*", f"{len(added)}-{number}"),
        lambda: _fits(fit, found, number, (extended, family)),
        (LocalFit, Layout, Terms),
        known,
    )
    places = len({one.only for one in found.listed if one.effect is candidate.effect})
    log_bayes = after.log_evidence - before.log_evidence - float(np.log(places))
    return Refit(candidate, before, after, log_bayes)


def _fits(
    fit: Fitted, found: Explained, number: int, model: tuple[Hypothesis, Family]
) -> tuple[LocalFit, LocalFit]:
    """Fits without and with the candidate of a number, in one program.

    - `model`: with its effect, and the program.
    """
    base, (extended, family) = fit.local, model
    before = base
    if any(not e.steady for e in family.effects):
        before = refined(expanded(family, Point.beside(base, base.w)), BEFORE_STEPS)
    more = _beginning(found, number, extended)

    def led(w: np.ndarray, own: list[float]) -> LocalFit:
        w = widened(w, len(base.layout.problem.sensors), own)
        start = expanded(family, Point(extended, base.layout, w, before.z_noise))
        return refined(start) if start.finite else start

    ends = [led(w, more) for w in (before.w, *nearer_priors(before))]
    after = max(ends, key=_height)
    if not after.finite or below(after, before):
        absent = led(before.w, _beginning(found, number, extended, absent=True))
        after = max(after, absent, key=_height)
    return before, after


def _height(local: LocalFit) -> float:
    """Log-posterior of a fit, least where it is no number."""
    return local.value if local.finite else -np.inf


def _beginning(
    found: Explained, number: int, extended: Hypothesis, absent: bool = False
) -> list[float]:
    """Standard normal quantiles of an added effect's parameters at its best candidate.

    - `absent`: with its amplitude as near to absence as its prior goes.
    """
    one = found.listed[number]
    slope = float(found.screening.slope[number])
    information = float(found.screening.information[number, number])
    quantile = most_probable(slope, information, amplitudes(one.prior, one.absent))
    amplitude = one.absent if absent else one.departure(quantile)
    values = dict(one.shape) | {one.amplitude: amplitude}
    out = []
    for parameter in extended.brought_by(one.effect):
        if parameter.label not in values:  # a record's own, of which the candidate says nothing
            out.append(0.0)
            continue
        value = values[parameter.label]
        # A second amplitude that the candidate leaves absent begins small, not at minus infinity.
        out.append(float(np.clip(standard_of(parameter.prior, value), -3.0, 3.0)))
    return out

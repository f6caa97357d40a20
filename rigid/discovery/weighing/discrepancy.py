"""How far the law of an effect may be from what acts in a rig, and what that does to the odds.

No law of a catalogue is exact. What the law of the right effect leaves, its discrepancy, is in
proportion to what it explains: where much was explained, the little that is left may be the form of
the law and no second effect, and of two effects that explain nearly as much, the right one may be
behind. Evidence that takes each law for exact knows neither.
"""

import dataclasses

import numpy as np

from rigid.discovery.weighing.explain import NOTHING, PRIOR_NOTHING, PRIOR_UNNAMED, UNNAMED
from rigid.discovery.weighing.odds import MIMICS, Odds

TYPICAL, FACTOR = 0.03, 3.0
"""Share of the evidence that the law of the right effect leaves, and to what factor it is known.
Chosen on the second simulator, whose causes have other forms than the catalogue's laws: with the
right name in, 7 to 19 % of some thousand nats were left in three campaigns, nothing in three
(docs/studies/development-notes.md)."""
ANOTHER = 10.0
"""The evidence for another cause, beside that for the first: as much, to this factor."""
GREATEST = 0.5
"""A law that leaves more than this share is that of another effect."""


PAID = 10.0
"""Nats that something unnamed pays for its freedom: ten directions, as bumps over the time of a
record have, at a strength of 8 in all, 5 ln(1 + 64/10)."""

LIKE_IT = MIMICS * PRIOR_UNNAMED / (1.0 - PRIOR_NOTHING - PRIOR_UNNAMED)
"""What one would bet on something unnamed that looks like an effect, for each bet on the effect."""

NEVER = 1e9
"""Nats behind of an effect that explains nothing at all, in place of infinity."""


def of_the_law(share: float | np.ndarray) -> np.ndarray:
    """Density, over its logarithm, of the share of the evidence that the right law leaves."""
    # What is less than usual is not held against a law.
    return _density(share, TYPICAL, FACTOR)


def of_another(share: float | np.ndarray) -> np.ndarray:
    """Density, over its logarithm, of the evidence for another cause as a share of the first's."""
    return _density(share, 1.0, ANOTHER)


def borne(evidence: float) -> float:
    """Nats that the discrepancy of laws may take: the share they leave, one sd above the usual.

    - `evidence`: for them, in nats.
    """
    return TYPICAL * FACTOR * max(evidence, 0.0)


def _density(share: float | np.ndarray, middle: float, factor: float) -> np.ndarray:
    sd = np.log(factor)
    z = np.log(np.maximum(share, TYPICAL) / middle) / sd
    return np.asarray(np.exp(-0.5 * z**2) / (sd * np.sqrt(2.0 * np.pi)))


def _log(value: float | np.ndarray) -> np.ndarray:
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(value))


def beside(said: Odds, before: float) -> Odds:
    """Reckon that what is left may be the discrepancy of what was added.

    - `before`: evidence of what was added, in nats. One would bet as much on either.

    A discrepancy may have any form, so that unmodelled causes see it as well as an effect does, but
    for what they pay for their freedom: what they see little of is rather the effect. What looks
    like an effect and is a discrepancy has no name: its part goes to something unnamed.
    """
    if before <= 0.0:
        return said
    log, form = dict(said.log), -np.inf
    for name, evidence in said.evidence.items():
        share = max(evidence, 0.0) / before
        shows = evidence - PAID
        seen = min(max(said.unnamed, 0.0) / shows, 1.0) if shows > 0.0 else 1.0
        law, another = seen * float(of_the_law(share)), float(of_another(share))
        form = np.logaddexp(form, log[name] + float(_log(law / (law + another))))
        log[name] += float(np.log(another / (law + another)))
    log[UNNAMED] = float(np.logaddexp(log[UNNAMED], form))
    return dataclasses.replace(said, log=log, form=float(np.exp(form)))


def moderated(said: Odds, left: float) -> Odds:
    """Reckon with what was left, in nats, once the likeliest effect and all that follows were in.

    - Of two effects the one that is behind may be the right one, and its discrepancy look more like
      the other. If so it leaves the share q of the evidence that it does not explain, with the
      density of such shares; of that the other takes up `D`, by which it is ahead, and not `left`,
      by chance: with a discrepancy in any direction of three, in 1 - sqrt(D/(D + left)) of cases.
    - What leaves more than a law would is rather something unnamed that looks like the effect.
    """
    names = [name for name in said.log if name not in (NOTHING, UNNAMED)]
    logs = np.array([said.log[name] for name in names])
    if left <= 0.0 or not np.isfinite(logs).any():
        return said
    top = names[int(np.argmax(logs))]
    everything = max(said.evidence[top], 0.0) + left
    behind = np.minimum(np.max(logs) - logs, NEVER)
    share, here = (behind + left) / everything, left / everything
    by_chance = 1.0 - np.sqrt(behind / (behind + left))
    by_chance *= of_the_law(share) / of_the_law(here)
    exact = np.exp(-behind)
    weight = exact + np.where(share <= GREATEST, (1.0 - exact) * by_chance, 0.0)
    either = 0.5 * (of_the_law(here) + of_another(here))
    mimic = max(float(of_another(here) / either), 1.0)
    # Nothing keeps its probability; the names and something unnamed share the rest anew.
    named, other = sum(said.probability[name] for name in names), said.probability[UNNAMED]
    shrink = (named + other) / (named + other * mimic)
    anew = _log(weight / weight.sum() * named * shrink)
    log = {**said.log, **dict(zip(names, anew.tolist(), strict=True))}
    log[UNNAMED] += float(np.log(mimic * shrink))
    return dataclasses.replace(said, log=log, form=said.form * mimic * shrink)


def in_another_form(said: Odds, name: str, log_bayes: float) -> Odds:
    """Reckon with how much better the records are explained by an effect in another form.

    - `name`: of the effect. - `log_bayes`: of another form against its law
      (`rigid.discovery.form`).

    In another form it is something unnamed that looks like the effect. What speaks for the law
    makes the name no surer: how often it misleads has not been measured.
    """
    if log_bayes <= 0.0 or not np.isfinite(said.log[name]):
        return said
    more = said.log[name] + np.log(LIKE_IT) + np.log(np.expm1(log_bayes))
    log = {**said.log, UNNAMED: float(np.logaddexp(said.log[UNNAMED], more))}
    total = float(np.logaddexp.reduce(list(log.values())))
    log = {one: value - total for one, value in log.items()}
    return dataclasses.replace(said, log=log, form=float(said.form / np.exp(total)))

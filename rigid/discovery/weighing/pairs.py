"""Two effects at once: what a pair explains that neither does alone.

Where two are missing, each alone leaves the signature of the other, and something hidden that
mimics both can explain more than either.
"""

import dataclasses
from collections.abc import Mapping

import numpy as np
from jaxtyping import Float
from scipy.special import logsumexp

from rigid.discovery.weighing.explain import Explained, curves_of_all
from rigid.localfit.evidence import LOG_MASS, amplitudes

POINTS = 241
"""Strengths at which the gain of the second effect is worked out."""
LEAST_REACH = 30.0
UNSURE = 5.0
"""Nats by which a fit in full may change what signatures promised and they are still believed where
they compare: which of two twins is ahead, how much more a pair explains. Chosen so that effects of
little strength cost no fits of their twins, not studied."""


@dataclasses.dataclass(frozen=True)
class Pairs:
    """Log Bayes factors of all pairs of effects against nothing.

    - `names`. - `log_bayes`: symmetric; minus infinity where there is no pair.
    """

    names: tuple[str, ...]
    log_bayes: Float[np.ndarray, "m m"]

    def corrected(self, alone: Mapping[str, float], by: Mapping[str, float]) -> "Pairs":
        """Return them with what fits in full changed in the log Bayes factors of single effects.

        - `alone`: log Bayes factors of the effects to second order. - `by`: those changes.

        A pair takes over the whole change of the effect for which more speaks, and of the other's
        the share of its evidence that is left once the first is there: where one explains all that
        the other would, nothing.
        """
        single = np.array([alone[name] for name in self.names])
        change = np.array([by.get(name, 0.0) for name in self.names])
        less = (single + change)[:, None] < single + change
        left = np.where(less, self.log_bayes - single, self.log_bayes - single[:, None])
        other = np.where(less, single[:, None], single)
        share = np.clip(left / np.maximum(other, 1e-12), 0.0, 1.0)
        whole = np.where(less, change, change[:, None])
        part = np.where(less, change[:, None], change)
        return Pairs(self.names, self.log_bayes + whole + share * part)


def doubted(promised: Pairs, after: Pairs, single: Mapping[str, float]) -> Pairs:
    """Take from pairs as much of their lead over the better of their two as is not to be believed.

    - `after`: what was `promised`, with what fits in full changed. - `single`: log Bayes factors of
      the effects alone, with those changes.

    A pair is never fitted. Where a fit of one of its effects changed much, what signatures say of
    the two together is off by as much.
    """
    alone = np.array([single[name] for name in after.names])
    better = np.maximum(alone[:, None], alone)
    some = np.isfinite(after.log_bayes)
    pair, before = (np.where(some, one.log_bayes, better) for one in (after, promised))
    lead = pair - better
    doubt = np.maximum(np.abs(pair - before) - UNSURE, 0.0)
    kept = better + np.where(lead > 0.0, np.maximum(lead - doubt, 0.0), lead)
    return Pairs(after.names, np.where(some, kept, -np.inf))


def pairs(found: Explained) -> Pairs:
    """Weigh every pair of effects, averaged over the shapes and places of both.

    With slopes g and information I of both amplitudes the likelihood ratio is
    exp(g_1 a_1 + g_2 a_2 - I_11 a_1^2/2 - I_12 a_1 a_2 - I_22 a_2^2/2): for each amplitude of the
    first, the second meets the slope g_2 - I_12 a_1. Two effects that are both confined to a place
    are not paired.
    """
    names = tuple(found.effects)
    of = np.array([names.index(one.effect.name) for one in found.listed])
    apart = np.array([one.only is not None for one in found.listed], dtype=bool)
    count = len(found.listed)
    size = found.screening.size[:count]
    reach = max(LEAST_REACH, 2.0 * float(np.abs(found.screening.strength[:count]).max(initial=0.0)))
    curves = curves_of_all(found.listed, size, np.linspace(-reach, reach, POINTS))
    logs: dict[tuple[int, int], list[np.ndarray]] = {}
    for i in np.flatnonzero(~apart):
        others = np.flatnonzero((of > of[i]) | (apart & (of != of[i])))
        both = _with(found, int(i), others, curves[others], (size[others], reach))
        for other in np.unique(of[others]):
            key = min(of[i], other), max(of[i], other)
            logs.setdefault(key, []).append(both[of[others] == other])
    out = np.full((len(names),) * 2, -np.inf)
    for (a, b), rows in logs.items():
        every = np.concatenate(rows)
        out[a, b] = out[b, a] = logsumexp(every) - np.log(len(every))
    return Pairs(names, out)


def _with(
    found: Explained,
    first: int,
    others: np.ndarray,
    curves: np.ndarray,
    scale: tuple[np.ndarray, float],
) -> np.ndarray:
    """Log Bayes factor of a candidate together with each of some others (m,)."""
    slope, information = found.screening.slope, found.screening.information
    size, reach = scale
    a = amplitudes(found.listed[first].prior, found.listed[first].absent)
    alone = slope[first] * a - 0.5 * information[first, first] * a**2 + LOG_MASS
    alone = alone + found.listed[first].log_share
    # Places of what is left of the second slope on its curve; in place, for there are many.
    half = 0.5 * (POINTS - 1)
    per = half / (size * reach)
    gain = np.outer(a, -information[first, others] * per)
    gain += slope[others] * per + half
    np.clip(gain, 0.0, POINTS - 1.000001, out=gain)
    below = gain.astype(np.int32)
    gain -= below
    below += np.arange(len(others), dtype=np.int32) * POINTS
    gain *= np.diff(curves, axis=1, append=0.0).take(below)
    gain += curves.take(below)
    gain += alone[:, None]
    most = gain.max(axis=0)
    gain -= most
    return most + np.log(np.exp(gain, out=gain).sum(axis=0))

"""How probable each explanation is: nothing, an effect alone or with another, something unnamed."""

import dataclasses
import math
from collections.abc import Mapping
from functools import cached_property

import numpy as np

from rigid.discovery.weighing.explain import NOTHING, UNNAMED, Explained, prior_of
from rigid.discovery.weighing.pairs import Pairs, doubted

PRIOR_PAIRS = 0.05
"""What one would bet on two effects at once, before any record, shared evenly by all pairs; it is
taken from the single ones."""

MIMICS = 0.3
"""Of causes that have no entry, the share that leaves a signature too like that of an effect to be
told from it, as it is among all causes of the benchmark (docs/studies/discovery/lookalikes.json: a
third has another with a cosine above 0.8), and chosen in view of how often names stated at 0.9 and
more were right in development (docs/discovery.md). What is hidden is looked for in forms that can
be written down; a cause that is like an effect and not quite it differs from it in a direction that
nobody knows, and no record excludes that."""

AS_SURE = math.log(3.0)
"""Two effects are as sure to be missing where their odds are within this."""


@dataclasses.dataclass(frozen=True)
class Odds:
    """What the records say of each explanation.

    - `log`: logarithm of the probability of nothing, of each effect as the next to add, of
      something unnamed; the probabilities sum to 1. A pair counts for that of its two effects which
      is the surer to be missing, whichever of the effects with its signature it is; of two as sure,
      for the one that explains more alone.
    - `evidence`: log of what speaks for each effect, alone or with another, against nothing, as a
      Bayes factor is.
    - `unnamed`: the same for something unnamed.
    - `form`: the part of something unnamed that what was added would leave, its law being off.
    """

    log: Mapping[str, float]
    evidence: Mapping[str, float]
    unnamed: float
    form: float = 0.0

    @cached_property
    def probability(self) -> dict[str, float]:
        """Of nothing, of each effect as the next to add, of something unnamed."""
        return {name: float(np.exp(log)) for name, log in self.log.items()}

    @property
    def nothing(self) -> float:
        """Probability that nothing is missing."""
        return self.probability[NOTHING]


def odds(
    found: Explained, changes: Mapping[str, float] | None = None, both: Pairs | None = None
) -> Odds:
    """Put priors and Bayes factors together.

    - `changes`: of the log Bayes factors of effects, once they have been fitted in full, and of
      something unnamed.
    """
    changes = changes or {}
    hidden = found.unnamed + changes.get(UNNAMED, 0.0)
    singles = {name: log + changes.get(name, 0.0) for name, log in found.effects.items()}
    names = list(singles)
    nothing, each, unnamed = prior_of(len(names))
    logs = {name: singles[name] + np.log(each) for name in names}
    shared = dict.fromkeys(names, -np.inf)
    inclusion = dict(logs)
    if both is not None and len(names) > 1:
        prior = np.log(PRIOR_PAIRS / _count(len(names)))
        table = doubted(both, both.corrected(found.effects, changes), singles).log_bayes + prior
        kept = 1.0 - PRIOR_PAIRS / (each * len(names))
        logs = {name: log + np.log(kept) for name, log in logs.items()}
        rows = dict(zip(both.names, table, strict=True))
        inclusion = {n: float(np.logaddexp(logs[n], np.logaddexp.reduce(rows[n]))) for n in names}
        sure = [np.logaddexp.reduce([inclusion[m] for m in found.alike(n)]) for n in both.names]
        shared = _shared(both.names, table, np.array(sure), np.array([logs[n] for n in both.names]))
    parts = {NOTHING: np.log(nothing), UNNAMED: hidden + np.log(unnamed)}
    parts |= {name: float(np.logaddexp(logs[name], shared[name])) for name in names}
    if names:
        like = np.logaddexp.reduce([parts[name] for name in names]) - np.log(each * len(names))
        unlike = parts[UNNAMED] + np.log(1.0 - MIMICS)
        parts[UNNAMED] = float(np.logaddexp(unlike, like + np.log(unnamed * MIMICS)))
    total = np.logaddexp.reduce(list(parts.values()))
    return Odds(
        {name: float(part - total) for name, part in parts.items()},
        {name: inclusion[name] - float(np.log(each)) for name in names},
        hidden,
    )


def _count(effects: int) -> int:
    return effects * (effects - 1) // 2


def _shared(
    names: tuple[str, ...], table: np.ndarray, sure: np.ndarray, alone: np.ndarray
) -> dict[str, float]:
    """Log of the pairs that count for each effect; `sure`, `alone` (m,): see `Odds`."""
    # Two that explain nothing at all, -inf each, are tied.
    surer, tied = _above(sure), np.isclose(sure[:, None], sure, rtol=0.0, atol=AS_SURE)
    mine = np.where(np.where(tied, _above(alone), surer), table, -np.inf)
    return dict(zip(names, np.logaddexp.reduce(mine, axis=1).tolist(), strict=True))


def _above(values: np.ndarray) -> np.ndarray:
    """Whether one of values (m,) stands above another (m, m); of equal ones, the first does."""
    place = np.argsort(np.argsort(-values, kind="stable"), kind="stable")
    return place[:, None] < place

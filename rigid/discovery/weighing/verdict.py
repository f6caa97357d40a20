"""What the probabilities of all explanations amount to, in a word."""

import numpy as np

from rigid.discovery.weighing.explain import NOTHING, UNNAMED, Explained
from rigid.discovery.weighing.odds import Odds
from rigid.inference.summary import FALSE_ALARMS

LIKELIER = 0.5
"""Something is missing where the probability of nothing is below this, and where as much is found
in fewer than FALSE_ALARMS of campaigns in which nothing is, ..."""
RARE = 1e-3
"""... and where that share times the odds for nothing is below this: the less odds say, the rarer
by chance it has to be."""
SURE_NAME = 0.8
"""A name is given where it has this probability among all that could be missing, and ..."""
CLOSE = 4.0
"""... no other explanation whose log Bayes factor is within this of it ..."""
PARTED = 1.64
"""... leaves a signature so alike that even who knew both could not part them in 19 of 20."""


def is_missing(nothing: float, p_value: float) -> bool:
    """Say whether something is missing.

    - `nothing`: probability that nothing is. - `p_value`: share of campaigns in which nothing is
      missing that have as much evidence.
    """
    likelier = nothing < LIKELIER and p_value < FALSE_ALARMS
    return likelier and p_value * nothing / (1.0 - nothing) < RARE


def lookalikes(found: Explained, said: Odds, name: str) -> list[str]:
    """Effects that explain about as much as the effect `name` and leave too similar a signature.

    At strength s an ideal observer parts two signatures of cosine c with probability
    Phi(s sqrt((1 - c)/2)).
    """
    mine, strength = found.best_of(name), abs(found.screening.strength)
    out = []
    for other, log in said.evidence.items():
        at = found.best_of(other)
        cosine = min(abs(found.screening.cosines[mine, at]), 1.0)
        apart = strength[mine] * np.sqrt(0.5 * (1.0 - cosine))
        if other != name and log > said.evidence[name] - CLOSE and apart < PARTED:
            out.append(other)
    return out


def verdict_of(found: Explained, said: Odds) -> str:
    """Say what probabilities of the explanations amount to, something being missing."""
    some = {k: v for k, v in said.probability.items() if k != NOTHING}
    total = sum(some.values())
    named = {k: v for k, v in some.items() if k != UNNAMED}
    top = max(named, key=lambda k: named[k], default=UNNAMED)
    if not named or some[UNNAMED] > sum(named.values()):
        return "unnamed"
    sure = named[top] > SURE_NAME * total and not lookalikes(found, said, top)
    return "named" if sure else "indistinguishable"

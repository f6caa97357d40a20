"""The likelihood of a fit under noise whose law follows it, beside the one that fits are led by.

Fits are led by residuals that count for as many facts as the first fit's noise allowed, with the
same law ever after. Where something is missing, an effect that is wrong may take much of a slow
misfit and leave residuals that are as correlated as before: for samples as independent as that it
explains a lot, and one step ahead nothing. The likelihood here, of Whittle, takes the noise of each
fit for what its own residuals show, averaged over laws at a price for every number.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from rigid.likelihood.common_noise import common_law
from rigid.likelihood.correlation import LEAST_SAMPLES
from rigid.likelihood.periodogram import Found, periodogram
from rigid.localfit.local import LocalFit

POOLED = 0.5
"""Share of the likelihood whose noise follows the fit in the logarithm of the two together (a
logarithmic opinion pool: Genest and Zidek 1986, Statistical Science 1, 114-135). Neither is right:
the one holds the noise of a fit that lacks something, the other is not what fits are led by."""
MOST = 2.0
"""Of what something explains by the first it counts for so many times as much by the second at
most: laws of noise differ by some ten nats between fits that explain the same."""


def log_likelihood(local: LocalFit, residual: Float[np.ndarray, " n"] | None = None) -> float:
    """Log-likelihood of a fit's residuals under noise whose law follows them.

    - `residual` (n,): in place of the fit's own.
    """
    layout, total = local.layout, 0.0
    series = local.residual if residual is None else residual
    series = series / (layout.floor * np.sqrt(layout.loud))
    for number in range(len(layout.channels)):
        mine = layout.channel == number
        good = layout.weight[mine] > 0.0
        read = int(good.sum())
        if read < LEAST_SAMPLES:
            continue
        found = Found.of(periodogram(series[mine], good))
        if found.empty:
            continue
        shape = common_law([found], float(np.log(read)), found.level).log_evidence
        total += shape - float(found.weight.sum() * np.log(found.level))
    return total


def pooled(before: LocalFit, after: LocalFit) -> float:
    """What the second likelihood changes in the log Bayes factor of one fit against another."""
    gain = float(after.terms.value.sum() - before.terms.value.sum())
    return _change(gain, log_likelihood(after) - log_likelihood(before))


def pooled_by(local: LocalFit, changes: Sequence[Float[np.ndarray, " n"]]) -> list[float]:
    """The same for each of some things that add a change (n,) to the expected readings."""
    here = log_likelihood(local)
    return [
        _change(float(local.gain_of(one).sum()), log_likelihood(local, local.residual - one) - here)
        for one in changes
    ]


def _change(gain: float, followed: float) -> float:
    return POOLED * (min(followed, MOST * max(gain, 0.0)) - gain)

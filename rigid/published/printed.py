"""The probability that a number is printed as it is, given what the rig would show."""

import numpy as np
from jaxtyping import Float
from scipy.special import log_ndtr

from rigid.spec import Printed

BLUNDER = 1e-3
"""Probability that a number stands as it does for a reason that is not the rig: a slip of reading
or of printing (one in fifty) times the chance that it then falls on this value (one in twenty).
docs/errata.md finds about a dozen such slips in the paper."""


def log_probability(
    printed: Printed,
    shown: Float[np.ndarray, " n"],
    widened: float = 1.0,
    slip: float = BLUNDER,
) -> Float[np.ndarray, " n"]:
    """Log probability of the print, (n,).

    - `shown`: what the rig would show, SI; not finite where it shows nothing.
    - `widened`: factor on the half-width. - `slip`: in place of `BLUNDER`.
    """
    finite = np.isfinite(shown)
    off = (printed.value - np.where(finite, shown, 0.0)) / printed.sd
    half = widened * printed.half_width / printed.sd
    off = np.abs(off)
    upper, lower = log_ndtr(half - off), log_ndtr(-half - off)
    within = upper + np.log1p(-np.exp(np.minimum(lower - upper, -1e-300)))
    return np.logaddexp(np.log1p(-slip) + np.where(finite, within, -np.inf), np.log(slip))

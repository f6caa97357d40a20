"""What forbids the use of a result, residuals and optima: one rule for fit, laws and discover."""

from collections.abc import Mapping

import numpy as np
from scipy.stats import norm

from rigid.inference.sampling import LEAST_SHARE, MOST_OVERLOOKED, covers
from rigid.inference.search import Found
from rigid.inference.search_cache import Searched
from rigid.inference.settled import CHANCE, Settled
from rigid.inference.summary import Check
from rigid.localfit.leave_one_out import gap
from rigid.localfit.local import LocalFit

MOST_GAP = 1.5
"""Residuals that are half as large again as the sheets say, over all records, are no fit."""

MOST_CHANNEL_GAP = 2.5
"""The same for one sensor of one record, which has fewer samples and one sheet."""


def residuals(overall: float, channels: Mapping[str, float]) -> Check:
    """Whether a model explains the records: residuals one step ahead over what the sheets say.

    - `overall`: root mean square over all records. - `channels`: of each, "stroke of frame-3,A".
    """
    worst = max(channels, key=channels.__getitem__)
    ok = bool(overall <= MOST_GAP and channels[worst] <= MOST_CHANNEL_GAP)
    said = (
        f"they are {overall:.2f} times what the sensors' sheets say (limit {MOST_GAP}), at worst "
        f"{channels[worst]:.2f} times in {worst} (limit {MOST_CHANNEL_GAP})"
    )
    return Check("residuals", ok, said)


def optimum(found: Settled) -> Check:
    """Whether the place where a search or a refit ended can be believed to be its optimum."""
    return Check("optimum", found.ok, found.says)


def covered(known: Searched, weighed: bool) -> Check:
    """Whether what made the draws reaches all of the posterior, which R-hat cannot see.

    - `weighed`: draws count by the posterior itself. Else walkers made them, which begin in the law
      around the best fits and take most of their steps from it.
    """
    if weighed:
        return Check("covered", True, "every draw counts by its weight in the posterior")
    share, left_out = known.weights.kish, known.overlooked
    ok = covers(known)
    said = (
        f"{share:.1%} of the draws of the law that walkers begin in count (at least "
        f"{LEAST_SHARE:.0%} must), and of what lies around conditional modes it leaves out "
        f"{left_out:.0%} (at most {MOST_OVERLOOKED:.0%})"
    )
    if not ok:
        said += ": what walkers miss R-hat does not show, and intervals may be too narrow"
    return Check("covered", ok, said)


def noise(found: Found) -> Check:
    """Whether no sensor is louder at the best fit than its prior lets one right sheet in 1,000 be.

    The residuals that `residuals` takes are those of one step ahead: what a model misses slowly is
    hidden there, and noise grows to hold it.
    """
    listed = [
        (float(z), p)
        for p, z in zip(found.problem.parameters.sampled, found.optima[0].z, strict=True)
        if p.base == "noise"
    ]
    if not listed:
        return Check("noise", True, "the noise of every sensor is exact")
    sds, worst = max(listed, key=lambda pair: pair[0])
    limit = float(norm.isf(CHANCE / len(listed)))
    times = float(worst.prior.from_standard(sds) / worst.prior.from_standard(0.0))
    sensor = ",".join(worst.places)
    if sds <= limit:
        said = f"that of {sensor} is {times:.2g} times its sheet's, {sds:.1f} prior sds, at most"
        return Check("noise", True, f"{said} (limit {limit:.1f})")
    return Check(
        "noise",
        False,
        f"that of {sensor} is {times:.2g} times what its sheet says, {sds:.1f} prior sds "
        f"(limit {limit:.1f}): the sheet is wrong, or the model misses what is taken for noise",
    )


def residuals_of(local: LocalFit) -> Check:
    """The same check of a model refitted around a fit."""
    layout = local.layout
    channels = {
        f"{channel.quantity} of {channel.track}": gap(
            local, layout.read & (layout.channel == number)
        )
        for number, channel in enumerate(layout.channels)
        if np.any(layout.read & (layout.channel == number))
    }
    return residuals(gap(local), channels)

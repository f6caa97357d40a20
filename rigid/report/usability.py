"""What forbids the use of a result, residuals and optima: one rule for fit, laws and discover."""

from collections.abc import Mapping

import numpy as np

from rigid.inference.settled import Settled
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

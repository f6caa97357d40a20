"""What the figures of discovery show, as values."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

MOST_PANELS = 3
"""Channels of which residuals are drawn."""


@dataclass(frozen=True, eq=False)
class ResidualShown:
    """One channel: residuals over what its sheet allows, before and after.

    - `name`; `place` (n,): time [s]; `before`, `after` (n,): smoothed over `smoothed` samples.
    - `explained` (n,): what the effect takes away, smoothed alike; None where it cannot be drawn.
    - `stretch`: where the effect shows, or None.
    - `frequencies`: whether the places are frequencies [Hz], and the residuals their lines' sizes.
    """

    name: str
    place: Float[np.ndarray, " n"]
    before: Float[np.ndarray, " n"]
    after: Float[np.ndarray, " n"]
    smoothed: int
    explained: Float[np.ndarray, " n"] | None = None
    stretch: tuple[float, float] | None = None
    frequencies: bool = False


@dataclass(frozen=True, eq=False)
class AgainstShown:
    """What was left over against what an effect explains, in classes of samples (m,).

    - `explained`: by the effect, once all else was refitted. - `before`, `after`: left over without
      and with it, mean of the class. - `sd`: that noise alone gives such a mean. All of it in
      what a sample of the sensor scatters by its sheet.
    """

    explained: Float[np.ndarray, " m"]
    before: Float[np.ndarray, " m"]
    after: Float[np.ndarray, " m"]
    sd: Float[np.ndarray, " m"]


@dataclass(frozen=True, eq=False)
class ComparedShown:
    """P-values of disagreements between records and predictions.

    - `names`: of the channels. - `over`: what residuals were looked at over.
    - `before`, `after` (channels, over): NaN where there is nothing to look at; `after` is None
      where nothing was added.
    """

    names: tuple[str, ...]
    over: tuple[str, ...]
    before: Float[np.ndarray, "channels over"]
    after: Float[np.ndarray, "channels over"] | None

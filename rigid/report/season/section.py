"""The section over a season: what it is on the page, and its content."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from rigid.report.content import Content
from rigid.report.season import figures
from rigid.report.section import Kind

KIND = Kind("batch", 5, "All campaigns", "season.html.j2", figures)


@dataclass(frozen=True)
class CampaignRow:
    """One campaign: its report, verdict and the chosen quantities (q05, median, q95, unit)."""

    name: str
    link: str | None
    status: str
    why: tuple[str, ...]
    gap: float | None
    values: tuple[tuple[float, float, float, str] | None, ...]
    cpu_s: float | None


@dataclass(frozen=True)
class QuantityRow:
    """One quantity over all usable campaigns; `change`: a campaign, in words."""

    label: str
    unit: str
    mean: float | None
    error: float | None
    verdict: str
    change: str
    trend_p: float | None
    scatter_p: float | None


@dataclass(frozen=True, eq=False)
class QuantityShown:
    """One quantity of the figure.

    - `label`; `unit`. - `when` (campaigns,): number of the campaign. - `interval` (campaigns, 3):
      q05, median, q95. - `usable` (campaigns,). - `verdict`: steady, or how it changes.
    """

    label: str
    unit: str
    when: Float[np.ndarray, " campaigns"]
    interval: Float[np.ndarray, "campaigns 3"]
    usable: Bool[np.ndarray, " campaigns"]
    verdict: str


@dataclass(frozen=True, eq=False, kw_only=True)
class SeasonContent(Content):
    """The section, complete.

    - `columns`: labels of the quantities that the table of campaigns shows.
    - `alpha`: chance of a false alarm among all tests.
    """

    columns: tuple[str, ...]
    campaigns: tuple[CampaignRow, ...]
    quantities: tuple[QuantityRow, ...]
    shown: tuple[QuantityShown, ...]
    alpha: float

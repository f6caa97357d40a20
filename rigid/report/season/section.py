"""The section over a season: what it is on the page, and its content."""

from dataclasses import dataclass

from rigid.report.content import FoundContent
from rigid.report.season import figures
from rigid.report.section import Kind

KIND = Kind("batch", 5, "All campaigns", "season.html.j2", figures)


@dataclass(frozen=True, eq=False, kw_only=True)
class SeasonContent(FoundContent):
    """The section, complete: what stands in batch.json.

    - `ranked`: labels of its quantities, what matters first.
    - `alpha`: chance of a false alarm among all tests.
    """

    ranked: tuple[str, ...]
    alpha: float

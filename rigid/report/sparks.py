"""Prior beside posterior as two bars in a table cell."""

import math

from markupsafe import Markup

from rigid.report.content import ParameterShown

_WIDTH, _HEIGHT = 120, 16
# A prior that spans more than this ratio is seen on a logarithmic scale.
_LOGARITHMIC_FROM = 10.0


def interval_bars(row: ParameterShown) -> Markup:
    """Pale bar: 90 % of the prior; dark bar: 90 % of the posterior; tick: its median."""
    numbers = (row.prior_q05, row.prior_q95, row.q05, row.q95, row.median)
    if not all(math.isfinite(number) for number in numbers):
        return Markup("")
    if min(numbers) > 0 and max(numbers) / min(numbers) > _LOGARITHMIC_FROM:
        numbers = tuple(math.log(number) for number in numbers)
    lowest, highest = min(numbers), max(numbers)
    if highest <= lowest:
        return Markup("")
    scale = (_WIDTH - 4) / (highest - lowest)
    prior_low, prior_high, low, high, median = (2 + (n - lowest) * scale for n in numbers)
    return Markup(
        f'<svg class="bars" width="{_WIDTH}" height="{_HEIGHT}" aria-hidden="true">'
        f"{_bar('prior', prior_low, prior_high, 10)}{_bar('posterior', low, high, 6)}"
        f'<rect class="median" x="{median - 0.75:.1f}" y="1" width="1.5" height="14"/></svg>'
    )


def _bar(kind: str, low: float, high: float, height: int) -> str:
    width, top = max(high - low, 1.0), (_HEIGHT - height) / 2
    return f'<rect class="{kind}" x="{low:.1f}" y="{top:g}" width="{width:.1f}" height="{height}"/>'

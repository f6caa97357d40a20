"""The templates of the page: HTML-escaped, strict about names, with the page's number formats."""

from functools import cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from rigid.plots import metrology
from rigid.report.sparks import interval_bars
from rigid.report.symbols import symbol_html
from rigid.report.wording import main_form, reading

FOLDER = Path(__file__).parent


@cache
def environment() -> Environment:
    """The one environment; every value put into a template is escaped."""
    made = Environment(
        loader=FileSystemLoader(FOLDER / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters |= {
        "exact": metrology.exact,
        "significant": metrology.significant,
        "unit": metrology.unit_text,
        "count": metrology.count,
        "ratio": metrology.ratio,
        "chance": metrology.chance,
        "duration": metrology.duration,
        "symbol": symbol_html,
        "bars": interval_bars,
        "main_form": main_form,
        "reading": reading,
    }
    made.globals |= {
        "estimate": metrology.estimate,
        "interval": metrology.interval,
        "median": metrology.median,
        "median_and_interval": metrology.median_and_interval,
    }
    return made

"""The templates of the page: HTML-escaped, strict about names, with the page's number formats."""

import re
from functools import cache, partial
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

from rigid.plots import metrology
from rigid.report.sparks import interval_bars
from rigid.report.symbols import symbol_html

FOLDER = Path(__file__).parent
_TAG = re.compile(r"<[^>]*>")
_HEAD = re.compile(r'<th scope="col"[^>]*>(.*?)</th>', re.DOTALL)
_ROW = re.compile(r"<tr.*?</tr>", re.DOTALL)
_CELL = re.compile(r"<(th|td)([^>]*)>(.*?)</\1>", re.DOTALL)
_CODE = re.compile(r"`([^`]+)`")


def labelled(table: Markup) -> Markup:
    """A table whose cells bear the heading of their column, for pages too narrow for columns.

    - `table`: rows of as many cells as there are headings; the `<th>` of a row needs none.
    """
    heads = [_TAG.sub("", head).strip() for head in _HEAD.findall(table)]
    return Markup(_ROW.sub(partial(_labelled_row, heads), str(table)))


def _labelled_row(heads: list[str], row: re.Match[str]) -> str:
    columns = iter(heads)

    def cell(found: re.Match[str]) -> str:
        label, (tag, look, text) = next(columns), found.groups()
        if tag == "th" or not text:
            return found[0]
        return f'<td{look} data-label="{label}"><span>{text}</span></td>'

    return _CELL.sub(cell, row[0])


def prose(text: str) -> Markup:
    """A sentence with what stands between backticks as code; all else is text."""
    return Markup(_CODE.sub(r"<code>\1</code>", str(escape(text))))


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
        "labelled": labelled,
        "prose": prose,
    }
    made.globals |= {
        "estimate": metrology.estimate,
        "interval": metrology.interval,
        "median": metrology.median,
        "median_and_interval": metrology.median_and_interval,
    }
    return made

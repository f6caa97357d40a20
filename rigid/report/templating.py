"""The templates of the page: HTML-escaped, strict about names, with the page's number formats."""

import re
from collections.abc import Iterable
from functools import cache, partial
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

from rigid.plots import metrology
from rigid.report.sparks import interval_bars
from rigid.report.symbols import symbol_html

FOLDER = Path(__file__).parent
_ROW = re.compile(r"<tr.*?</tr>", re.DOTALL)
_CELL = re.compile(r"<(th|td)>(.*?)</\1>", re.DOTALL)
_CODE = re.compile(r"`([^`]+)`")


def columns(rows: Markup, heads: list[str], labelled: bool) -> Markup:
    """Rows of a table, each cell as its column asks.

    - `rows`: of as many cells as `heads`, which begin with ">" where the column is to the right.
    - `labelled`: whether a cell bears its heading, for pages too narrow for columns.
    """
    return Markup(_ROW.sub(partial(_row, heads, labelled), str(rows)))


def _row(heads: list[str], labelled: bool, row: re.Match[str]) -> str:
    columns = iter(heads)

    def cell(found: re.Match[str]) -> str:
        head, (tag, text) = next(columns), found.groups()
        if tag == "th":
            return f'<th scope="row">{text}</th>'
        look = ' class="n"' if head.startswith(">") else ""
        if not labelled or not text:
            return f"<td{look}>{text}</td>"
        label = escape(head.removeprefix(">"))
        return f'<td{look} data-label="{label}"><span>{text}</span></td>'

    return _CELL.sub(cell, row[0])


def right(heads: Iterable[str]) -> list[str]:
    """Headings of columns that are to the right."""
    return [f">{head}" for head in heads]


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
        "columns": columns,
        "right": right,
        "prose": prose,
    }
    made.globals |= {
        "estimate": metrology.estimate,
        "interval": metrology.interval,
        "median": metrology.median,
        "median_and_interval": metrology.median_and_interval,
    }
    return made

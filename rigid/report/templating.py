"""The templates of the page: HTML-escaped, strict about names; how numbers and symbols look."""

import math
import re
import unicodedata
from collections.abc import Iterable
from functools import cache, partial
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

from rigid.plots import metrology
from rigid.report.content import ParameterShown

FOLDER = Path(__file__).parent
_ROW = re.compile(r"<tr.*?</tr>", re.DOTALL)
_CELL = re.compile(r"<(th|td)>(.*?)</\1>", re.DOTALL)
_CODE = re.compile(r"`([^`]+)`")

_SIGNS = {"cdot": "\N{MIDDLE DOT}", "times": "\N{MULTIPLICATION SIGN}", "infty": "\N{INFINITY}"}
_TEX = re.compile(r"\\([A-Za-z]+)|\\[,;: !]|([_^])|([{}])|([A-Za-z])|(.)", re.DOTALL)
_UPRIGHT = ("mathrm", "rm", "text", "mathit", "operatorname")
_TAGS = {"_": "sub", "^": "sup"}

_WIDTH, _HEIGHT = 120, 16
# A prior that spans more than this ratio is seen on a logarithmic scale.
_LOGARITHMIC_FROM = 10.0


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


def symbol_html(tex: str) -> Markup:
    r"""A symbol as HTML: k_{LC} -> <i>k</i><sub>LC</sub>; what is not known stays as text."""
    html, _ = _group(list(_TEX.finditer(tex)), 0, upright=False, single=False)
    return Markup(html)


def _greek(command: str) -> str:
    """The letter a command names, or its own name where it names none."""
    case = "SMALL" if command.islower() else "CAPITAL"
    name = command.removeprefix("var").lower().replace("lambda", "lamda")
    try:
        return unicodedata.lookup(f"GREEK {case} LETTER {name.upper()}")
    except KeyError:
        return command


def _group(tokens: list, at: int, upright: bool, single: bool) -> tuple[str, int]:
    """HTML of the tokens from `at` to the end of their group, or of a single token."""
    out: list[str] = []
    while at < len(tokens):
        command, script, brace, letter, other = tokens[at].groups()
        at += 1
        if brace == "}":
            break
        if brace == "{":
            inner, at = _group(tokens, at, upright, single=False)
            out.append(inner)
        elif script:
            inner, at = _group(tokens, at, upright=True, single=True)
            out.append(f"<{_TAGS[script]}>{inner}</{_TAGS[script]}>")
        elif command in _UPRIGHT:
            inner, at = _group(tokens, at, upright=True, single=True)
            out.append(inner)
        elif command:
            out.append(str(escape(_SIGNS.get(command) or _greek(command))))
        elif letter:
            out.append(letter if upright else f"<i>{letter}</i>")
        else:
            out.append(str(escape(other or " ")))
        if single:
            break
    return "".join(out), at


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
        "digits": metrology.digits,
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
        "rounded": metrology.rounded,
        "interval": metrology.interval,
        "median": metrology.median,
        "median_and_interval": metrology.median_and_interval,
    }
    return made

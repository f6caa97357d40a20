"""A figure as SVG that can stand in a page: same bytes every time, ids that clash with none."""

import io
import re

from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from rigid.plots.style import house_style

_REFERENCE = re.compile(r'(?:url\(#|href="#)([^)"]+)')
_COORDINATE = re.compile(r"-?\d+\.\d{3,}")
_BREAK = re.compile(r" *\n?([MLCQzZ]) *")
_GEOMETRY = re.compile(r'(?<= )(?:d|x|y|points|transform)="[^"]*"')


def svg(figure: Figure, key: str) -> str:
    """The figure as an `<svg>` element.

    - figure: as made by this package
    - key: unique within the page (letters, digits, hyphens); starts every id of the figure

    The element needs no style sheet and no other file; it bears no date.
    """
    buffer = io.StringIO()
    with house_style(**{"svg.hashsalt": key}):
        FigureCanvasSVG(figure).print_svg(buffer, metadata={"Date": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :].rstrip()
    text = re.sub(r"\s*<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    # A style element would reach the whole page; the root's attributes are inherited instead.
    text = re.sub(r"\s*<style.*?</style>", "", text, flags=re.DOTALL)
    text = text.replace("<svg ", '<svg stroke-linejoin="round" stroke-linecap="butt" ', 1)
    text = text.replace("xlink:href=", "href=").replace(
        ' xmlns:xlink="http://www.w3.org/1999/xlink"', ""
    )
    return _own_ids(_GEOMETRY.sub(_shorter, text), key)


def _shorter(found: re.Match[str]) -> str:
    """Coordinates to a hundredth of a point, which nobody sees beyond, and no blank too many."""
    if "scale(" in found[0] or "matrix(" in found[0]:
        return found[0]
    text = _COORDINATE.sub(lambda number: f"{float(number[0]):.2f}", found[0])
    return _BREAK.sub(r"\1", text)


def _own_ids(text: str, key: str) -> str:
    used = set(_REFERENCE.findall(text))

    def renamed(found: re.Match[str]) -> str:
        return f' id="{key}-{found[1]}"' if found[1] in used else ""

    text = re.sub(r' id="([^"]*)"', renamed, text)
    text = re.sub(r"url\(#([^)]+)\)", rf"url(#{key}-\1)", text)
    return re.sub(r'href="#([^"]+)"', rf'href="#{key}-\1"', text)

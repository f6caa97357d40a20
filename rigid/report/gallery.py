"""The figures of a section: found by their folder, put into the page and into files beside it.

A figure is one file in `rigid/report/SECTION/figures/`. It has a function `drawn(content)`, which
yields a `Drawn` for each figure (none where there is nothing to draw), and `PLACE`, the id of the
heading of the template under which it stands. A place that the template does not have is "more",
at the end of the section.
"""

import importlib
import math
import pkgutil
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from itertools import zip_longest
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.figure import Figure
from matplotlib.image import imsave

from rigid.io.files import csv_text, replacing, write_text
from rigid.plots.figure import Columns, Drawn, Illustration
from rigid.plots.style import house_style
from rigid.plots.vector import svg

DOTS_PER_INCH = 200
"""Of a PNG: sharp on a slide and, at the width of a column, in print."""


class Gallery:
    """The figures of a section by place; each is shown once.

    - `placed`: (place, figure) in the order of the page.
    """

    def __init__(self, placed: Sequence[tuple[str, Illustration]]):
        self._left = list(placed)

    def at(self, place: str) -> list[Illustration]:
        """Take the figures of a place."""
        return self._take(lambda where, _: where == place)

    def numbered(self, place: str, number: int) -> list[Illustration]:
        """Take the figures of a place whose names end in `-NUMBER`: one step of several."""
        return self._take(lambda where, key: where == place and key.endswith(f"-{number}"))

    def named(self, asked: str) -> list[Illustration]:
        """Take one figure by its id; none where there is no such figure."""
        return self._take(lambda _, key: key == asked)

    def rest(self) -> list[Illustration]:
        """Take what no place was found for."""
        return self._take(lambda *_: True)

    def _take(self, wanted: Callable[[str, str], bool]) -> list[Illustration]:
        """Take the figures whose place and id are wanted."""
        taken = [one for where, one in self._left if wanted(where, one.key)]
        self._left = [(where, one) for where, one in self._left if not wanted(where, one.key)]
        return taken


def modules(package: ModuleType) -> Iterator[ModuleType]:
    """The figure files of a package, by name."""
    for found in sorted(pkgutil.iter_modules(package.__path__), key=lambda one: one.name):
        yield importlib.import_module(f"{package.__name__}.{found.name}")


def drawn(package: ModuleType, content: Any) -> Iterator[tuple[str, Drawn]]:
    """Draw every figure of a section: (place, figure)."""
    for module in modules(package):
        for one in module.drawn(content):
            yield getattr(module, "PLACE", "more"), one


def hang(
    package: ModuleType, content: Any, section: str, folder: Path | None = None
) -> list[tuple[str, Illustration]]:
    """Draw the figures of a section, and write their files where there is a folder.

    - `section`: its name. - `folder`: of the page.

    Raises EnvironmentFaultError where the folder cannot be written.
    """
    with ThreadPoolExecutor(1) as beside:  # pixels are packed while the next figure is drawn
        found, packed = [], []
        for place, one in drawn(package, content):
            hung, png = illustration(one, section, folder, beside)
            found.append((place, hung))
            packed += [] if png is None else [png]
    for png in packed:
        png.result()
    return found


def take_down(folder: Path, section: str) -> None:
    """Remove the files of a section's figures that an earlier run wrote."""
    for path in (folder / "figures").glob(f"{section}-*"):
        path.unlink()


def illustration(
    drawn: Drawn, section: str, folder: Path | None, beside: Executor
) -> tuple[Illustration, Future | None]:
    """Put a figure into a form that a page takes, and into files beside the page.

    - `section`: begins the name of the files, `figures/SECTION-NAME.svg` (.pdf, .png, .csv).
    - `folder`: of the page; None: no file is written. - `beside`: packs pixels.

    The second of what is returned waits for these; None where there are none.

    Raises EnvironmentFaultError where the folder cannot be written.
    """
    name = f"{section}-{drawn.name}"
    key = f"fig-{name}"
    _settle(drawn.figure)
    text = svg(drawn.figure, key)
    if folder is None:
        return Illustration(key, text, drawn.caption, drawn.alt, ()), None
    png = _png(drawn.figure, folder / "figures" / f"{name}.png", beside)
    files = _written(folder, name, drawn, text)
    return Illustration(key, text, drawn.caption, drawn.alt, files), png


def _settle(figure: Figure) -> None:
    """Lay the figure out once: three formats of it differ in nothing."""
    engine = figure.get_layout_engine()
    if engine is not None:
        with house_style():
            engine.execute(figure)
            figure.set_layout_engine("none")


def _png(figure: Figure, path: Path, beside: Executor) -> Future:
    """Draw a figure in pixels, and have them written."""
    usual = figure.dpi
    figure.set_dpi(DOTS_PER_INCH)
    canvas = FigureCanvasAgg(figure)
    with house_style():
        canvas.draw()
    figure.set_dpi(usual)

    def pack() -> None:
        with replacing(path) as whole, whole.open("wb") as file:
            imsave(file, canvas.buffer_rgba(), format="png", origin="upper", dpi=DOTS_PER_INCH)

    return beside.submit(pack)


def _written(folder: Path, name: str, drawn: Drawn, text: str) -> tuple[str, ...]:
    """Write the files of a figure; returns their names from the page's folder."""
    base = folder / "figures" / name
    write_text(base.with_suffix(".svg"), f'<?xml version="1.0" encoding="utf-8"?>\n{_alone(text)}')
    with house_style(), replacing(base.with_suffix(".pdf")) as path:
        FigureCanvasPdf(drawn.figure).print_pdf(path, metadata={"CreationDate": None})
    suffixes = ["svg", "pdf", "png"]
    if drawn.numbers:
        write_text(base.with_suffix(".csv"), as_csv(drawn.numbers))
        suffixes.append("csv")
    return tuple(f"figures/{name}.{suffix}" for suffix in suffixes)


def _alone(text: str) -> str:
    """An `<svg>` element that stands alone in a file, on white paper."""
    named = text if "xmlns=" in text else text.replace("<svg ", _NAMED, 1)
    return named + "\n"


_NAMED = '<svg xmlns="http://www.w3.org/2000/svg" '


def as_csv(numbers: Columns) -> str:
    """The columns as text, six significant digits; a shorter one leaves its last cells empty."""
    columns = (np.atleast_1d(np.asarray(values)) for values in numbers.values())
    return csv_text(numbers, zip_longest(*map(_cells, columns)))


def _cells(column: np.ndarray) -> list[str]:
    """The cells of a column, a type at a time where it has one."""
    values = column.tolist()
    if column.dtype.kind == "f":
        return [f"{value:.6g}" if math.isfinite(value) else "" for value in values]
    return [_cell(value) for value in values]


def _cell(value: object) -> str:
    if isinstance(value, bool | np.bool_):
        return str(int(value))
    if not isinstance(value, float | np.floating):
        return str(value)
    return f"{value:.6g}" if math.isfinite(value) else ""

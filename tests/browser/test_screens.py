"""Pages as they look, compared with how they looked when somebody approved of them.

Of every figure, table, listing and first screen a small picture is kept, each of its pixels the
mean of a square of the page. Small enough for a repository, and blind to how a letter is drawn or
where a line breaks, but not to a table that is cut or a figure that is lost. Text is set in the
font that Matplotlib brings along, the same on every machine. After a change that is meant:

    RIGID_APPROVE=1 python -m pytest -n 0 -m browser tests/browser/test_screens.py

and look at the whole pages, which then lie in `build/screens/`, before the pictures are committed.
"""

import io
import os
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from PIL import Image, ImageFilter

pytestmark = pytest.mark.browser
APPROVED = Path(__file__).parent / "approved"
SEEN = Path(__file__).parents[2] / "build" / "screens"
FONTS = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
WIDTHS = (1280, 390)
PAGES = ("fresh", "laws", "discovery", "compare", "bands")
PARTS = "header, .front, figure, .scroll, pre"
SQUARE = 16
"""Pixels of the page, across and down, that one pixel of an approved picture stands for."""
BETWEEN = (255, 0, 255)
"""Colour of the rows between two parts."""
STEP = 7.0
"""Levels of 255 from which on a square counts as changed."""
BLUR = ImageFilter.BoxBlur(1)
"""Squares are compared with their neighbours: a letter may lie in the next one."""
LONGER = 0.1
"""Share by which a part may be wider, narrower, longer or shorter."""
MOST = 0.1
"""Share of the squares of a part that may have changed; letters placed otherwise change 0.01 of
them, a column of a table that is lost 0.28."""
FONT = "".join(
    f'@font-face {{ font-family: Approved; font-weight: {weight}; src: url("{path.as_uri()}") }}\n'
    for weight, path in (
        ("100 500", FONTS / "DejaVuSans.ttf"),
        ("501 900", FONTS / "DejaVuSans-Bold.ttf"),
    )
)
STYLE = f"{FONT} * {{ font-family: Approved !important; font-style: normal !important }}"
OPEN = """for (const one of document.querySelectorAll('details'))
    one.open = one.querySelector('.made') === null;"""


def screen(browser, path: Path, width: int, style: str = "") -> tuple[Image.Image, list]:
    """A page in whole with all layers open but that of versions and dates, and where its parts are.

    - `style`: what is broken. Parts are (left, top, right, bottom) in pixels.
    """
    page = browser.new_page(viewport={"width": width, "height": 900})
    page.goto(path.as_uri())
    page.add_style_tag(content=STYLE + style)
    page.evaluate(OPEN)
    page.evaluate("document.fonts.ready")
    taken = page.screenshot(full_page=True)
    parts = page.evaluate(
        "parts => [...document.querySelectorAll(parts)].map(one => one.getBoundingClientRect())"
        ".filter(at => at.width).map(at => [at.left, at.top, at.right, at.bottom])",
        PARTS,
    )
    page.close()
    return Image.open(io.BytesIO(taken)).convert("RGB"), parts


def squares(taken: Image.Image, parts: list) -> list[Image.Image]:
    """Mean colour of every square of each part."""
    out = []
    for left, top, right, bottom in parts:
        part = taken.crop((int(left), int(top), int(right), max(int(bottom), int(top) + 1)))
        size = [max(1, round(length / SQUARE)) for length in part.size]
        out.append(part.resize(size, Image.Resampling.BOX))
    return out


def written(parts: list[Image.Image], path: Path) -> None:
    """Write parts below each other into one picture."""
    size = max(part.width for part in parts), sum(part.height + 1 for part in parts)
    whole, row = Image.new("RGB", size, BETWEEN), 0
    for part in parts:
        whole.paste(part, (0, row))
        row += part.height + 1
    path.parent.mkdir(exist_ok=True)
    whole.save(path, optimize=True)


def kept(path: Path) -> list[Image.Image]:
    """Read the parts of an approved picture."""
    whole = Image.open(path).convert("RGB")
    between = np.all(np.asarray(whole) == BETWEEN, axis=2)
    out, first = [], 0
    for row in np.flatnonzero(between.all(axis=1)):
        width = int(np.argmax(between[first])) or whole.width
        out.append(whole.crop((0, first, width, int(row))))
        first = int(row) + 1
    return out


def faults(taken: list[Image.Image], approved: list[Image.Image]) -> list[str]:
    """Say what of the parts is not as approved."""
    if len(taken) != len(approved):
        return [f"{len(taken)} parts in place of {len(approved)}"]
    found = []
    for number, (new, old) in enumerate(zip(taken, approved, strict=True), 1):
        off = [abs(a - b) for a, b in zip(new.size, old.size, strict=True)]
        if any(a > max(1.0, LONGER * b) for a, b in zip(off, old.size, strict=True)):
            found.append(f"part {number}: {new.size} in place of {old.size} squares")
            continue
        fitted = old.resize(new.size, Image.Resampling.BILINEAR)
        shown, known = (np.asarray(one.filter(BLUR), float) for one in (new, fitted))
        apart = np.abs(shown - known).max(axis=2)
        share = float(np.mean(apart > STEP))
        if share > MOST:
            found.append(f"part {number}: {share:.0%} of its squares look otherwise")
    return found


@pytest.fixture
def page(request, calibration, example):
    return lambda name: calibration if name == "fresh" else example(name)


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("name", PAGES)
def test_a_page_looks_as_approved(browser, page, name, width):
    whole, parts = screen(browser, page(name), width)
    SEEN.mkdir(parents=True, exist_ok=True)
    whole.save(SEEN / f"{name}-{width}.png")
    approved = APPROVED / f"{name}-{width}.png"
    if os.environ.get("RIGID_APPROVE"):
        written(squares(whole, parts), approved)
    assert faults(squares(whole, parts), kept(approved)) == [], SEEN / approved.name


@pytest.mark.parametrize(
    "broken",
    [
        ".scroll { max-height: 6rem; overflow: hidden !important }",
        ".scroll td:last-child { visibility: hidden }",
        "figure svg { visibility: hidden }",
        "figure:first-of-type { display: none }",
        ".front { background: none !important }",
        ".scroll { width: 60% }",
    ],
)
@pytest.mark.parametrize("width", WIDTHS)
def test_a_page_broken_on_purpose_does_not(browser, calibration, width, broken):
    assert faults(
        squares(*screen(browser, calibration, width, broken)), kept(APPROVED / f"fresh-{width}.png")
    )


@pytest.mark.parametrize("width", WIDTHS)
def test_letters_drawn_otherwise_do(browser, calibration, width):
    smoother = "* { text-rendering: geometricPrecision }"
    shown = screen(browser, calibration, width, smoother)
    assert faults(squares(*shown), kept(APPROVED / f"fresh-{width}.png")) == []

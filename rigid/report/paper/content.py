"""What the section on the paper shows, as values, and how it is made of what was computed."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from rigid.plots import metrology
from rigid.published.walk.errata import ERRATA, Erratum
from rigid.published.walk.items import COMPUTED, DIFFERS, GIVEN, MISPRINT, REPRODUCED, Item
from rigid.published.walk.numbers import published_file
from rigid.published.walk.walk import Walk
from rigid.report.content import BAD, GOOD, Answer, Check, Content, Front
from rigid.report.made import made
from rigid.report.paper import figures
from rigid.report.paper.typeset import BELONGS, SYMBOLS, TYPESET, Typeset
from rigid.report.section import Kind
from rigid.spec import Spec

KIND = Kind("paper", 5, "The paper, computed again", "paper.html.j2", figures)

MARKS = {
    REPRODUCED: "✓ reproduced",
    MISPRINT: "✗ misprint",
    DIFFERS: "≠ differs",
    GIVEN: "taken as given",
    COMPUTED: "computed",
}
"""Verdicts as the page writes them."""

LEAST_SHOWN = 1e-9
"""Relative difference below which two ways of computing the same number differ by rounding."""

FAR, LARGE = 2.0, 0.1
"""Ratio from which on a factor is told, and relative difference told without decimals."""

NO_BAND = 1e-6
"""Relative width below which a band is that of rounding errors."""

PARTS = (
    ("construction", "Construction of the rig", (), (3,), "section Construction"),
    ("model", "Mathematical model, (2) to (14)", tuple(range(2, 15)), (4,),
     "section Mathematical model"),
    ("calibration", "Calibration experiments, (15) to (18)", (15, 16, 17, 18), (6, 8, 9),
     "section Calibration experiments"),
    ("simulations", "Numerical simulations, (19) to (23)", (19, 20, 21, 22, 23), (10, 11, 12),
     "section Numerical simulations"),
)  # fmt: skip
"""The page follows the paper: anchor, heading, equations, figures, section of the paper."""


@dataclass(frozen=True)
class Row:
    """An item as the page shows it: all text."""

    name: str
    place: str
    what: str
    printed: str
    computed: str
    band: str
    difference: str
    verdict: str
    mark: str
    reason: str
    erratum: str


@dataclass(frozen=True)
class EquationShown:
    """An equation: number, title, lines of MathML, symbols, its two sides, numbers that follow."""

    number: int
    title: str
    lines: tuple[Markup, ...]
    symbols: tuple[tuple[str, str, str], ...]
    sides: Row
    rows: tuple[Row, ...]


@dataclass(frozen=True)
class Part:
    """A section of the paper: anchor, heading, equations, and figures with their rows."""

    anchor: str
    heading: str
    equations: tuple[EquationShown, ...]
    figures: tuple[tuple[int, tuple[Row, ...]], ...]


@dataclass(frozen=True, eq=False, kw_only=True)
class PaperContent(Content):
    """The section, complete.

    - `parts`: as the paper has them. - `numbers`: a row for each printed number, by place.
    - `errata`. - `walk`: what the figures are drawn of.
    """

    parts: tuple[Part, ...]
    numbers: tuple[Row, ...]
    errata: tuple[Erratum, ...]
    walk: Walk


def content(spec: Spec, found: Walk) -> PaperContent:
    """Gather the section.

    - `spec`: of the fit to the printed numbers, which stands on the same page.
    """
    digest = hashlib.sha256(published_file().read_bytes()).hexdigest()
    listed = (check(found),)
    return PaperContent(
        title="The paper, reproduced",
        simulated=False,
        front=front(found),
        provenance=made(spec, found.seed, [("data/paper/published.toml", digest)]),
        checks=listed,
        parts=tuple(_part(found, *one) for one in PARTS),
        numbers=tuple(row(found.item(name)) for name in found.numbers),
        errata=tuple(ERRATA.values()),
        walk=found,
    )


def check(found: Walk) -> Check:
    """Whether every item is reproduced or explained."""
    left = [f"{item.place}: {item.what}" for item in found.unexplained]
    if not left:
        return Check(
            "reproduced", True, f"each of {len(found.listed)} items is reproduced or explained"
        )
    return Check(
        "reproduced", False, f"{len(left)} items differ without a reason: {'; '.join(left)}"
    )


def counts(found: Walk) -> dict[str, int]:
    """Items by verdict."""
    return {v: sum(item.verdict == v for item in found.listed) for v in MARKS}


def front(found: Walk) -> Front:
    """Question, answer, and what cannot be computed again."""
    n, ok = counts(found), check(found)
    wrong = [i for i in found.listed if i.verdict in (MISPRINT, DIFFERS)]
    return Front(
        asked="Do the equations, numbers and figures of the paper follow from what it prints?",
        state=GOOD if ok.ok else BAD,
        ruling=(
            f"{n[REPRODUCED]} of {n[REPRODUCED] + len(wrong)} equations and numbers that can be "
            f"computed again are reproduced; {n[MISPRINT]} are misprints and {n[DIFFERS]} differ"
            + (", each with its reason." if ok.ok else ".")
        ),
        why=tuple(
            f"{title}: {'; '.join(_named(item) for item in wrong if item.verdict == verdict)}."
            for title, verdict in (("Misprints", MISPRINT), ("Differ", DIFFERS))
            if n[verdict]
        ),
        answers=(
            Answer("reproduced", str(n[REPRODUCED]), "within what is rounded to the print"),
            Answer("misprints", str(n[MISPRINT]), "each shown by a derivation or a number"),
            Answer("differ", str(n[DIFFERS]), "with a reason that is computed as well"),
            Answer("taken as given", str(n[GIVEN]), "constants, settings, readings of records"),
        ),
        cannot=(
            "The records behind Figures 6, 8, 9, 10 and 11 are not public. These figures are "
            "simulated with the solver of this package, and say so.",
            "The friction used for Figures 10 to 12 and the formula of the contact area before "
            "Figure 12 are not printed.",
        ),
    )


def _named(item: Item) -> str:
    """A short name of an item: an equation by its place, a number by what it is."""
    return item.place if item.name.startswith("equation") else item.what


def _part(
    found: Walk, anchor: str, heading: str, numbers: Sequence[int], shown: Sequence[int], _: str
) -> Part:
    return Part(
        anchor,
        heading,
        tuple(_equation(found, one) for one in TYPESET if one.number in numbers),
        tuple((number, figure_rows(found, number)) for number in shown),
    )


def _equation(found: Walk, one: Typeset) -> EquationShown:
    return EquationShown(
        one.number, one.title, one.shown, tuple(_symbol(found, key) for key in one.symbols),
        row(found.item(f"equation-{one.number}")),
        tuple(row(found.item(name)) for name in BELONGS.get(one.number, ())),
    )  # fmt: skip


def _symbol(found: Walk, key: str) -> tuple[str, str, str]:
    tex, meaning, unit, name = SYMBOLS[key]
    if not name:
        return tex, meaning, f"in {metrology.unit_text(unit)}" if unit != "1" else "pure number"
    return tex, meaning, metrology.exact(found.numbers[name].si, unit)


def figure_rows(found: Walk, number: int) -> tuple[Row, ...]:
    """Rows of a figure: what it shows in numbers, and the printed numbers it is the place of."""
    place = f"fig. {number}"
    listed = [item for item in found.listed if item.place.endswith(place)]
    return tuple(row(item) for item in listed if item.computed is not None)


def row(item: Item) -> Row:
    """An item as text, in the unit of the print where there is one."""
    unit, factor, found = item.unit, 1.0, item.erratum
    if item.as_printed and item.printed:
        number, _, unit = item.as_printed.partition(" ")
        factor = item.printed / float(number)
    bound = {"above": "> ", "below": "< ", "": ""}[item.bound]
    return Row(
        name=item.name,
        place=item.place,
        what=item.what,
        printed=bound + (_print(item.as_printed) or metrology.significant(item.printed, unit, 4)),
        computed="" if item.computed is None else metrology.significant(
            item.computed / factor, unit, 4
        ),
        band=_band(item, unit, factor),
        difference=_difference(item),
        verdict=item.verdict,
        mark=MARKS[item.verdict],
        reason=item.reason,
        erratum="" if found is None else found.key,
    )  # fmt: skip


def _band(item: Item, unit: str, factor: float) -> str:
    """The band as text; none where nothing uncertain enters."""
    if item.band is None or item.computed is None:
        return ""
    low, high = item.band
    if high - low < NO_BAND * abs(item.computed):
        return ""
    return metrology.interval(low / factor, high / factor, unit)


def _print(text: str) -> str:
    """A number with its unit as the paper sets it: "3.7e3 N s/m" -> "3.7 × 10³ N·s/m"."""
    number, _, unit = text.partition(" ")
    mantissa, e, order = number.partition("e")
    power = f" × 10{metrology.superscript(order)}" if e else ""
    return f"{mantissa}{power} {metrology.unit_text(unit)}".strip()


def _difference(item: Item) -> str:
    """How far the computed is from the print, as text."""
    relative = item.relative_difference
    if relative is None:
        return ""
    if abs(relative) < LEAST_SHOWN:
        return "rounding only"
    ratio = 1.0 + relative
    if ratio > FAR:
        return f"{metrology.significant(ratio, '')} times"
    if 0.0 < ratio < 1.0 / FAR:
        return f"1/{metrology.significant(1.0 / ratio, '')}"
    digits = 0 if abs(relative) >= LARGE else 2
    return metrology.minus(f"{100.0 * relative:+.{digits}f} %")

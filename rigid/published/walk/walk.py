"""The whole paper computed again: numbers, equations, figures."""

import dataclasses
from dataclasses import dataclass

import numpy as np

from rigid.physics.characteristic import modes
from rigid.published.walk import claims, equations
from rigid.published.walk.constants import draws, nominal, two_masses
from rigid.published.walk.histories import FAILURE, Progress, Simulated, simulate
from rigid.published.walk.items import Explanation, Item
from rigid.published.walk.numbers import Number, read_numbers


@dataclass(frozen=True, eq=False)
class Walk:
    """All that was computed.

    - `numbers`: as printed, by key. - `listed`: an item for each number, equation and figure.
    - `drawn`: constants of the rig within their uncertainty. - `simulated`; `seed`.
    """

    numbers: dict[str, Number]
    listed: tuple[Item, ...]
    drawn: list[dict[str, float]]
    simulated: Simulated
    seed: int

    @property
    def unexplained(self) -> tuple[Item, ...]:
        """Items that are neither reproduced nor explained."""
        return tuple(item for item in self.listed if not item.explained)

    def item(self, name: str) -> Item:
        """Return the item of a name."""
        return next(one for one in self.listed if one.name == name)


def walk(seed: int, progress: Progress, numbers: dict[str, Number] | None = None) -> Walk:
    """Compute everything.

    - `seed`: of the draws of the constants. - `numbers`: in place of those of the paper, for tests.
    """
    numbers = read_numbers() if numbers is None else numbers
    drawn = draws(numbers, seed)
    progress("printed numbers")
    listed = claims.items(numbers, drawn)
    progress("equations (2) to (23)")
    listed += equations.items(numbers)
    simulated = simulate(numbers, drawn, progress)
    listed = [
        _deviation(i, numbers, simulated) if i.name == "load_deviation" else i for i in listed
    ]
    listed += figures(numbers, drawn, simulated)
    return Walk(numbers, tuple(listed), drawn, simulated, seed)


def _deviation(item: Item, numbers: dict[str, Number], found: Simulated) -> Item:
    """The claim of 0.003 %, against one converter step that enters within one sample."""
    largest = numbers["largest_load"].si
    why = Explanation(
        "simulations", "One converter step of 295 N that enters within one sample of 10 ms makes "
        "load and ice force differ by 101 N, 0.034 % of the largest load of the rig.",
        3e-5, 100.9 / 300e3, 0.5 / 300e3,
    )  # fmt: skip
    return dataclasses.replace(
        item, what="largest difference of F_LC and F_Ice, in shares of the largest load",
        computed=found.step / largest, bound="below", explanation=why,
    )  # fmt: skip


def figures(
    numbers: dict[str, Number], drawn: list[dict[str, float]], found: Simulated
) -> list[Item]:
    """What the figures show in numbers."""
    return [
        *_frame(numbers, found),
        _oscillations(numbers, drawn),
        *(_sliding(numbers, found, cylinder) for cylinder in ("A", "B")),
        *_field(numbers, found),
        _drop(found),
    ]


def _band(values: np.ndarray) -> tuple[float, float]:
    low, high = np.percentile(values, (5, 95))
    return float(low), float(high)


def _frame(numbers: dict[str, Number], found: Simulated) -> list[Item]:
    """Stroke beyond the offset at the printed load, of the middle test."""
    run, full = found.frame[1], numbers["frame_load"].si
    offset = numbers["stroke_offset"].si
    strokes = np.array(
        [np.interp(full, load, stroke) for load, stroke in zip(run.load, run.stroke, strict=True)]
    )
    printed = numbers["frame_stroke"]
    return [Item(
        "figure-6-stroke", "fig. 6", "stroke at 250 kN in the frame, less the offset of 1 mm", "m",
        printed.si, float(strokes[0] - offset), _band(strokes - offset), printed.half_width,
        as_printed=printed.as_printed(), note="simulated with k_LC as printed",
    )]  # fmt: skip


def _oscillations(numbers: dict[str, Number], drawn: list[dict[str, float]]) -> Item:
    """Periods of the slow mode within the printed duration."""
    lasts, mu = numbers["release_duration"].si, numbers["mu_release"].si

    def count(values: dict[str, float]) -> float:
        return lasts / float(modes(two_masses(values), mu).period[0])

    printed = numbers["release_oscillations"]
    return Item(
        "figure-8-oscillations", "fig. 8", "periods of the slow mode in 40 ms at the μ of (17)",
        "1", printed.si, count(nominal(numbers)), _band(np.array([count(d) for d in drawn])), 0.5,
        as_printed=printed.as_printed(),
        note="but the mode goes on: after 40 ms 84 % of it is left",
    )  # fmt: skip


def _sliding(numbers: dict[str, Number], found: Simulated, cylinder: str) -> Item:
    """S p / v of a simulated free run."""
    run, printed = found.running[cylinder], numbers[f"mu_{cylinder}"]
    speed = (run.stroke[:, -1] - run.stroke[:, -21]) / (run.time[-1] - run.time[-21])
    ratio = numbers["pushing_area"].si * run.pressure[:, -1] / speed
    return Item(
        f"figure-9-{cylinder}", "fig. 9", f"S_Pl p_oil / v_SS of cylinder {cylinder}, simulated",
        "N s/m", printed.si, float(ratio[0]), _band(ratio), printed.half_width,
        as_printed=printed.as_printed(), note="the friction put in comes out; speeds are borrowed",
    )  # fmt: skip


def _field(numbers: dict[str, Number], found: Simulated) -> list[Item]:
    """Pressure, strokes and displacements of the field test."""
    run, ice = found.simulated["A"], found.ice["A"]
    fails = numbers["contact_until"].si
    apart = np.abs(run.plunger - run.stroke).max(axis=1)
    quiet = (run.time > numbers["contact_from"].si + 5.0) & (run.time < fails - FAILURE)
    excess = np.abs(run.load[:, quiet] - ice[quiet]).max(axis=1)
    before = int(np.argmax(run.time >= fails))
    return [
        Item("figure-10-pressure", "fig. 10", "largest oil pressure of A, simulated", "Pa", None,
             float(run.pressure[0].max()), _band(run.pressure.max(axis=1)),
             note="at the ice load chosen here"),
        Item("figure-11-apart", "fig. 11", "largest |x_Pl − x_SS| of A, simulated", "m", None,
             float(apart[0]), _band(apart), note="the load over k_LC, steps of the stroke sensor "
             "are 0.22 mm; 'very small' beside the stroke"),
        Item("figure-11-load", "fig. 11", "largest |F_LC − F_Ice| of A while the load rises", "N",
             None, float(excess[0]), _band(excess),
             note="a smooth load; one converter step makes it 101 N"),
        Item("figure-11-stroke", "fig. 11", "stroke of A when the beam fails, at κ = 0.2", "m",
             None, float(run.stroke[0, before]), _band(run.stroke[:, before]),
             note="more than the largest stroke of (1), 0.37 m: with the fast flow of (22) a "
             "constant κ = 0.2 cannot hold from 0 to 50 s"),
    ]  # fmt: skip


def _drop(found: Simulated) -> Item:
    """How far the plate moves under the largest drop."""
    most = max(found.drops)
    moved = np.abs(found.drops[most].plunger - found.drops[0.0].plunger).max(axis=1)
    return Item(
        "figure-12-plate", "fig. 12", "largest move of the plate at a drop of 60 %, simulated", "m",
        None, float(moved[0]), _band(moved), note="3.7 mm at rest, the rest is overshoot",
    )  # fmt: skip

"""Files of the bands: a table over time, the parts of its uncertainty, and JSON for programs."""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rigid.inference.reference_check import SolverCheck
from rigid.inference.summary import Check
from rigid.io.files import replacing
from rigid.report.taken import taken_over
from rigid.smoothing.budget import FIGURES, PARTS, Line
from rigid.smoothing.finished import Finished
from rigid.smoothing.laws import RigModel
from rigid.smoothing.paths import UNITS
from rigid.smoothing.run import PART_NAMES, Bands

SCHEMA = 1
QUANTILES = ("median", "q05", "q25", "q75", "q95")
ORDER = (2, 0, 1, 3, 4)
"""Places of QUANTILES among 5, 25, 50, 75 and 95 %."""

MOST_GAP = 1.5
"""Residuals of a channel beyond this multiple of noise and rounding are not explained."""


def unit(quantity: str) -> str:
    """SI unit of a quantity such as `load_A`."""
    return UNITS[quantity.split("_")[0]]


def write_bands(folder: Path, found: Bands) -> None:
    """Write `<record>.csv`, median and quantiles over time, and `<record>-parts.csv`.

    Columns are `time [s]`, then for each quantity `load_A median [N]`, `load_A q05 [N]`, ...; parts
    are standard deviations, `load_A noise [N]`, ...
    """
    names = list(found.bands)
    head = [f"{n} {q} [{unit(n)}]" for n in names for q in QUANTILES]
    columns = [found.bands[n].quantiles[list(ORDER)] for n in names]
    _write(folder / f"{found.name}.csv", ["time [s]", *head], (found.time, columns))
    head = [f"{n} {p} [{unit(n)}]" for n in names for p in PART_NAMES]
    columns = [found.bands[n].parts for n in names]
    _write(folder / f"{found.name}-parts.csv", ["time [s]", *head], (found.time, columns))


def _write(path: Path, head: Sequence[str], table: tuple[np.ndarray, list[np.ndarray]]) -> None:
    """Write a table row by row; times to a tenth of a millisecond, the rest to six digits."""
    time, columns = table
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        file.write(",".join(head) + "\n")
        for first in range(0, len(time), 10_000):
            here = slice(first, first + 10_000)
            block = np.concatenate([c[:, here] for c in columns]).T
            for t, row in zip(time[here], block, strict=True):
                file.write(f"{t:.4f}," + ",".join(f"{v:.6g}" for v in row) + "\n")


def checks(all_found: Iterable[Finished], laws: Iterable[RigModel]) -> list[Check]:
    """What must hold for the bands to be used."""
    gaps = {place: gap for found in all_found for place, gap in found.gaps.items()}
    at = max(gaps, key=gaps.__getitem__)
    worst = gaps[at]
    said = (
        f"readings lie {worst:.2f} times noise and rounding from what the rig explains, at worst, "
        f"in {at} (limit {MOST_GAP})"
    )
    failed = [f"{law.name}: {law.failed}" for law in laws if law.failed]
    told = "the calibration that the bands rest on may be used"
    if failed:
        told = f"the calibration must not be used as it stands ({' | '.join(failed)})"
    found = [Check("posterior", not failed, told), Check("residuals", worst <= MOST_GAP, said)]
    solver = worst_of(all_found)
    return found if solver is None else [*found, solver.check]


def worst_of(all_found: Iterable[Finished]) -> SolverCheck | None:
    """The check of the steps that came out worst over all records, cylinders and laws."""
    checks = [one for found in all_found for one in found.solver]

    def off(one: SolverCheck) -> tuple[bool, float]:
        return not one.ok, np.inf if one.worst is None else one.worst.bars

    return max(checks, key=off, default=None)


def as_dict(
    spec_name: str,
    simulated: bool,
    seed: int,
    all_found: Sequence[Finished],
    laws: Sequence[RigModel],
) -> dict[str, Any]:
    """Everything but the series, for programs."""
    listed, solver = checks(all_found, laws), worst_of(all_found)
    return {
        "schema": SCHEMA,
        "spec": spec_name,
        "simulated": simulated,
        "usable": all(one.ok for one in listed),
        "checks": [one.values() for one in listed],
        "records": {found.name: _record(found) for found in all_found},
        **taken_over(
            (effect for law in laws for effect in law.effects),
            (found.kind for found in all_found),
            (one for found in all_found for one in found.aside),
        ),
        "solver": None if solver is None else solver.values(),
        "seed": seed,
        "sha256": {place: mark for found in all_found for place, mark in found.sha256.items()},
    }


def _record(found: Finished) -> dict[str, Any]:
    return {
        "budget": [
            {
                "place": line.place, "quantity": line.name, "unit": line.unit,
                "median": line.median, "q05": line.q05, "q95": line.q95,
                "combined": line.combined, "parts": dict(zip(PARTS, line.parts, strict=True)),
            }
            for line in found.budget
        ],
        "falls": [vars(fall) for fall in found.falls],
        "valve": [vars(turn) for turn in found.turns],
    }  # fmt: skip


def table(all_found: Sequence[Finished]) -> str:
    """The budgets as text: a line a number, then its parts in the same unit."""
    rows = [(found.name, line) for found in all_found for line in found.budget]
    record = max([11, *(len(name) for name, _ in rows)]) + 1
    place = max([6, *(len(line.place) for _, line in rows)]) + 1
    lines = [f"{'record':{record}}{'place':{place}}{'quantity':28}{'unit':6}" + _heads()]
    for name, line in rows:
        head = f"{name:{record}}{line.place:{place}}{line.name:28}{line.unit:6}"
        lines.append(head + "".join(_cells(line)))
    return "\n".join(lines) + "\n"


def _heads() -> str:
    short = ("noise", "sensors", "rig", "form", "own")
    return "".join(f"{h:>11}" for h in ("median", "5 %", "95 %", "combined", *short))


def _cells(line: Line) -> Iterator[str]:
    assert line.name in FIGURES
    for value in (line.median, line.q05, line.q95, line.combined):
        yield f"{value:11.5g}"
    for value in line.parts:
        yield f"{'-':>11}" if value is None else f"{value:11.2g}"

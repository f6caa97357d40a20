"""compare.json, comparison.csv and the table on standard output."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

from rigid.io.files import csv_text, finite, json_text, write_text
from rigid.report.compare.content import Compared
from rigid.report.compare.moved import SAYS, Move

SCHEMA = 1
COLUMNS: tuple[str, ...] = (
    "parameter", "unit", "reference", "run", "median_before", "sd_before", "q05_before",
    "q95_before", "median_after", "sd_after", "q05_after", "q95_after", "difference",
    "logarithms", "sd_of_difference", "rule", "z", "least_z", "most_z",
)  # fmt: skip


def as_dict(found: Compared) -> dict[str, Any]:
    """All of compare.json."""
    return {
        "schema": SCHEMA,
        "usable": found.usable,
        "checks": [asdict(check) for check in found.checks],
        "simulated": any(run.simulated for run in found.runs),
        "runs": [
            {
                "name": run.name, "path": run.path.as_posix(), "spec": run.spec_name,
                "usable": run.usable, "failed": list(run.failed), "gap": finite(run.overall),
                "effects": list(run.effects), "seed": run.seed, "versions": dict(run.versions),
                "sha256": dict(run.sha256), "missing": list(run.notes),
            }
            for run in found.runs
        ],
        "sharing": [{**asdict(one), "says": SAYS[one.rule]} for one in found.sharings],
        "moved": [row(move) for moved in found.moved for move in moved],
        "gaps": [
            {"record": g.record, "channel": g.channel, "says": g.says,
             "gap": {run.name: finite(v) for run, v in zip(found.runs, g.gaps, strict=True)}}
            for g in found.gaps
        ],
        "differences": [
            {"sort": d.sort, "name": d.name,
             "values": {run.name: v for run, v in zip(found.runs, d.values, strict=True)}}
            for d in found.differing
        ],
        "others": list(found.others),
    }  # fmt: skip


def row(move: Move) -> dict[str, Any]:
    """A move as columns of comparison.csv."""
    least, most = move.bounds or (None, None)
    sides = {
        f"{key}_{when}": finite(getattr(side, key))
        for when, side in (("before", move.before), ("after", move.after))
        for key in ("median", "sd", "q05", "q95")
    }
    return {
        "parameter": move.parameter, "unit": move.unit, "reference": move.reference,
        "run": move.run, **sides, "difference": finite(move.difference),
        "logarithms": move.logarithms, "sd_of_difference": finite(move.sd), "rule": move.rule,
        "z": finite(move.z), "least_z": finite(least), "most_z": finite(most),
    }  # fmt: skip


def write(folder: Path, found: Compared) -> None:
    """Write compare.json and comparison.csv."""
    write_text(folder / "compare.json", json_text(as_dict(found)))
    listed = (row(move) for moved in found.moved for move in moved)
    rows = ([one[column] for column in COLUMNS] for one in listed)
    write_text(folder / "comparison.csv", csv_text(COLUMNS, rows))


def table(found: Compared) -> str:
    """Text for standard output: what moved, farthest first, by run."""
    lines = []
    names = (move.parameter for moved in found.moved for move in moved)
    wide = max([30, *map(len, names)]) + 2
    for one, moved in zip(found.sharings, found.moved, strict=True):
        lines.append(f"{one.reference} -> {one.run}: {SAYS[one.rule]}")
        head = f"{'unit':8}{'before':>13}{'after':>13}{'moved [sd]':>12}"
        lines.append(f"{'parameter':{wide}}{head}")
        for move in moved:
            z = "-" if move.z is None else f"{move.z:+.2f}"
            lines.append(
                f"{move.parameter:{wide}}{move.unit:8}{move.before.median:13.5g}"
                f"{move.after.median:13.5g}{z:>12}"
            )
    lines += [
        f"{d.sort} {d.name}: " + " | ".join(d.values)
        for d in found.differing
        if d.sort in ("effect", "prior")
    ]
    return "\n".join(lines) + "\n"

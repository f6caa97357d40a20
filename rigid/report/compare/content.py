"""What the section on runs side by side shows."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rigid.io.files import MIB, read_bytes
from rigid.plots import metrology
from rigid.report.compare import figures
from rigid.report.compare.differences import Difference, GapRow, differences, gap_rows, others
from rigid.report.compare.moved import MOVED, SAYS, Move, Sharing, moves, same_model, sharing
from rigid.report.compare.runs import Run
from rigid.report.content import BAD, GOOD, RESERVE, Answer, Check, Content, Front
from rigid.report.made import made_of
from rigid.report.section import Kind

KIND = Kind("compare", 60, "Runs side by side", "compare.html.j2", figures)

SHOWN = 6
"""Moves that stand on the first screen."""


@dataclass(frozen=True, eq=False)
class Compared:
    """Runs compared; the first is the reference.

    - `sharings`: of the reference with each other run. - `moved`: by other run, in that order.
    - `gaps`; `differing`; `others`: what other commands say.
    """

    runs: tuple[Run, ...]
    sharings: tuple[Sharing, ...]
    moved: tuple[tuple[Move, ...], ...]
    gaps: tuple[GapRow, ...]
    differing: tuple[Difference, ...]
    others: tuple[str, ...]

    @property
    def usable(self) -> bool:
        """Whether every run that tells may be used."""
        return all(run.usable is not False for run in self.runs)

    @property
    def checks(self) -> tuple[Check, ...]:
        """A check for each run: may it be used."""
        return tuple(
            Check(
                f"{run.name} usable",
                run.usable is not False,
                "; ".join(run.failed)
                or ("not known" if run.usable is None else "its checks say so"),
            )
            for run in self.runs
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class CompareContent(Content):
    """The section: `compared`, and its rows as text.

    - `heads`: names of the runs. - `overview`: (what, value in each run).
    - `tables`: by other run: its name, what is said of the sd, rows of moves.
    - `gaps`: (record, channel, what stands out, values).
    """

    compared: Compared
    heads: tuple[str, ...]
    overview: tuple[tuple[str, tuple[str, ...]], ...]
    tables: tuple[tuple[str, str, tuple[tuple[str, ...], ...]], ...]
    gaps: tuple[tuple[str, str, str, tuple[str, ...]], ...]


def compared(runs: Sequence[Run]) -> Compared:
    """Compare runs with the first."""
    first, rest = runs[0], runs[1:]
    return Compared(
        tuple(runs),
        tuple(sharing(first, run) for run in rest),
        tuple(tuple(moves(first, run)) for run in rest),
        gap_rows(runs),
        differences(runs),
        others(runs),
    )


def content(found: Compared) -> CompareContent:
    """Gather the section."""
    return CompareContent(
        title=f"{len(found.runs)} runs side by side",
        simulated=any(run.simulated for run in found.runs),
        front=front(found),
        provenance=made_of("", "", None, _digests(found.runs)),
        checks=found.checks,
        compared=found,
        heads=tuple(run.name for run in found.runs),
        overview=_overview(found.runs),
        tables=tuple(
            (one.run, f"{SAYS[one.rule]}.", tuple(_row(move) for move in moved))
            for one, moved in zip(found.sharings, found.moved, strict=True)
        ),
        gaps=tuple(
            (row.record, row.channel, row.says, tuple(metrology.ratio(g, 3) for g in row.gaps))
            for row in found.gaps
        ),
    )


def _digests(runs: Sequence[Run]) -> list[tuple[str, str]]:
    """Digests of the files that were read."""
    out = []
    for run in runs:
        names = ("result.json", "posterior.nc")
        files = [run.path / name for name in names] if run.path.is_dir() else [run.path]
        for path in files:
            if path.is_file():
                told = hashlib.sha256(read_bytes(path, MOST_READ)).hexdigest()
                out.append((f"{run.name}: {path.name}", told))
    return out


MOST_READ = 4096 * MIB
"""Of a posterior."""


def front(found: Compared) -> Front:
    """What was asked, what moved, whether the runs may be compared."""
    far = [move for moved in found.moved for move in moved if move.moved]
    known = [move for moved in found.moved for move in moved]
    names = ", ".join(run.name for run in found.runs[1:])
    ruling = _ruling(found, far, known)
    standing_out = [row for row in found.gaps if row.says]
    return Front(
        asked=f"What moved from {found.runs[0].name} to {names}, and why?",
        state=BAD if not found.usable else RESERVE if far or standing_out else GOOD,
        ruling=ruling,
        why=(
            *(f"{check.name}: {check.says}." for check in found.checks if not check.ok),
            *(f"{one.reference} and {one.run}: {SAYS[one.rule]}." for one in found.sharings),
            *(
                f"Record {row.record}, {row.channel}: {row.says}, gaps "
                f"{', '.join(metrology.ratio(gap, 3) for gap in row.gaps)}."
                for row in standing_out[:SHOWN]
            ),
        ),
        answers=tuple(
            Answer(
                f"{move.parameter} in {move.run}",
                " → ".join(_values(move)),
                f"moved by {_z(move)} sd" + (f"; {_bounds(move)}" if move.bounds else ""),
            )
            for move in sorted(known, key=_rank)[:SHOWN]
        ),
        cannot=tuple(f"{run.name} has {note}." for run in found.runs for note in run.notes),
        next=_next(found, bool(far or standing_out)),
        figure="moved" if known else "",
    )


def _next(found: Compared, differ: bool) -> tuple[str, ...]:
    if not found.usable:
        return ("Mend the runs that are not usable first; their reports say how.",)
    if not differ:
        return ()
    return (
        "Look at what differs, below: all that is listed there can have moved the numbers. Where "
        "records alone differ, the rig has changed or its model lacks an effect: run `rigid "
        "discover` on the spec whose gap is larger.",
    )


def _rank(move: Move) -> tuple[bool, float]:
    """The machine's own numbers first, the farthest moved first."""
    return move.parameter.startswith(BESIDE), -abs(move.z or 0.0)


BESIDE = ("noise", "gain", "zero", "preload", "release_time")
"""Numbers of sensors and of single records, after those of the machine."""


def _ruling(found: Compared, far: Sequence[Move], known: Sequence[Move]) -> str:
    if not found.usable:
        bad = " and ".join(run.name for run in found.runs if run.usable is False)
        return f"{bad} must not be used as it stands, and neither must this comparison."
    if not known:
        return "The runs have no number in common."
    if not far:
        return f"No number moved by more than {MOVED:g} standard deviations."
    names = dict.fromkeys(move.parameter for move in sorted(far, key=_rank))
    told = ", ".join(list(names)[:SHOWN]) + (", and more" if len(names) > SHOWN else "")
    share = f"{len(far)} of {len(known)} numbers"
    return f"{share} moved by more than {MOVED:g} standard deviations: {told}."


def _values(move: Move) -> tuple[str, ...]:
    """Before and after, each with its interval."""
    return tuple(
        metrology.median_and_interval((one.q05, one.median, one.q95), move.unit)
        for one in (move.before, move.after)
    )


def _z(move: Move) -> str:
    return metrology.ABSENT if move.z is None else metrology.minus(f"{round(move.z, 1) + 0.0:+.1f}")


def _bounds(move: Move) -> str:
    """The least and the most that |z| may be."""
    if move.bounds is None:
        return ""
    low, high = move.bounds
    return f"{low:.1f} to {high:.1f}" if high < MOST_TOLD else f"at least {low:.1f}"


MOST_TOLD = 100.0
"""Standard deviations beyond which no number is told."""


def _signed(percent: float) -> str:
    """Two digits of it, since it is a difference of uncertain numbers; 0 below a hundredth."""
    return metrology.minus(f"{float(f'{percent:.1e}'):+g}") if abs(percent) >= 0.01 else "0"


def _row(move: Move) -> tuple[str, ...]:
    """Parameter, before, after, change, standard deviations, bounds."""
    change = move.after.median / move.before.median if move.before.median else None
    if move.logarithms:
        told = f"× {change:.3g}"
    elif change is not None and change > 0.0:
        told = f"{_signed(100.0 * (change - 1.0))} %"
    else:
        told = metrology.significant(move.difference, move.unit)
    return move.parameter, *_values(move), told, _z(move), _bounds(move)


def _overview(runs: Sequence[Run]) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """A line for each thing that is told of every run."""
    first = runs[0]
    lines = {
        "Folder or file": [Path(run.path).as_posix() for run in runs],
        "Spec": [run.spec_name or "not known" for run in runs],
        "May be used": [{True: "yes", False: "no", None: "not known"}[run.usable] for run in runs],
        "Overall gap": [metrology.ratio(run.overall, 3) for run in runs],
        "Records": [str(len(run.sha256)) if run.sha256 else "not known" for run in runs],
        "Records of the first": [
            str(sum(d in first.digests for d in run.sha256.values())) for run in runs
        ],
        "Model and priors of the first": [
            "the first"
            if run is first
            else "the same"
            if same_model(first, run)
            else "not known"
            if not (first.values and run.values)
            else "another"
            for run in runs
        ],
        "Numbers": [str(len(run.parameters)) for run in runs],
        "Seed": ["not known" if run.seed is None else str(run.seed) for run in runs],
    }
    return tuple((name, tuple(values)) for name, values in lines.items())

"""What differs between runs: gaps of records, specs, effects, priors, digests, versions, seeds."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rigid.report.compare.runs import Run
from rigid.report.usability import MOST_CHANNEL_GAP

APART = 0.1
"""Difference of two gaps from which on a record counts as fitted differently."""


@dataclass(frozen=True)
class GapRow:
    """Gap of one channel of one record in every run; None where the run has it not."""

    record: str
    channel: str
    gaps: tuple[float | None, ...]

    @property
    def says(self) -> str:
        """What stands out: beyond the limit, or fitted differently; empty: nothing."""
        known = [gap for gap in self.gaps if gap is not None]
        if known and max(known) > MOST_CHANNEL_GAP:
            return f"beyond the limit of {MOST_CHANNEL_GAP:g}"
        if len(known) > 1 and max(known) - min(known) > APART:
            return "fitted differently"
        return ""


@dataclass(frozen=True)
class Difference:
    """One thing that is not the same in all runs: its sort, its name, its value in each run."""

    sort: str
    name: str
    values: tuple[str, ...]


def gap_rows(runs: Sequence[Run]) -> tuple[GapRow, ...]:
    """All channels of all records, in the order of the runs."""
    keys = dict.fromkeys(
        (record, channel)
        for run in runs
        for record, channels in run.gaps.items()
        for channel in channels
    )
    return tuple(
        GapRow(record, channel, tuple(run.gaps.get(record, {}).get(channel) for run in runs))
        for record, channel in keys
    )


def differences(runs: Sequence[Run]) -> tuple[Difference, ...]:
    """Everything that is not the same in all runs."""
    common = set.intersection(*(set(map(_whose, _records(run))) for run in runs))
    specs = [_flat(_told_once(run, common)) for run in runs]
    effects = [dict.fromkeys(run.effects, "yes") for run in runs]
    return (
        *(_rows("effect", effects, "no") if all(effects) else ()),
        *_rows("prior", [_of(flat, "priors.") for flat in specs]),
        *_rows("spec", [_rest(flat) for flat in specs]),
        *_rows("record", [{k: v[:12] for k, v in run.sha256.items()} for run in runs]),
        *_rows("seed", [{"seed": str(run.seed)} for run in runs if run.seed is not None]),
        *_rows("version", [run.versions for run in runs]),
    )


ABSENT = "not there"
NAMES = ("name", "cylinder")


def _rows(sort: str, tables: Sequence[Mapping[str, str]], absent: str = ABSENT) -> list[Difference]:
    names = dict.fromkeys(name for table in tables for name in table)
    rows = [Difference(sort, n, tuple(t.get(n, absent) for t in tables)) for n in names]
    return [row for row in rows if len(set(row.values)) > 1]


def _flat(values: Any, name: str = "") -> dict[str, str]:
    """Nested values by dotted name; entries of a list of records by their names."""
    if isinstance(values, Mapping):
        out: dict[str, str] = {}
        for key, value in values.items():
            out |= _flat(value, f"{name}.{key}" if name else str(key))
        return out
    if isinstance(values, list) and values and all(isinstance(v, Mapping) for v in values):
        out = {}
        for number, value in enumerate(values, start=1):
            told = ",".join(str(part) for part in _whose(value) if part) or str(number)
            out |= _flat(value, f"{name}[{told}]")
        return out
    return {name: json.dumps(values, ensure_ascii=False, default=str)}


def _records(run: Run) -> Sequence[Mapping[str, Any]]:
    return run.values.get("records", ())


def _whose(record: Mapping[str, Any]) -> tuple[Any, Any]:
    return record.get(NAMES[0]), record.get(NAMES[1])


def _told_once(run: Run, common: set[tuple[Any, Any]]) -> dict[str, Any]:
    """The spec of a run with nothing but the names of records that another run lacks."""
    records = [
        record if _whose(record) in common else {k: record[k] for k in NAMES if k in record}
        for record in _records(run)
    ]
    return {**run.values, "records": records}


def _of(flat: Mapping[str, str], start: str) -> dict[str, str]:
    return {k.removeprefix(start): v for k, v in flat.items() if k.startswith(start)}


def _rest(flat: Mapping[str, str]) -> dict[str, str]:
    """The spec without what has rows of its own."""
    told = ("priors.", "model.effects", "sampler.seed")
    return {k: v for k, v in flat.items() if not k.startswith(told)}


def others(runs: Sequence[Run]) -> tuple[str, ...]:
    """What other commands say in the runs' folders, a sentence each."""
    return tuple(
        f"{run.name}, {command}: {_told(command, found)}"
        for run in runs
        for command, found in run.others.items()
    )


def _told(command: str, found: Mapping[str, Any]) -> str:
    if command == "discover":
        steps = [step.get("effect") or "a cause without a name" for step in found.get("steps", [])]
        gap = found.get("gap") or {}
        ends = f"; gap {gap.get('initial')} at first, {gap.get('final')} at last" if gap else ""
        return f"verdict {found.get('verdict')}{': ' + ', '.join(steps) if steps else ''}{ends}"
    if command == "laws":
        laws = found.get("laws") or [{}]
        first = laws[0].get("words") or laws[0].get("law")
        return f"verdict {found.get('verdict')}; first is {first}"
    records = found.get("records") or {}
    return f"bands of {', '.join(map(str, records)) or 'no record'}"

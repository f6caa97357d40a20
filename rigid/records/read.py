"""From the records a spec names to checked, immutable records in SI."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path

import numpy as np

from rigid.io.errors import InputError, listed, quoted
from rigid.kinds import KINDS, kinds_with
from rigid.records import checks
from rigid.records.converter import without_ends
from rigid.records.defects import Defect, at_lines, causes, settle
from rigid.records.doubts import balanced, misnamed, off_record
from rigid.records.files import Source, load
from rigid.records.plausible import SHORTEST_STEP, beyond
from rigid.records.record import Channel, Record, grid, longest_step, usual_corner
from rigid.records.table import Table
from rigid.records.units import TIMESTAMP, to_si
from rigid.spec import ChannelSpec, RecordSpec, Spec

TIME = "time"
UNEVEN = "samples are not evenly spaced; they are interpolated onto a grid of {:.4g} s"
INVALIDATES = ("nan", "saturated")  # accepted, these make samples invalid


@dataclass(frozen=True, eq=False)
class Raw:
    """The samples of one record in SI, before the checks.

    - rows: (n,) lines of the file
    - columns: quantity -> (n,) SI, `time` included; names: quantity -> column in the file
    """

    rows: np.ndarray
    columns: Mapping[str, np.ndarray]
    names: Mapping[str, str]

    def only(self, keep: np.ndarray) -> "Raw":
        """Return the samples where `keep`, (n,) bool, is True."""
        kept = {quantity: values[keep] for quantity, values in self.columns.items()}
        return Raw(self.rows[keep], kept, self.names)


def read_records(spec: Spec, kinds: Collection[str] | None = None) -> tuple[Record, ...]:
    """Return the records of the spec that are fitted (`fit`), in its order.

    - kinds: return the records of these kinds instead, such as ("field",), fitted or not

    A file that several records name is read once. Samples that a sensor took at the end of its
    range are invalid; a frame whose load is far from S_Pl p has a note. Field records are read
    along with those that are fitted, and their problems are told: they would stop `rigid.bands`
    when the calibration has been made.

    Raises InputError with the problems of all files, one a line.
    """
    files: dict[Path, Source | InputError] = {}
    found, problems = [], []
    for record in spec.records:
        wanted = record.fit if kinds is None else record.kind in kinds
        if wanted or (kinds is None and record.kind in kinds_with("ice")):
            try:
                read = read_record(record, spec.sensors, files)
            except InputError as error:
                problems += str(error).splitlines()
                continue
            if wanted:
                found.append(read)
    if problems:
        raise InputError("\n".join(dict.fromkeys(problems)))
    area = spec.rig.S_Pl.value
    return tuple(balanced(r, area, spec.sensors) for r in without_ends(found, spec.sensors))


def read_record(
    spec: RecordSpec,
    sensors: checks.Sheets,
    files: dict[Path, Source | InputError] | None = None,
) -> Record:
    """Return one record: read, converted to SI and checked.

    - sensors: quantity -> its specification, whose range the samples are held against
    - files: what was read before; the file is added to it

    Raises InputError when the file cannot be understood or has defects that the spec does not
    accept, and EnvironmentFaultError when the system does not let it be read.
    """
    where = f"{spec.file}: record {quoted(spec.name)}"
    source = _load(spec.file, {} if files is None else files)
    raw, notes = _on_clock(spec, _convert(spec, source.table, where), where)
    time = raw.columns[TIME]
    interval, uniform = grid(time)
    corner = spec.corner or usual_corner(interval) if KINDS[spec.kind].filtered else None
    if corner is not None and not uniform:
        notes += (UNEVEN.format(interval),)
    stated = {q: source.table.units.get(name, "") for q, name in raw.names.items()}
    run = _as_checked(spec, raw, stated, corner)
    notes += (*misnamed(raw.names, run.units), *off_record(time, spec.valve))
    defects = causes((*checks.sampling(run), *checks.channels(run, sensors)), spec.accept)
    notes += settle(where, defects, spec.accept)
    return Record(
        name=spec.name,
        kind=spec.kind,
        cylinder=spec.cylinder,
        path=spec.file,
        sha256=source.sha256,
        time=time,
        channels=_channels(raw, run.units, defects),
        valve=spec.valve,
        preload=spec.preload,
        release_time=spec.release_time,
        interval=interval,
        uniform=uniform,
        notes=(*source.table.notes, *notes),
        corner=corner,
        moving=spec.start == "moving",
    )


def reread(
    record: Record,
    values: Mapping[str, np.ndarray],
    spec: RecordSpec,
    sensors: checks.Sheets,
) -> Record:
    """Return a record with other readings, judged as those of a file; what was not read stays so.

    - `values`: by quantity, (n,) in SI; channels that are left out stay as they are.

    Raises InputError when they have defects that the spec does not accept.
    """
    raw = Raw(np.arange(1, len(record.time) + 1), {TIME: record.time, **values}, {})
    run = _as_checked(spec, raw, {}, record.corner)
    defects = causes(checks.channels(run, sensors), spec.accept)
    notes = settle(f"{record.path}: record {record.name!r}", defects, spec.accept)
    channels = dict(record.channels)
    for quantity, channel in channels.items():
        if quantity in values:
            valid = channel.valid & _usable(quantity, len(record.time), defects)
            channels[quantity] = replace(channel, values=values[quantity], valid=valid)
    return replace(record, channels=channels, notes=notes)


def _as_checked(
    spec: RecordSpec, raw: Raw, stated: Mapping[str, str], corner: float | None
) -> checks.CheckInput:
    """Return the record as the checks see it.

    - stated: unit that the file itself gives, by quantity. - corner: of a motion, in Hz
    """
    stretch, open_valve = checks.stretches(raw.columns[TIME], spec.valve)
    return checks.CheckInput(
        kind=KINDS[spec.kind],
        time=raw.columns[TIME],
        rows=raw.rows,
        values={quantity: v for quantity, v in raw.columns.items() if quantity != TIME},
        units={quantity: channel.unit for quantity, channel in spec.channels.items()},
        stated=stated,
        stretch=stretch,
        open_valve=open_valve,
        longest_step=None if corner is None else longest_step(corner),
    )


def _load(path: Path, files: dict[Path, Source | InputError]) -> Source:
    """Return the file, read only once; a file that failed fails again in the same words."""
    if path not in files:
        try:
            files[path] = load(path)
        except InputError as error:
            files[path] = error
    source = files[path]
    if isinstance(source, InputError):
        raise source
    return source


def _convert(spec: RecordSpec, table: Table, where: str) -> Raw:
    """Return the record's columns in SI, over the rows the spec names."""
    columns, names, problems = {}, {}, []
    for quantity, channel in spec.channels.items():
        there = f"{where}, {quantity}"
        try:
            names[quantity] = _column(table, channel, there)
            columns[quantity] = _si(table, names[quantity], quantity, channel, there)
        except InputError as error:
            problems.append(str(error))
    if problems:
        raise InputError("\n".join(problems))
    raw = Raw(table.rows, columns, names)
    if spec.rows is not None:
        first, last = spec.rows
        raw = raw.only((table.rows >= first) & (table.rows <= last))
        if len(raw.rows) == 0:
            raise InputError(
                f"{where}: rows {first} to {last} hold no samples; the file's samples stand in "
                f"lines {table.rows[0]} to {table.rows[-1]}"
            )
    for quantity, column in raw.columns.items():
        if not np.isfinite(column).any():
            raise InputError(
                f"{where}, {quantity}: column {quoted(names[quantity])} holds no number at all; "
                "name another column or leave the channel out"
            )
    return raw


def _column(table: Table, channel: ChannelSpec, where: str) -> str:
    """Return the name of the channel's column; raises InputError when the file has none such."""
    names = list(table.columns)
    if isinstance(channel.column, int) and 1 <= channel.column <= len(names):
        return names[channel.column - 1]
    wanted = str(channel.column)
    if isinstance(channel.column, str) and wanted in table.columns:
        return wanted
    folded = {name.lower(): name for name in names}
    near = get_close_matches(wanted.lower(), folded, n=1, cutoff=0.5)
    hint = f"did you mean {quoted(folded[near[0]])}? " if near else ""
    raise InputError(
        f"{where}: the file has no column {quoted(channel.column)}; {hint}it has {listed(names)}"
    )


def _si(table: Table, name: str, quantity: str, channel: ChannelSpec, where: str) -> np.ndarray:
    """Return one column in SI, (n,): recorded x factor + offset, NaN where nothing is."""
    if name in table.refused:
        raise InputError(
            f"{where}: column {quoted(name)} is not all numbers: {table.refused[name]}; "
            "correct the cell or name another column"
        )
    stamped = name in table.timestamps
    if stamped != (channel.unit == TIMESTAMP):
        what = "time stamps" if stamped else "numbers, no time stamps"
        todo = f"set unit = {TIMESTAMP!r}" if stamped else "give the unit of the numbers"
        if stamped and quantity != TIME:
            todo = "name another column"
        raise InputError(f"{where}: column {quoted(name)} holds {what}; {todo}")
    factor = to_si(quantity, channel.unit, channel.scale, where)
    recorded = table.columns[name]
    bad = np.flatnonzero(beyond(recorded, factor))
    if len(bad):
        raise InputError(
            f"{where}: {at_lines(table.rows, bad)}: {recorded[bad[0]]:.4g} {channel.unit} is "
            "beyond any reading; the file was damaged or the column is another, repair the lines"
        )
    return np.where(np.isfinite(recorded), recorded * factor + channel.offset, np.nan)


def _on_clock(spec: RecordSpec, raw: Raw, where: str) -> tuple[Raw, tuple[str, ...]]:
    """Return the samples whose time increases, and notes of the accepted defects."""
    defects = list(checks.clock(raw.columns[TIME], raw.rows))
    notes = settle(where, defects, spec.accept)
    for defect in defects:
        notes += (f"{int(defect.samples.sum())} samples without increasing time were dropped",)
    drop = np.zeros(len(raw.rows), dtype=bool)
    for defect in defects:
        drop |= defect.samples
    kept = raw.only(~drop)
    if len(kept.rows) < 2:
        raise InputError(
            f"{where}: {len(kept.rows)} samples, too few for a record; record for longer"
        )
    usual = float(np.median(np.diff(kept.columns[TIME])))
    if usual < SHORTEST_STEP:
        raise InputError(
            f"{where}: the time usually steps by {usual:.3g} s, which no recorder does; "
            "check the unit and the column of the time"
        )
    return kept, notes


def _channels(raw: Raw, units: Mapping[str, str], defects: list[Defect]) -> dict[str, Channel]:
    """Return the channels, samples with an accepted defect invalid."""
    made = {}
    for quantity, values in raw.columns.items():
        if quantity == TIME:
            continue
        valid = _usable(quantity, len(values), defects)
        made[quantity] = Channel(quantity, values, valid, raw.names[quantity], units[quantity])
    return made


def _usable(quantity: str, samples: int, defects: list[Defect]) -> np.ndarray:
    """Which samples (n,) of a channel no accepted defect forbids."""
    valid = np.ones(samples, dtype=bool)
    for defect in defects:
        if defect.quantity == quantity and defect.name in INVALIDATES:
            valid &= ~defect.samples
    return valid

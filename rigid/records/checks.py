"""What can be wrong with a record's clock and channels."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.stats import norm

from rigid.io.errors import quoted
from rigid.kinds import RecordKind
from rigid.kinds.base import SLOW_CHANNELS
from rigid.records.defects import Defect, at_lines, runs
from rigid.records.plausible import implausible, implausible_interval
from rigid.records.units import DIMENSIONS, SI_NAMES, contradiction
from rigid.spec import SensorSpec, Stretch

FEWEST = 20  # samples
GAP = 1.5  # sampling intervals
SATURATED_RUN = 3  # samples
BEYOND = 0.01  # of the end of a range: a reading farther out tells of another unit
AROUND = 25  # samples to each side that tell what a reading would be without its noise
BY_CHANCE = 0.01  # of a record: how often noise alone may make a run at an end that counts
STUCK_FOR = 2.0  # s
JUMP = 5.0  # a sensor that thaws jumps by so many steps, and times its usual change
COUPLED = 100.0  # steps that pressure may move while load stands still, or load while pressure does
FLICKER_RUN = 200  # samples in which the noise of a healthy sensor changes the reading
FLICKER_NOISE = 0.2  # of a step, for that to hold


@runtime_checkable
class Sheets(Protocol):
    """The specification of each quantity's sensor: a mapping, or the sensors of a spec."""

    def __getitem__(self, quantity: str, /) -> SensorSpec:
        """Return the specification of the sensor of `quantity`."""
        ...


@dataclass(frozen=True, eq=False)
class CheckInput:
    """A record as the checks see it.

    - kind: what was done; time: s, increasing; rows: lines of the file
    - values: quantity -> SI; units: quantity -> unit in the spec, `time` included
    - stated: quantity -> known unit that the file itself gives, where it gives one
    - stretch: number of the stretch of the valve; open_valve: whether it is open
    - longest_step: s, beyond which a step of the clock is a gap; None: GAP sampling intervals
    """

    kind: type[RecordKind]
    time: Float[np.ndarray, " n"]
    rows: Int[np.ndarray, " n"]
    values: Mapping[str, Float[np.ndarray, " n"]]
    units: Mapping[str, str]
    stated: Mapping[str, str]
    stretch: Int[np.ndarray, " n"]
    open_valve: Bool[np.ndarray, " n"]
    longest_step: float | None = None


def stretches(time: np.ndarray, valve: tuple[Stretch, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return for each time the number of its stretch and whether the valve is open.

    - time: (n,) s
    - valve: the stretches in order; none means open throughout, and the last one lasts
    """
    if not valve:
        return np.zeros(len(time), dtype=np.int64), np.ones(len(time), dtype=np.bool_)
    ends = np.array([s.until for s in valve])
    number = np.minimum(np.searchsorted(ends, time, side="right"), len(valve) - 1)
    is_open = np.array([s.position == "open" for s in valve])
    return number, is_open[number]


def clock(time: np.ndarray, rows: np.ndarray) -> Iterator[Defect]:
    """Yield the defects that keep `time`, (n,) s, from increasing: `nan`, `time-not-increasing`.

    The samples they concern are dropped when they are accepted.
    """
    lost = ~np.isfinite(time)
    if lost.any():
        says = f"no time in {at_lines(rows, np.flatnonzero(lost))}; remove the lines"
        yield Defect("nan", "time", says, lost)
    known = np.where(lost, -np.inf, time)
    before = np.concatenate([[-np.inf], np.maximum.accumulate(known)[:-1]])
    back = ~lost & (time <= before)
    if back.any():
        k = int(np.argmax(back))
        says = (
            f"{at_lines(rows, np.flatnonzero(back))}: the time does not increase, {time[k]:.6g} s "
            f"after {before[k]:.6g} s; remove repeated or mixed rows, or choose rows of one run"
        )
        yield Defect("time-not-increasing", "time", says, back)


def sampling(run: CheckInput) -> Iterator[Defect]:
    """Yield the defects of an increasing clock: `too-short`, `unit`, `gap`."""
    time, rows, unit = run.time, run.rows, run.units["time"]
    everywhere = np.ones(len(time), dtype=bool)
    if len(time) < FEWEST:
        says = f"{len(time)} samples where at least {FEWEST} are needed; record for longer"
        yield Defect("too-short", "time", says, everywhere)
    if len(time) < 2:
        return
    steps = np.diff(time)
    interval = float(np.median(steps))
    says = contradiction(run.stated.get("time", ""), unit) or implausible_interval(interval, unit)
    if says:
        yield Defect("unit", "time", says, everywhere)
    longest = GAP * interval if run.longest_step is None else run.longest_step
    wide = np.concatenate([[False], steps > longest])
    if wide.any():
        k = int(np.argmax(wide))
        says = (
            f"{at_lines(rows, np.flatnonzero(wide))}: samples are missing, the time steps by "
            f"{steps[k - 1]:.4g} s where {interval:.4g} s is usual; record again or cut the record"
        )
        yield Defect("gap", "time", says, wide)


def channels(run: CheckInput, sensors: Sheets) -> Iterator[Defect]:
    """Yield the defects of all channels: `nan`, `saturated`, `unit`, `stuck`."""
    for quantity in run.values:
        yield from lost(run, quantity)
        yield from unit(run, quantity, sensors[quantity])
        yield from saturated(run, quantity, sensors[quantity])
        yield from list(dead(run, quantity, sensors[quantity])) or frozen(run, quantity, sensors)


def lost(run: CheckInput, quantity: str) -> Iterator[Defect]:
    """Yield the defect of samples without a number."""
    bad = ~np.isfinite(run.values[quantity])
    if bad.any():
        where = at_lines(run.rows, np.flatnonzero(bad))
        says = f"{where}: no number was recorded; look at the sensor and its cable"
        yield Defect("nan", quantity, says, bad)


def unit(run: CheckInput, quantity: str, sensor: SensorSpec) -> Iterator[Defect]:
    """Yield the defect of a unit that the file contradicts, or that makes values implausible."""
    values, given = run.values[quantity], run.units[quantity]
    says = contradiction(run.stated.get(quantity, ""), given)
    if not says and (doubt := implausible(run.kind, quantity, values, given, sensor)):
        says = f"line {run.rows[int(np.nanargmax(np.abs(values)))]}: {doubt}"
    if says:
        yield Defect("unit", quantity, says, np.ones(len(values), dtype=bool))


def saturated(run: CheckInput, quantity: str, sensor: SensorSpec) -> Iterator[Defect]:
    """Yield the defect of successive samples at the end of the sensor's range.

    A lower end of zero or more is no rail: gauges and strokes rest there. Nor do runs count that
    the noise of a reading near the end makes by chance.
    """
    values = run.values[quantity]
    low, high = sensor.range
    bad = np.zeros(len(values), dtype=bool)
    at_high = values >= high - 1e-9 * abs(high) if np.isfinite(high) else bad
    at_low = values <= low + 1e-9 * abs(low) if np.isfinite(low) and low < 0 else bad
    for at_rail, end in ((at_high, high), (at_low, low)):
        for first, last in zip(*runs(at_rail), strict=True):
            if last - first + 1 >= _fewest_at_end(values, slice(first, last + 1), end, sensor):
                bad[first : last + 1] = True
    if not bad.any():
        return
    firsts, lasts = runs(bad)
    k, count = int(firsts[0]), int(bad.sum())
    where = f"lines {run.rows[k]} to {run.rows[lasts[0]]}, {count} samples in all"
    yield Defect("saturated", quantity, f"{where}: {_at_end(run, quantity, k, sensor)}", bad)


def _at_end(run: CheckInput, quantity: str, k: int, sensor: SensorSpec) -> str:
    """Say what sample k at an end of the range tells: of the sensor, or of unit and range."""
    values, si = run.values[quantity], SI_NAMES[DIMENSIONS[quantity]]
    end = min(sensor.range, key=lambda one: abs(values[k] - one))
    farthest = float(np.nanmax(values) if end == sensor.range[1] else np.nanmin(values))
    if abs(farthest - end) <= max(sensor.step, BEYOND * abs(end)):
        return f"the sensor is at the end of its range, {end:.4g} {si}; use one of wider range"
    return (
        f"readings go to {farthest:.4g} {si}, beyond the end of the sensor's range, {end:.4g} "
        f"{si}; correct the unit {quoted(run.units[quantity])}, or `range` in [sensors]"
    )


def _fewest_at_end(values: np.ndarray, stretch: slice, end: float, sensor: SensorSpec) -> float:
    """Successive samples at an end that tell it from the noise of readings like those around."""
    first, after = stretch.start, stretch.stop
    around = np.r_[values[max(first - AROUND, 0) : first], values[after : after + AROUND]]
    around = around[np.isfinite(around)]
    if len(around) == 0 or sensor.noise == 0.0:
        return float(SATURATED_RUN)
    away = abs(end - float(np.median(around))) - 0.5 * sensor.step
    reached = float(norm.sf(away / sensor.noise))
    rare = np.log(BY_CHANCE / len(values)) / np.log(reached) if reached > 0.0 else 0.0
    return max(float(SATURATED_RUN), float(rare))


def dead(run: CheckInput, quantity: str, sensor: SensorSpec) -> Iterator[Defect]:
    """Yield the defect of a channel that never changes, where it would if it were alive."""
    values = run.values[quantity]
    real = values[np.isfinite(values)]
    if len(real) < 2 or np.any(real != real[0]):
        return
    flickers = (sensor is None or sensor.noise >= FLICKER_NOISE * sensor.step) and len(
        real
    ) >= FLICKER_RUN
    if flickers or quantity in run.kind.must_move:
        says = (
            f"lines {run.rows[0]} to {run.rows[-1]}: every sample reads {real[0]:.6g}; "
            "look at the sensor, or leave the channel out"
        )
        yield Defect("stuck", quantity, says, np.ones(len(values), dtype=bool))


def frozen(run: CheckInput, quantity: str, sensors: Sheets) -> Iterator[Defect]:
    """Yield the defect of a channel that stands still for long while it should move.

    Only with the valve open, and only where it then jumps far more than it usually changes, or,
    in a frame, where pressure moves far while load stands still or the other way round. At rest
    and in a hold a coarse converter repeats itself, and so it may.
    """
    values = run.values[quantity]
    watched = run.kind.of_the_rig() and quantity in SLOW_CHANNELS
    if not watched or len(values) < 2:
        return
    change = np.diff(values)
    still = (change == 0) & run.open_valve[1:] & (np.diff(run.stretch) == 0)
    bad = np.zeros(len(values), dtype=bool)
    for first, end in zip(*runs(still), strict=True):
        last = int(end) + 1
        if run.time[last] - run.time[first] > STUCK_FOR and (
            thaws(run, quantity, last, resolution(sensors, quantity))
            or left_behind(run, quantity, slice(first, last + 1), sensors)
        ):
            bad[first : last + 1] = True
    if bad.any():
        firsts, lasts = runs(bad)
        first, last = firsts[0], lasts[0]
        says = (
            f"lines {run.rows[first]} to {run.rows[last]}: reads {values[first]:.6g} for "
            f"{run.time[last] - run.time[first]:.3g} s with the valve open while it should move; "
            "look at the sensor and its cable"
        )
        yield Defect("stuck", quantity, says, bad)


def thaws(run: CheckInput, quantity: str, last: int, step: float) -> bool:
    """Whether the channel jumps as never else just after position `last`."""
    change = np.abs(np.diff(run.values[quantity]))
    if last >= len(change) or run.stretch[last + 1] != run.stretch[last]:
        return False
    others = np.delete(change, last)
    others = others[others > 0]
    if len(others) == 0:
        return False
    return bool(change[last] > JUMP * max(step, float(np.percentile(others, 99))))


def left_behind(run: CheckInput, quantity: str, when: slice, sensors: Sheets) -> bool:
    """Whether pressure moved far in a frame while load stood still, or the other way round."""
    other = {"load": "pressure", "pressure": "load"}.get(quantity)
    if run.kind.contact != "frame" or other is None or other not in run.values:
        return False
    seen = run.values[other][when]
    seen = seen[np.isfinite(seen)]
    return bool(len(seen) and np.ptp(seen) > COUPLED * resolution(sensors, other))


def resolution(sensors: Sheets, quantity: str) -> float:
    """Return the larger of a sensor's step and noise, in SI."""
    sensor = sensors[quantity]
    return max(sensor.step, sensor.noise)

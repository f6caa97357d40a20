"""What a converter did to the readings of a sensor: the step it took, and the end it came to.

A sensor that sits at the end of its range repeats its greatest reading. No sheet need say where
that end is: a reading that stands still elsewhere flickers between codes, one at the end does not.
"""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from scipy.special import erf

from rigid.kinds import KINDS
from rigid.records.checks import SATURATED_RUN, Sheets
from rigid.records.defects import runs
from rigid.records.record import Channel, Record
from rigid.spec import SensorSpec

COARSEST = 16
"""Most stated steps that a converter is believed to have taken as one."""

RARE = 0.2
"""A run at the greatest reading tells the end of a range where a reading that stands still in the
middle of a code makes one so long less often than this."""

FLICKER = 5
"""Readings at the end that lie no more than so many samples apart are one stretch: whether a sample
between them counts must not depend on its own noise."""

ZEROS = 3.0
"""A least reading is the end of a range, and no rest, where it lies so many zero sds below 0."""


def coarseness(values: Iterable[np.ndarray], step: float) -> int:
    """How many stated steps every change of a reading is a multiple of; 1 where it says nothing.

    - `values`: (n,) each, of one quantity in several records. - `step`: as stated.
    """
    if step == 0.0:
        return 1
    common = 0
    for one in values:
        codes = np.round(one / step).astype(np.int64)
        common = int(np.gcd.reduce(np.append(np.diff(codes), common)))
    return common if 1 < common <= COARSEST else 1


def without_ends(records: Sequence[Record], sensors: Sheets) -> tuple[Record, ...]:
    """Return the records without the samples that their sensors took at the end of a range.

    Such a sample says no more than that the reading lay beyond; it becomes invalid, and a note of
    the record says so. A sensor is a quantity on a cylinder; its ends are those of all records.
    """
    groups: dict[tuple[str, str], list[int]] = {}
    for number, record in enumerate(records):
        for quantity in record.channels:
            if not KINDS[record.kind].filtered:
                groups.setdefault((quantity, record.cylinder), []).append(number)
    found = list(records)
    for (quantity, _), members in groups.items():
        channels = [records[i].channels[quantity] for i in members]
        for i, (stuck, end) in zip(members, ends(channels, sensors[quantity]), strict=True):
            if stuck.any():
                found[i] = _without(found[i], quantity, stuck, end)
    return tuple(found)


def ends(channels: Sequence[Channel], sensor: SensorSpec) -> list[tuple[np.ndarray, float]]:
    """Where the channels of one sensor stand at the end of its range, (n,) bool each, and the end.

    - `sensor`: its sheet, for step and noise.
    """
    read = [channel.values[channel.valid] for channel in channels]
    step = sensor.step * coarseness(read, sensor.step)
    longest = longest_run(sensor.noise, step)
    high = max((float(one.max()) for one in read if len(one)), default=np.inf)
    low = min((float(one.min()) for one in read if len(one)), default=-np.inf)
    reach = 0.5 * step if step > 0.0 else 1e-9 * max(abs(high), abs(low))
    out = []
    for channel in channels:
        at_high = _stretches(channel.valid & (channel.values >= high - reach), longest)
        at_low = np.zeros(len(at_high), dtype=bool)
        if low < -ZEROS * sensor.zero_sd:
            at_low = _stretches(channel.valid & (channel.values <= low + reach), longest)
        out.append((at_high | at_low, high if at_high.any() else low))
    return out


def longest_run(noise: float, step: float) -> float:
    """Fewest equal readings in a row that tell the end of a range.

    In the middle of a code a reading stays there with probability erf(step / (sqrt(8) noise)),
    anywhere else with less. Infinite where there is no noise that would tell.
    """
    if noise == 0.0:
        return np.inf
    stays = float(erf(step / (np.sqrt(8.0) * noise)))
    if stays == 1.0:
        return np.inf
    return max(2.0 * SATURATED_RUN, np.log(RARE) / np.log(stays) if stays > 0.0 else 0.0)


def _stretches(at_end: np.ndarray, longest: float) -> np.ndarray:
    """Where readings stand at an end (n,): long runs, what flickers beside them, one to each side.

    - `at_end` (n,): which readings are the end's.
    """
    out = np.zeros(len(at_end), dtype=bool)
    bridged = np.convolve(at_end, np.ones(FLICKER), "same") > 0
    firsts, lasts = runs(at_end)
    long = [(a, b) for a, b in zip(firsts, lasts, strict=True) if b - a + 1 >= longest]
    for first, last in zip(*runs(bridged), strict=True):
        if any(first <= a <= last for a, _ in long):
            here = np.flatnonzero(at_end[first : last + 1]) + first
            out[max(here[0] - 1, 0) : here[-1] + 2] = True
    return out


def _without(record: Record, quantity: str, stuck: np.ndarray, end: float) -> Record:
    """Return a record whose samples at the end of a range are invalid."""
    channel = record.channels[quantity]
    times = record.time[stuck]
    note = (
        f"{quantity}: {int(stuck.sum())} samples from {times[0]:.2f} to {times[-1]:.2f} s are not "
        f"used: the reading stands at {end:.5g} (SI) and never passes it, as at the end of the "
        "sensor's range"
    )
    changed: Mapping[str, Channel] = {
        **record.channels,
        quantity: dataclasses.replace(channel, valid=channel.valid & ~stuck),
    }
    return dataclasses.replace(record, channels=changed, notes=(*record.notes, note))

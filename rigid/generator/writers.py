"""Files in the formats of the two recorders, and the truth."""

import json
from collections.abc import Sequence
from datetime import datetime, timedelta
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from rigid.generator.constants import COUNT, FAST_RATE, FILE_UNITS, SLOW_RATE
from rigid.generator.draw import Truth

STATION = '"TOA5","SimulatedRig","CR6","2611","CR6.Std.07.02","CPU:Rig.CR6","41873","Calibration"'
LABELS = {"load": "Load", "stroke": "Stroke", "pressure": "Press"}


def column(channel: str, cylinder: str) -> str:
    """Name of a column of the logger's table, e.g. Press_A."""
    return f"{LABELS[channel]}_{cylinder}"


def write_toa5(
    path: Path,
    codes: dict[tuple[str, str], np.ndarray],
    steps: dict[tuple[str, str], float],
    start: datetime,
    first_record: int,
) -> int:
    """Write one table of the CR6; gives the number of the record after the last.

    - codes: converter codes by (channel, cylinder); steps: what one is worth, SI
    - start: the logger's clock at the first row
    """
    units = [FILE_UNITS[channel] for channel, _ in codes]
    header = [
        STATION,
        _quoted(["TIMESTAMP", "RECORD", *(column(*key) for key in codes)]),
        _quoted(["TS", "RN", *(name for name, _, _ in units)]),
        _quoted(["", "", *("Smp" for _ in units)]),
    ]
    rows = np.column_stack([steps[key] * values for key, values in codes.items()])
    rows /= [scale for _, scale, _ in units]
    decimals = [places for _, _, places in units]
    number = count(first_record)
    lines = [
        ",".join([_timestamp(start, i), str(next(number)), *_printed(row, decimals)])
        for i, row in enumerate(rows.tolist())
    ]
    _write(path, header + lines)
    return next(number)


def _printed(row: list[float], decimals: list[int]) -> list[str]:
    return [f"{value + 0.0:.{places}f}" for value, places in zip(row, decimals, strict=True)]


def _timestamp(start: datetime, row: int) -> str:
    """Stamp of a row in quotes; a CR6 drops the trailing zeros of the fraction."""
    stamp = start + timedelta(microseconds=row * 1_000_000 // SLOW_RATE)
    fraction = f"{stamp.microsecond:06d}".rstrip("0")
    return f'"{stamp:%Y-%m-%d %H:%M:%S}{"." if fraction else ""}{fraction}"'


def _quoted(names: Sequence[str]) -> str:
    return ",".join(f'"{name}"' for name in names)


def write_accelerometer(path: Path, counts: np.ndarray, start: datetime, delay: float) -> None:
    """Write one recording of the accelerometer.

    - counts: (3, samples), the axes Ax, Ay, Az
    - start: the accelerometer's own clock as it wakes
    - delay: from there to the first sample [s], where its time column begins
    """
    preamble = [
        ";Title, simulated by rigid.generator, triaxial recorder +-200 g 16 bit",
        f";Start_time, {start:%Y-%m-%d}, {start:%H:%M:%S}.{start.microsecond // 1000:03d}",
        f";Range, 200, g,  Scale, {COUNT:.12g}, m/s^2 per count",
        f";SampleRate, {FAST_RATE},Hz",
        ";Deadband, 0, counts",
        ";DeadbandTimeout, 0,sec",
        ";Headers, time,Ax,Ay,Az",
    ]
    lines = [
        f"{delay + i / FAST_RATE:.6f},{ax},{ay},{az}"
        for i, (ax, ay, az) in enumerate(counts.T.tolist())
    ]
    _write(path, preamble + lines)


def write_truth(folder: Path, truth: Truth) -> None:
    """Write truth.json, which no spec names."""
    _write(folder / "truth.json", [json.dumps(truth.as_dict(), indent=1, allow_nan=False)])


def write_field_truth(path: Path, arrays: dict[str, Any]) -> None:
    """Write what bands are judged by: the true ice load and displacement of the plate."""
    np.savez_compressed(path, **arrays)


def _write(path: Path, lines: list[str]) -> None:
    path.write_text("\n".join(lines) + "\n", encoding="ascii", newline="\n")

"""A whole campaign: draw it, run it, record it, write it."""

from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from itertools import groupby
from pathlib import Path

import numpy as np

from rigid.generator.constants import TRUTH_RATE
from rigid.generator.draw import Truth, draw, stream
from rigid.generator.plant import Piece, trajectory
from rigid.generator.schedule import Run
from rigid.generator.sensors import unit_noise
from rigid.generator.simulate import plant_of, simulate
from rigid.generator.specs import file_name, write_specs
from rigid.generator.writers import (
    write_accelerometer,
    write_field_truth,
    write_toa5,
    write_truth,
)

MORNING = datetime(2018, 3, 12, 9, 30)  # the paper's field test was in March 2018
SLOW_CHANNELS = ("load", "stroke", "pressure")


@dataclass(frozen=True)
class Conditions:
    """What may differ from campaign to campaign of a study.

    - noise_correlation: AR(1) coefficient of the slow channels' noise, in [0, 1)
    - hidden: pieces of physics to hide in every record, named in the truth alone
    - clock: a seed for lengths and valve times alone, so that many campaigns share them
    """

    noise_correlation: float = 0.0
    hidden: tuple[Piece, ...] = ()
    clock: int | None = None


NOMINAL = Conditions()


def campaign(
    seed: int,
    out: Path,
    *,
    specs: Path | None = None,
    field: bool = True,
    conditions: Conditions = NOMINAL,
) -> Truth:
    """Write a campaign's records, specs and truth into a folder; gives the truth.

    - seed: the same seed gives the same bytes
    - out: folder of the records and of truth.json, made where it is missing
    - specs: folder of the specs; left out: `out`
    - field: whether the field record (and its true ice load) is written
    - conditions: what differs from the population's usual campaign
    """
    correlation, hidden = conditions.noise_correlation, conditions.hidden
    if not 0.0 <= correlation < 1.0:
        raise ValueError(f"noise_correlation is {correlation}; it has to lie in [0, 1)")
    truth = draw(seed, field=field, noise_correlation=correlation, clock=conditions.clock)
    truth = replace(truth, hidden=tuple(type(piece).__name__ for piece in hidden))
    specs = out if specs is None else specs
    for folder in (out, specs):
        folder.mkdir(parents=True, exist_ok=True)
    _write_records(truth, out, hidden)
    write_specs(specs, out, truth)
    write_truth(out, truth)
    return truth


def _write_records(truth: Truth, out: Path, hidden: tuple[Piece, ...]) -> None:
    """Write every record; the logger's count of rows runs on from one to the next."""
    row = int(stream(truth.seed, "logger").integers(1_000, 100_000))
    for hour, (name, group) in enumerate(groupby(truth.runs, key=lambda run: run.name)):
        runs = list(group)
        path, begin = out / file_name(runs[0]), MORNING + timedelta(minutes=25 * hour)
        rng = stream(truth.seed, "clock", name)
        begin += timedelta(milliseconds=10 * int(rng.integers(60_000)))
        if runs[0].kind == "release":
            _write_release(truth, runs[0], path, begin, hidden)
            continue
        codes = {key: c for run in runs for key, c in slow_codes(truth, run, hidden).items()}
        row = write_toa5(path, codes, begin, row)
        if runs[0].kind == "field":
            write_field_truth(out / f"truth-{name}.npz", field_truth(truth, runs, hidden))


def slow_codes(
    truth: Truth, run: Run, hidden: tuple[Piece, ...] = ()
) -> dict[tuple[str, str], np.ndarray]:
    """Converter codes of the three slow channels, by (channel, cylinder)."""
    times, values = simulate(truth, run, hidden)
    codes = {}
    for channel in SLOW_CHANNELS:
        rng = stream(truth.seed, "noise", run.name, run.cylinder, channel)
        noise = unit_noise(rng, times.size, truth.noise_correlation)
        sensor = truth.sensors[f"{channel},{run.cylinder}"]
        codes[channel, run.cylinder] = sensor.codes(values[channel], noise)
    return codes


def release_counts(truth: Truth, run: Run, hidden: tuple[Piece, ...] = ()) -> np.ndarray:
    """Counts of the accelerometer's three axes, (3, samples); the other two only hiss."""
    times, values = simulate(truth, run, hidden)
    rng = stream(truth.seed, "noise", run.name, run.cylinder, "acceleration")
    sensor = truth.sensors[f"acceleration,{run.cylinder}"]
    noise = rng.standard_normal((3, times.size))
    still = np.zeros(times.size)
    return np.stack(
        [
            sensor.codes(signal, part)
            for signal, part in zip((still, still, values["acceleration"]), noise, strict=True)
        ]
    )


def _write_release(
    truth: Truth, run: Run, path: Path, begin: datetime, hidden: tuple[Piece, ...]
) -> None:
    """The accelerometer's own clock is off by minutes."""
    rng = stream(truth.seed, "accelerometer-clock", run.name)
    start = begin + timedelta(milliseconds=int(rng.integers(-180_000, 180_000)))
    write_accelerometer(path, release_counts(truth, run, hidden), start, run.file_start)


def field_truth(
    truth: Truth, runs: list[Run], hidden: tuple[Piece, ...] = ()
) -> dict[str, np.ndarray]:
    """True compressive ice load [N] and plate displacement [m] at 1 kHz, by cylinder."""
    arrays = {"rate_Hz": np.array(TRUTH_RATE)}
    for run in runs:
        plant = plant_of(truth, run, hidden)
        times = np.arange(round(run.duration * TRUTH_RATE) + 1) / TRUTH_RATE
        motion = trajectory(plant, plant.at_rest(), times)
        arrays[f"ice_load_{run.cylinder}"] = run.ice_load(times).astype(np.float32)
        arrays[f"plate_displacement_{run.cylinder}"] = motion.states[2].astype(np.float32)
    return arrays

"""A whole campaign: draw it, run it, record it, write it."""

from dataclasses import replace
from datetime import datetime, timedelta
from itertools import groupby
from pathlib import Path

import numpy as np

from rigid.generator.conditions import NOMINAL, Conditions, under
from rigid.generator.constants import TRUTH_RATE
from rigid.generator.core import Piece, Run
from rigid.generator.draw import Secret, Truth, draw, stream
from rigid.generator.plant import TOLERANCE, trajectory
from rigid.generator.sensors import spikes, unit_noise
from rigid.generator.simulate import Readings, acting, plant_of, simulate
from rigid.generator.specs import file_name, write_specs
from rigid.generator.writers import write_accelerometer, write_field_truth, write_toa5, write_truth

MORNING = datetime(2018, 3, 12, 9, 30)  # the paper's field test was in March 2018
SLOW_CHANNELS = ("load", "stroke", "pressure")


def campaign(
    seed: int,
    out: Path,
    *,
    specs: Path | None = None,
    field: bool = True,
    conditions: Conditions = NOMINAL,
    secrets: tuple[Secret, ...] | None = None,
) -> Truth:
    """Write a campaign's records, specs and truth into a folder; gives the truth.

    - seed: the same seed gives the same bytes
    - out: folder of the records and of truth.json, made where it is missing
    - specs: folder of the specs; left out: `out`
    - field: whether the field record (and its true ice load) is written
    - conditions: what differs from the population's usual campaign
    - secrets: what truth.json says of what is hidden; left out, it follows from the conditions
    """
    truth = drawn(seed, conditions, field=field)
    if secrets is not None:
        truth = replace(truth, hidden=secrets)
    specs = out if specs is None else specs
    for folder in (out, specs):
        folder.mkdir(parents=True, exist_ok=True)
    _write_records(truth, out, conditions.hidden)
    write_specs(specs, out, truth)
    write_truth(out, truth)
    return truth


def drawn(seed: int, conditions: Conditions = NOMINAL, *, field: bool = True) -> Truth:
    """Draw the truth of a campaign under conditions, without writing it."""
    truth = draw(
        seed,
        field=field,
        noise_correlation=conditions.noise_correlation,
        clock=conditions.clock,
        wide_friction=conditions.wide_friction,
    )
    return under(truth, conditions)


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
        steps = {key: truth.sensors[f"{key[0]},{key[1]}"].step for key in codes}
        row = write_toa5(path, codes, steps, begin, row)
        if runs[0].kind == "field":
            write_field_truth(out / f"truth-{name}.npz", field_truth(truth, runs, hidden))


def slow_codes(
    truth: Truth, run: Run, hidden: tuple[Piece, ...] = ()
) -> dict[tuple[str, str], np.ndarray]:
    """Converter codes of the three slow channels, by (channel, cylinder)."""
    times, values = _perfect(truth, run, hidden)
    codes = {}
    for channel in SLOW_CHANNELS:
        name = f"{channel},{run.cylinder}"
        rng = stream(truth.seed, "noise", run.name, run.cylinder, channel)
        noise = unit_noise(rng, times.size, truth.noise_correlation)
        noise = noise + _spikes(truth, run, channel, times.size)
        sensor, top = truth.sensors[name], truth.flaws.tops.get(name)
        codes[channel, run.cylinder] = sensor.codes(values[channel], noise, top)
    return codes


def release_counts(truth: Truth, run: Run, hidden: tuple[Piece, ...] = ()) -> np.ndarray:
    """Counts of the accelerometer's three axes, (3, samples); the other two only hiss."""
    times, values = _perfect(truth, run, hidden)
    rng = stream(truth.seed, "noise", run.name, run.cylinder, "acceleration")
    sensor = truth.sensors[f"acceleration,{run.cylinder}"]
    noise = rng.standard_normal((3, times.size))
    noise = noise + _spikes(truth, run, "acceleration", times.size)
    still = np.zeros(times.size)
    return np.stack(
        [
            sensor.codes(signal, part)
            for signal, part in zip((still, still, values["acceleration"]), noise, strict=True)
        ]
    )


def _perfect(truth: Truth, run: Run, hidden: tuple[Piece, ...]) -> Readings:
    """What perfect sensors would have read, as exact as the campaign's solver is."""
    tolerance = truth.flaws.tolerance
    return simulate(truth, run, hidden, TOLERANCE if tolerance is None else tolerance)


def _spikes(truth: Truth, run: Run, channel: str, size: int) -> np.ndarray | float:
    """Spikes in units of the sensor's noise, where the campaign has any."""
    share = truth.flaws.outliers
    if share == 0.0:
        return 0.0
    return spikes(stream(truth.seed, "spikes", run.name, run.cylinder, channel), size, share)


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
        rest = plant.balanced() if acting(truth, run, hidden) else plant.at_rest()
        motion = trajectory(plant, rest, times)
        arrays[f"ice_load_{run.cylinder}"] = run.ice_load(times).astype(np.float32)
        arrays[f"plate_displacement_{run.cylinder}"] = motion.states[2].astype(np.float32)
    return arrays

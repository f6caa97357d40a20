"""One call: a campaign of a population in files, with a spec and a truth that no workflow opens."""

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np

from .plant import AREA, Motion, Rig, Run, motion
from .populations import POPULATIONS, Population
from .sensors import averaged, converted, drawn, instants, noise_of

FAST = 1600.0
UNITS = {"load": ("F", "N", 1.0), "stroke": ("s", "cm", 1e-2), "pressure": ("p", "MPa", 1e6)}
SHAPES = 4
"""Lengths of records and valve times follow seed % SHAPES: compiled programs serve again."""
FULL = (6.645 + 4.965) * 1e-3 / 60.0
HEAD = """\
title = "{population}, seed {seed}: simulated by equations of another form"
simulated = true

[model]
effects = ["load-cell-spring", "oil-compressibility", "viscous-friction", "pump-curve",
           "frequency-dependent-friction"]
"""


def rig_of(population: Population, rng: np.random.Generator) -> Rig:
    """Constants: uniform with the stated sds, friction and load cell log-uniform and wide."""
    near = lambda value, sd: float(value * (1.0 + sd * 3.0**0.5 * rng.uniform(-1.0, 1.0)))  # noqa: E731
    wide = lambda low, high: float(np.exp(rng.uniform(np.log(low), np.log(high))))  # noqa: E731
    return Rig(
        k_LC=wide(4.2e7, 9e7),
        k_oil=near(2e9, 0.05),
        L_0=near(0.2, 0.02),
        M_HC=near(60.0, 0.03),
        M_Pl=near(10.0, 0.03),
        M_Fl=near(200.0, 0.03),
        k_frame=near(Rig.k_frame, 0.03) * population.frame,
        mu=wide(4e4, 1.8e5),
        mu_branch=(wide(5e5, 1.6e6), wide(6e4, 2.4e5)),
        tau_branch=(wide(0.12, 0.35), wide(5e-3, 14e-3)),
        pump_scale=population.scale,
        intake=population.intake,
    )


def runs_of(population: Population, rig: Rig, shape, rng) -> list[Run]:
    """Frames, free runs of both cylinders, releases; how many of each differs by shape."""
    found, long = [], population.durations

    def at(low: float, high: float) -> float:
        return round(float(shape.uniform(low, high)) * long, 1)

    for number in range(int(shape.integers(2, 4))):
        opened, held, let, rest = at(1.8, 3.5), at(2.5, 5.0), at(1.2, 2.2), at(0.6, 1.4)
        load, left = rng.uniform(1.2e5, 2.6e5), rng.uniform(0.1, 0.4)
        stroke = load * (1.0 / rig.k_LC + 1.0 / rig.k_frame)
        volume = AREA * (stroke + load / AREA / rig.k_oil * (rig.L_0 + stroke))
        valve = (
            (opened, volume / opened / FULL),
            (round(opened + held, 1), 0.0),
            (round(opened + held + let, 1), -(1.0 - left) * volume / let / FULL),
            (round(opened + held + let + rest, 1), 0.0),
        )
        found.append(Run(f"press-{number + 1}", "frame", "AB"[number % 2], valve[-1][0], valve))
    for number in range(int(shape.integers(2, 4))):
        opened, shut = at(6.0, 11.0), at(1.0, 2.5)
        fraction = rng.uniform(0.05, 0.28)
        for cylinder in "AB":
            own = float(fraction * rng.uniform(0.85, 1.18))
            valve = ((opened, own), (round(opened + shut, 1), 0.0))
            found.append(Run(f"run-{number + 1}", "free-run", cylinder, valve[-1][0], valve))
    for number in range(int(shape.integers(1, 3))):
        instant = float(rng.uniform(0.03, 0.05))
        instant = round(instant * FAST) / FAST if population.grid else instant
        low, high, law = population.strap
        lasts = float(low * (high / low) ** rng.uniform()) if low else 0.0
        preload = 6000.0 * (1.0 + 0.01 * 3.0**0.5 * float(rng.uniform(-1.0, 1.0)))
        strap = (preload, instant, lasts, law)
        found.append(Run(f"snap-{number + 1}", "release", "A", 0.25, ((0.25, 0.0),), strap))
    return found


def sampled(population: Population, run: Run, moved: Motion, rng) -> tuple[np.ndarray, dict]:
    """Nominal times [s] and what noiseless sensors behind the low-pass read, by channel."""
    rate = FAST if run.kind == "release" else population.rate
    times = np.arange(int(run.duration * rate + 1e-6)) / rate
    channels = ("acceleration",) if run.kind == "release" else tuple(UNITS)
    chain, late = population.chain, dict(population.chain.late)
    looked = averaged(chain, instants(chain, times, rng), 1.0 / rate)
    weights = np.array([1.0])
    if looked.shape[1] > 1:
        weights = 0.5 * np.polynomial.legendre.leggauss(looked.shape[1])[1]
    found = {}
    every = {0.0: [[moved.values(t) for t in row] for row in looked]}
    for channel in channels:
        delay = late.get(channel, 0.0)
        if delay not in every:
            every[delay] = [[moved.values(t - delay) for t in row] for row in looked]
        found[channel] = np.array([[v[channel] for v in row] for row in every[delay]]) @ weights
    return times, found


def campaign(population: str, seed: int, folder: Path) -> Path:
    """Write the records, truth.json and the spec, whose path is given; a seed is a campaign."""
    made, folder = POPULATIONS[population], Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    key = int.from_bytes(population.encode()[:8], "big")
    rng = np.random.default_rng([seed, key])
    rig = rig_of(made, rng)
    cause = (made.hidden(rng),) if made.hidden else ()
    shape = np.random.default_rng([seed % SHAPES, 77])
    runs = runs_of(made, rig, shape, rng)
    sensors = {
        (channel, cylinder): drawn(made.chain, channel, rng)
        for channel in (*UNITS, "acceleration") for cylinder in "AB"
    }  # fmt: skip
    spec = HEAD.format(population=population, seed=seed)
    for run in runs:
        acting = tuple(one for one in cause if one.acts_in(run, runs))
        moved = motion(rig, run, acting, made.tolerance)
        spec += "\n" + _written(made, run, moved, sensors, folder, rng)
    (folder / "spec.toml").write_text(spec, "utf-8")
    truth = {
        "simulated": True, "population": population, "seed": seed, "rig": asdict(rig),
        "hidden": [{"form": type(one).__name__, **asdict(one)} for one in cause],
        "nearest": made.nearest, "chain": asdict(made.chain),
        "runs": [asdict(run) for run in runs],
        "sensors": {",".join(key): asdict(one) for key, one in sensors.items()},
    }  # fmt: skip
    (folder / "truth.json").write_text(json.dumps(truth, indent=1), "utf-8")
    return folder / "spec.toml"


def _written(made: Population, run: Run, moved: Motion, sensors, folder: Path, rng) -> str:
    """Write a record's file; gives its lines of the spec."""
    times, exact = sampled(made, run, moved, rng)
    file = f"{run.name}-{run.cylinder}.txt"
    columns, names = [1e3 * times], ["t [ms]"]
    lines = [
        "[[records]]", f'name = "{run.name}"', f'kind = "{run.kind}"',
        f'cylinder = "{run.cylinder}"', f'file = "{file}"',
    ]  # fmt: skip
    if run.strap:
        lines.append("preload = { value = 6000.0, sd = 60.0 }")
    else:
        told = [("tank" if f < 0 else "open" if f > 0 else "shut", until) for until, f in run.valve]
        parts = [f'{{ until = {until!r}, position = "{where}" }}' for where, until in told[:-1]]
        lines.append(f'valve = [{", ".join(parts)}, {{ position = "{told[-1][0]}" }}]')
    lines += ["[records.channels]", 'time = { column = "t [ms]", unit = "ms" }']
    for channel, values in exact.items():
        sensor = sensors[channel, run.cylinder]
        noise = noise_of(made.chain, sensor.colour, times, rng)
        read = sensor.step * converted(made.chain, sensor, values, noise)
        label, unit, scale = UNITS.get(channel, ("a", "m/s2", 1.0))
        names.append(label)
        columns.append(read / scale)
        # A converter that cuts off reads half a step low; its sheet says so.
        offset = f", offset = {0.5 * sensor.step!r}" if made.chain.cut else ""
        lines.append(f'{channel} = {{ column = "{label}", unit = "{unit}"{offset} }}')
    rows = [";".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True)]
    (folder / file).write_text("\n".join([";".join(names), *rows]) + "\n", "utf-8")
    return "\n".join(lines) + "\n"

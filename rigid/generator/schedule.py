"""The records of a campaign: who runs when with the valve where, and under what outer load."""

import numpy as np

from rigid.generator.constants import AREA
from rigid.generator.core import Rig, Run, Switch
from rigid.generator.pieces import pump_flow

PRELOAD = 6000.0  # N, the load in the top cylinder at which the hook was released
FREE_RUN_FRACTIONS = (0.25, 0.12, 0.06)  # three clearly different settings of the hose's valve
FIELD_FRACTIONS = {"A": 0.2, "B": 0.12}  # the paper's simulations of the field test


def frame_run(
    name: str, cylinder: str, rig: Rig, rng: np.random.Generator, clock: np.random.Generator
) -> Run:
    """Pump up against the frame, hold, let most of it off to the tank, hold.

    The flow fractions follow from the load the operator stops at, by the static balance of the
    oil: the stroke against load cell and frame, and the oil's own compression.
    """
    load, left = rng.uniform(205e3, 255e3), rng.uniform(0.12, 0.28)
    opened, shut, tank = map(_seconds, clock.uniform((2.5, 6.8, 8.8), (2.7, 7.2, 9.2)))
    duration = _seconds(tank + clock.uniform(0.6, 1.2))
    stroke = load * (1 / rig.k_LC + 1 / rig.k_frame)
    volume = AREA * stroke + load * (rig.L_0 + stroke) / rig.k_oil
    return Run(
        name,
        "frame",
        cylinder,
        duration,
        valve=(
            Switch(opened, "open"),
            Switch(shut, "shut"),
            Switch(tank, "tank"),
            Switch(duration, "shut"),
        ),
        kappa=float(volume / (opened * pump_flow(0.0))),
        kappa_tank=float(-(1 - left) * volume / ((tank - shut) * pump_flow(0.0))),
    )


def free_runs(
    name: str, fraction: float, rng: np.random.Generator, clock: np.random.Generator
) -> list[Run]:
    """Both cylinders run out free of load at one setting, then the valve is shut for 2 s."""
    duration = _seconds(clock.uniform(10.0, 13.0))
    valve = (Switch(_seconds(duration - 2.0), "open"), Switch(duration, "shut"))
    kappas = fraction * np.exp(np.log(1.12) * rng.standard_normal(2))
    return [
        Run(name, "free-run", cylinder, duration, valve, kappa=float(kappa))
        for cylinder, kappa in zip("AB", kappas, strict=True)
    ]


def release_run(name: str, rng: np.random.Generator) -> Run:
    """The hook lets go at some time between two samples."""
    return Run(
        name,
        "release",
        "A",
        duration=0.25,
        valve=(Switch(0.25, "shut"),),
        preload=float(PRELOAD * (1 + 0.01 * rng.standard_normal())),
        release_time=float(rng.uniform(0.020, 0.040)),
        file_start=int(rng.integers(500, 1_000)) / 1000,
    )


def field_runs(name: str, rng: np.random.Generator) -> list[Run]:
    """A beam of ice pressed until it fails; B's valve is shut for a while, as in Fig. 11."""
    duration = 25.0
    event = _seconds(rng.uniform(7.0, 9.0))
    again = _seconds(event + rng.uniform(1.5, 2.5))
    end = Switch(duration, "open")
    valves = {"A": (end,), "B": (Switch(event, "open"), Switch(again, "shut"), end)}
    kappas = np.exp(np.log(1.05) * rng.standard_normal(2))
    ice = dict(zip("AB", _ice_loads(rng), strict=True))
    return [
        Run(
            name,
            "field",
            cylinder,
            duration,
            valves[cylinder],
            kappa=float(FIELD_FRACTIONS[cylinder] * factor),
            ice=ice[cylinder],
        )
        for cylinder, factor in zip("AB", kappas, strict=True)
    ]


def _ice_loads(rng: np.random.Generator) -> list[tuple[tuple[float, ...], tuple[float, ...]]]:
    """Knots of the load on A and B: rises, brittle drops at common times, the failure."""
    drops = int(rng.integers(3, 6))
    instants = np.linspace(2.0, 22.0, drops + 2)  # contact, the drops, the failure
    instants[1:-1] += rng.uniform(-1.0, 1.0, drops)
    instants[-1] += rng.uniform(-0.5, 0.5)
    final = rng.uniform(65e3, 80e3)
    knots = []
    for peak in (final, rng.uniform(0.75, 0.95) * final):
        heights = peak * np.linspace(0.35, 1.0, drops + 1) * rng.uniform(0.92, 1.0, drops + 1)
        kept = np.append(rng.uniform(0.5, 0.8, drops), 0.0)
        lasting = rng.uniform(0.03, 0.08, drops + 1)
        times, loads = [0.0, instants[0]], [0.0, 0.0]
        for instant, height, part, span in zip(instants[1:], heights, kept, lasting, strict=True):
            times += [instant, instant + span]
            loads += [height, height * part]
        milliseconds = tuple(round(float(t), 3) for t in times)
        knots.append((milliseconds, tuple(float(load) for load in loads)))
    return knots


def _seconds(value: float) -> float:
    """Round to the slow recorder's interval, so that a spec states a switch without error."""
    return round(float(value), 2)


def schedule(rig: Rig, streams, *, field: bool, clocks=None) -> tuple[Run, ...]:
    """All runs of a campaign in the order in which they were recorded.

    - streams: gives a random generator for a record's name
    - clocks: the same for lengths of records and times of the valve; left out: `streams`
    """
    runs = []
    for name, cylinder in (("frame-1", "A"), ("frame-2", "B"), ("frame-3", "A")):
        rng = streams(name)
        runs.append(frame_run(name, cylinder, rig, rng, clocks(name) if clocks else rng))
    for number, fraction in enumerate(FREE_RUN_FRACTIONS, start=1):
        name = f"free-run-{number}"
        rng = streams(name)
        runs += free_runs(name, fraction, rng, clocks(name) if clocks else rng)
    runs += [release_run(name, streams(name)) for name in ("release-1", "release-2")]
    if field:
        runs += field_runs("field-1", streams("field-1"))
    return tuple(runs)

"""What a fit of a campaign adjusts, and what each such constant does to the readings.

The base model has friction with memory, as in the generator's calibration.toml; the priors are
those that the interface and the effects state. A constant is told in prior standard deviations z
from its true value: value exp(width z), gain + width z, zero + width z.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import exp, log, sqrt
from typing import NamedTuple

import numpy as np

from rigid.generator.constants import FAST_RATE
from rigid.generator.core import Piece, Run
from rigid.generator.draw import NORMAL, SENSORS, Truth
from rigid.generator.simulate import sampling_times, simulate
from rigid.generator.stacked import side_by_side

SLOW_CHANNELS = ("load", "stroke", "pressure")
# Prior sds, relative: of normal laws as stated, of lognormal ones log(factor).
RELATIVE = {
    **{name: share for name, (_, share) in NORMAL.items()},
    "k_LC": log(2.0),
    "mu_inf": log(10.0),
    "mu_1": log(5.0),
    "tau_1": log(2.0),
    "mu_2": log(5.0),
    "tau_2": log(2.0),
    "kappa": log(3.0),
    "kappa_tank": log(3.0),
    "preload": 0.01,
}
RELEASE_TIME = 1.0 / (FAST_RATE * sqrt(12.0))  # s, anywhere between two samples
STEP = 0.005  # relative, of a finite difference; curvature counts for half of it
SMALL_STEP = 0.05  # in prior sds, where that is less


class Key(NamedTuple):
    """One channel of one cylinder in one record."""

    record: str
    cylinder: str
    channel: str


class Constant(NamedTuple):
    """One number that a fit adjusts.

    - part: "rig", "friction", "run" or "sensor"; name: its field there
    - owner: "record,cylinder" or "channel,cylinder" where part is one of several
    - width: prior sd, relative for all but gains, zeros and the instant of release
    """

    part: str
    name: str
    width: float
    owner: str = ""


def recorded(run: Run) -> tuple[str, ...]:
    """Channels that a run's recorder keeps."""
    return ("acceleration",) if run.kind == "release" else SLOW_CHANNELS


def noiseless(
    truth: Truth, hidden: Sequence[Piece] = (), runs: Sequence[Run] | None = None
) -> dict[Key, np.ndarray]:
    """Readings of all records without noise and conversion, in SI.

    - truth: of the campaign; hidden: what acts beside the base plant; none: the base plant alone
    - runs: left out, all of the truth
    """
    found = {}
    for run in truth.runs if runs is None else runs:
        _, values = simulate(truth, run, tuple(hidden))
        for channel in recorded(run):
            sensor = truth.sensors[f"{channel},{run.cylinder}"]
            found[Key(run.name, run.cylinder, channel)] = sensor.reading(values[channel])
    return found


def constants(truth: Truth) -> tuple[Constant, ...]:
    """Every number that a fit of the truth's records adjusts."""
    found = [
        Constant(part, name, RELATIVE[name])
        for part in ("rig", "friction")
        for name in getattr(truth, part).__dataclass_fields__
    ]
    for run in truth.runs:
        names = [n for n in ("kappa", "kappa_tank", "preload") if getattr(run, n) is not None]
        found += [Constant("run", name, RELATIVE[name], _label(run)) for name in names]
        if run.release_time is not None:
            found.append(Constant("run", "release_time", RELEASE_TIME, _label(run)))
    read = {(channel, run.cylinder) for run in truth.runs for channel in recorded(run)}
    for channel, cylinder in sorted(read):
        name, (gain, zero, _, _) = f"{channel},{cylinder}", SENSORS[channel]
        found += [Constant("sensor", "gain", gain, name), Constant("sensor", "zero", zero, name)]
    return tuple(found)


def moved(truth: Truth, by: Mapping[Constant, float]) -> Truth:
    """Give the truth with constants moved by so many prior sds each."""
    new: dict[tuple[str, str], dict[str, float]] = {}
    for constant, z in by.items():
        place = new.setdefault((constant.part, constant.owner), {})
        place[constant.name] = _value(truth, constant, z)
    runs = tuple(replace(run, **new.get(("run", _label(run)), {})) for run in truth.runs)
    sensors = {n: replace(s, **new.get(("sensor", n), {})) for n, s in truth.sensors.items()}
    rig = replace(truth.rig, **new.get(("rig", ""), {}))
    friction = replace(truth.friction, **new.get(("friction", ""), {}))
    return replace(truth, rig=rig, friction=friction, runs=runs, sensors=sensors)


def _value(truth: Truth, constant: Constant, z: float) -> float:
    """Value of a constant z prior sds from its own; a release stays between its two samples."""
    part, name, width, owner = constant
    owners = {_label(run): run for run in truth.runs} | truth.sensors
    old = getattr(owners[owner] if owner else getattr(truth, part), name)
    if name == "release_time":
        first = np.floor(old * FAST_RATE)
        low, high = (first + 0.01) / FAST_RATE, (first + 0.99) / FAST_RATE
        return float(min(max(old + width * z, low), high))
    return old + width * z if part == "sensor" else old * exp(width * z)


def _label(run: Run) -> str:
    return f"{run.name},{run.cylinder}"


class Layout:
    """All channels of all records one after the other, in units of noise.

    - keys: in that order; size: samples in all
    """

    def __init__(self, truth: Truth):
        self.keys = tuple(Key(r.name, r.cylinder, c) for r in truth.runs for c in recorded(r))
        sensors = [truth.sensors[f"{key.channel},{key.cylinder}"] for key in self.keys]
        sds = [sqrt(sensor.noise**2 + sensor.step**2 / 12.0) for sensor in sensors]
        self._sds = dict(zip(self.keys, sds, strict=True))
        sizes = [len(sampling_times(run)) for run in truth.runs for _ in recorded(run)]
        ends = np.cumsum(sizes).tolist()
        self._places = {
            key: slice(end - size, end)
            for key, size, end in zip(self.keys, sizes, ends, strict=True)
        }
        self.size = ends[-1]

    def flat(self, readings: Mapping[Key, np.ndarray]) -> np.ndarray:
        """Readings over their noise, (size,); zero for a channel that is not given."""
        found = np.zeros(self.size)
        for key, values in readings.items():
            found[self._places[key]] = values / self._sds[key]
        return found


def change(
    readings: Mapping[Key, np.ndarray], base: Mapping[Key, np.ndarray]
) -> dict[Key, np.ndarray]:
    """Difference of readings to the base's, for those that are given."""
    return {key: values - base[key] for key, values in readings.items()}


def slopes(truth: Truth, layout: Layout, base: Mapping[Key, np.ndarray]) -> np.ndarray:
    """Change of all readings per prior sd of each constant, (size, constants)."""
    listed = constants(truth)
    columns: dict[Constant, dict[Key, np.ndarray]] = {
        one: _by_sensor(truth, base, one) if one.part == "sensor" else {} for one in listed
    }
    for run in truth.runs:
        felt = [one for one in listed if one.part != "sensor" and _feels(run, one)]
        for one, readings in zip(felt, _by_constants(truth, run, felt), strict=True):
            columns[one] |= readings
    return np.stack([layout.flat(columns[one]) for one in listed], axis=1)


def _by_sensor(
    truth: Truth, base: Mapping[Key, np.ndarray], one: Constant
) -> dict[Key, np.ndarray]:
    """Slopes by a gain or a zero."""
    sensor = truth.sensors[one.owner]
    mine = {key: v for key, v in base.items() if f"{key.channel},{key.cylinder}" == one.owner}
    if one.name == "zero":
        return {key: np.full(values.size, one.width) for key, values in mine.items()}
    return {key: one.width * (v - sensor.zero) / sensor.gain for key, v in mine.items()}


def _by_constants(truth: Truth, run: Run, felt: Sequence[Constant]) -> list[dict[Key, np.ndarray]]:
    """Slopes of a run's channels by each constant, by finite differences."""
    steps = [
        _inward(run) if one.name == "release_time" else min(STEP / one.width, SMALL_STEP)
        for one in felt
    ]
    truths = [truth, *(moved(truth, {o: s}) for o, s in zip(felt, steps, strict=True))]
    runs = [next(r for r in t.runs if _label(r) == _label(run)) for t in truths]
    if run.kind == "release":
        read = [simulate(t, r).values for t, r in zip(truths, runs, strict=True)]
    else:
        read = side_by_side(truths, runs)
    found = []
    for values, step in zip(read[1:], steps, strict=True):
        here = {}
        for channel in recorded(run):
            gain = truth.sensors[f"{channel},{run.cylinder}"].gain
            difference = gain * (values[channel] - read[0][channel]) / step
            here[Key(run.name, run.cylinder, channel)] = difference
        found.append(here)
    return found


def _feels(run: Run, constant: Constant) -> bool:
    """Whether a run knows of a constant."""
    if constant.part == "run":
        return _label(run) == constant.owner
    return constant.name != "k_frame" or run.kind == "frame"


def _inward(run: Run) -> float:
    """A step of the instant of release toward the middle between its two samples."""
    return SMALL_STEP if run.hook()[1] * FAST_RATE % 1.0 < 0.5 else -SMALL_STEP

"""How strongly a hidden cause shows once every uncertain constant has been refitted.

The strength is the square root of twice the expected log-likelihood gain of the true cause over
the base model, refitted: the norm of the cause's trace in units of noise, after the campaign's
constants have absorbed what their priors let them,

    s^2 = min over z of |t - J z|^2 + |z|^2,

with t the change of the noiseless readings over sqrt(sigma^2 + step^2/12), J their slope by the
constants in prior standard deviations. The trace is that of the amplitude at hand, not linear in
it; the constants' part is linear. Noise counts as white. Base model: friction with memory, as in
the generator's calibration.toml; priors as the contract and the effects state them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import log, sqrt
from typing import NamedTuple

import numpy as np

from rigid.generator.constants import FAST_RATE
from rigid.generator.draw import NORMAL, SENSORS, Truth
from rigid.generator.hidden import Hidden
from rigid.generator.plant import Piece
from rigid.generator.schedule import Run
from rigid.generator.simulate import sampling_times, simulate

SLOW_CHANNELS = ("load", "stroke", "pressure")
# Prior sds of what is refitted, relative: normal laws as stated; of lognormal ones log(factor).
WIDTHS = {
    "k_LC": log(2.0),
    **{name: share for name, (_, share) in NORMAL.items()},
    "mu_inf": log(10.0),
    "mu_1": log(5.0),
    "tau_1": log(2.0),
    "mu_2": log(5.0),
    "tau_2": log(2.0),
    "kappa": log(3.0),
    "kappa_tank": log(3.0),
    "preload": 0.01,
}
LARGEST_STEP = 0.005  # relative, of a finite difference; curvature counts for half of it
TOLERANCE = 0.02  # relative, of a strength that is asked for
MOST_TRIALS = 30
MOST_FACTOR = 4.0  # of the amplitude from one trial to the next


class Key(NamedTuple):
    """One channel of one cylinder in one record."""

    record: str
    cylinder: str
    channel: str


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


@dataclass(frozen=True)
class Ground:
    """A campaign's base plant, ready to judge causes by: made once, used for all.

    - truth: with the runs that are fitted (no field record)
    - base: (n,) readings without noise in units of noise, all channels one after the other
    - absorbed: (n, constants) the part, on the samples, of an orthonormal basis of what the
      constants can do at the price of their priors
    """

    truth: Truth
    keys: tuple[Key, ...]
    base: np.ndarray
    absorbed: np.ndarray

    def trace(self, cause: Piece) -> np.ndarray:
        """Change of all readings that a cause makes, (n,) in units of noise."""
        runs = [run for run in self.truth.runs if cause.within(self.truth.rig, run)]
        return _stacked(self.truth, noiseless(self.truth, (cause,), runs), self.keys, self.base)

    def strength(self, trace: np.ndarray) -> float:
        """Strength of a trace."""
        return sqrt(max(self.product(trace, trace), 0.0))

    def product(self, one: np.ndarray, other: np.ndarray) -> float:
        """Scalar product of two traces after the constants have absorbed what they can."""
        return float(one @ other - (self.absorbed.T @ one) @ (self.absorbed.T @ other))

    def cosines(self, traces: Sequence[np.ndarray]) -> np.ndarray:
        """Cosines between traces after the constants have absorbed what they can."""
        products = np.array([[self.product(a, b) for b in traces] for a in traces])
        sizes = np.sqrt(np.diag(products))
        return products / np.outer(sizes, sizes)


def ground(truth: Truth) -> Ground:
    """Simulate a campaign and its slopes by every constant that a fit adjusts."""
    runs = tuple(run for run in truth.runs if run.kind != "field")
    truth = replace(truth, runs=runs)
    base = noiseless(truth)
    keys = tuple(base)
    flat = _stacked(truth, base, keys)
    columns = [*_physical(truth, keys, flat), *_sensors(truth, base, keys)]
    slopes = np.stack(columns, axis=1)
    q, _ = np.linalg.qr(np.concatenate([slopes, np.eye(slopes.shape[1])]))
    return Ground(truth, keys, flat, q[: len(slopes)])


def at_strength(
    on: Ground, cause: Hidden, wanted: float, tolerance: float = TOLERANCE
) -> tuple[Hidden, float]:
    """Find the amplitude at which a cause has a wanted strength; gives the cause and its strength.

    - tolerance: relative, of the strength

    Regula falsi in the logarithms, held inside the bracket. Raises ValueError where no amplitude
    reaches the strength.
    """
    below = above = None
    amplitude = cause.amplitude
    for _ in range(MOST_TRIALS):
        trial = cause.of(amplitude)
        strength = on.strength(on.trace(trial))
        if abs(strength - wanted) <= tolerance * wanted:
            return trial, strength
        point = (log(amplitude), log(max(strength, 1e-6)))
        below, above = (point, above) if strength < wanted else (below, point)
        amplitude = _next(amplitude, strength, wanted, below, above)
    raise ValueError(f"{cause.name} does not reach a strength of {wanted} in {MOST_TRIALS} trials")


def _next(amplitude: float, strength: float, wanted: float, below, above) -> float:
    """Amplitude of the next trial, from the nearest points (log a, log s) on both sides."""
    if below is None or above is None:
        ratio = wanted / max(strength, 1e-6)
        return amplitude * min(max(ratio, 1.0 / MOST_FACTOR), MOST_FACTOR)
    share = (log(wanted) - below[1]) / (above[1] - below[1])
    share = min(max(share, 0.1), 0.9)
    return float(np.exp(below[0] + share * (above[0] - below[0])))


def _stacked(
    truth: Truth,
    readings: dict[Key, np.ndarray],
    keys: tuple[Key, ...],
    base: np.ndarray | None = None,
) -> np.ndarray:
    """Readings over noise, key after key, less `base` where given; zero where a key has none."""
    parts, start = [], 0
    for key in keys:
        if key in readings:
            scaled = readings[key] / _noise(truth, key)
            end = start + len(scaled)
            parts.append(scaled if base is None else scaled - base[start:end])
        else:
            end = start + _samples(truth, key)
            parts.append(np.zeros(end - start))
        start = end
    return np.concatenate(parts)


def _samples(truth: Truth, key: Key) -> int:
    """Length of a channel."""
    run = next(r for r in truth.runs if (r.name, r.cylinder) == (key.record, key.cylinder))
    return len(sampling_times(run))


def _noise(truth: Truth, key: Key) -> float:
    """Sd of one sample, rounding included."""
    sensor = truth.sensors[f"{key.channel},{key.cylinder}"]
    return sqrt(sensor.noise**2 + sensor.step**2 / 12.0)


def _physical(truth: Truth, keys: tuple[Key, ...], base: np.ndarray) -> Iterator[np.ndarray]:
    """Slopes by the constants of plant and records, a column each."""
    for part in ("rig", "friction"):
        for name in getattr(truth, part).__dataclass_fields__:
            step = min(LARGEST_STEP, 0.3 * WIDTHS[name])
            value = getattr(getattr(truth, part), name) * (1.0 + step)
            moved = replace(truth, **{part: replace(getattr(truth, part), **{name: value})})
            runs = [r for r in truth.runs if name != "k_frame" or r.kind == "frame"]
            change = _stacked(truth, noiseless(moved, runs=runs), keys, base)
            yield change * (WIDTHS[name] / step)
    for run in truth.runs:
        for name in ("kappa", "kappa_tank", "preload"):
            if getattr(run, name) is not None:
                step = min(LARGEST_STEP, 0.3 * WIDTHS[name])
                moved = replace(run, **{name: getattr(run, name) * (1.0 + step)})
                change = _stacked(truth, noiseless(truth, runs=[moved]), keys, base)
                yield change * (WIDTHS[name] / step)
        if run.release_time is not None:
            moved, share = _later(run)
            change = _stacked(truth, noiseless(truth, runs=[moved]), keys, base)
            yield change / share


def _later(run: Run) -> tuple[Run, float]:
    """Give a release a little earlier or later, and by what share of its prior's sd.

    A priori it lies anywhere between two samples, and there it stays.
    """
    _, instant = run.hook()
    interval = 1.0 / FAST_RATE
    place = instant / interval % 1.0
    share = 0.05 if place < 0.5 else -0.05
    sd = interval / sqrt(12.0)
    return replace(run, release_time=instant + share * sd), share


def _sensors(
    truth: Truth, base: dict[Key, np.ndarray], keys: tuple[Key, ...]
) -> Iterator[np.ndarray]:
    """Slopes by gain and zero of every sensor, a column each."""
    for name, sensor in truth.sensors.items():
        gain, zero, _, _ = SENSORS[name.split(",")[0]]
        mine = [key for key in keys if f"{key.channel},{key.cylinder}" == name]
        if mine:
            true = {key: gain * (base[key] - sensor.zero) / sensor.gain for key in mine}
            yield _stacked(truth, true, keys)
            yield _stacked(truth, {key: zero + 0.0 * base[key] for key in mine}, keys)

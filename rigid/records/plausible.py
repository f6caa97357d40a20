"""Values that can hardly be meant: a unit that is wrong by a factor of about 1,000."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Float

from rigid.io.errors import quoted
from rigid.kinds import RecordKind
from rigid.records.units import COUNTS, DIMENSIONS, SI_NAMES, TIMESTAMP, UNITS
from rigid.spec import SensorSpec

TIME = "time"
# Largest magnitude, in SI, on any rig of this kind.
HIGHEST = {"load": 3e6, "stroke": 3.0, "pressure": 1e9, "acceleration": 2e4}
ABOVE_NOISE = 8.0  # times its noise, that a channel rises which stands out of it
FINEST = 0.01  # of the sensor's step or noise, whichever is larger: load changes by more
LONGEST_INTERVAL, SHORTEST_INTERVAL = 0.999, 20e-6  # s; 1 s is too long, clocks are rounded

HARD_LIMIT = 1e20
"""Of any reading in SI, nanoseconds of a clock that are given as seconds among them. What lies
beyond is damage of the file: no unit explains it, and squares of it leave the range of floats."""
SHORTEST_STEP = 1e-12  # s, of any clock


def beyond(values: Float[np.ndarray, " n"], factor: float) -> Bool[np.ndarray, " n"]:
    """Whether values, times the factor that makes them SI, are beyond any reading."""
    return np.isfinite(values) & (np.abs(values) > HARD_LIMIT / abs(factor))


def implausible(
    kind: type[RecordKind],
    quantity: str,
    values: Float[np.ndarray, " n"],
    unit: str,
    sensor: SensorSpec,
) -> str:
    """Return what is implausible about the values and what would be plausible; empty if nothing.

    - kind: of the record; values: SI; unit: in the file
    """
    says = _says(kind, quantity, values, sensor)
    if not says:
        return ""
    grain = _grain(values)
    usual = max(sensor.step, sensor.noise)

    def unlike(ratio: float) -> float:
        """How far the changes between samples are from those of the sensor."""
        return abs(np.log10(grain * ratio / usual)) if grain > 0 else 0.0

    def plausible(ratio: float) -> bool:
        return not _says(kind, quantity, values * ratio, sensor)

    return f"{says}; {_advice(unit, _better(quantity, unit, plausible, unlike))}"


def implausible_interval(interval: float, unit: str) -> str:
    """Return what is implausible about the sampling interval [s]; empty if nothing."""
    if SHORTEST_INTERVAL <= interval <= LONGEST_INTERVAL:
        return ""
    too = "long" if interval > LONGEST_INTERVAL else "short"
    if unit == TIMESTAMP:
        advice = "the stamps may have lost their fractions, or another table was meant"
        return f"the sampling interval, {interval:.4g} s, is implausibly {too}; {advice}"

    def plausible(ratio: float) -> bool:
        return SHORTEST_INTERVAL <= interval * ratio <= LONGEST_INTERVAL

    better = _better(TIME, unit, plausible, lambda _: 0.0)
    return f"the sampling interval, {interval:.4g} s, is implausibly {too}; {_advice(unit, better)}"


def _says(kind: type[RecordKind], quantity: str, values: np.ndarray, sensor: SensorSpec) -> str:
    """Return what is implausible, empty if nothing."""
    real = values[np.isfinite(values)]
    if len(real) == 0 or quantity not in HIGHEST:
        return ""
    si = SI_NAMES[DIMENSIONS[quantity]]
    highest, travel = float(np.max(np.abs(real))), float(np.ptp(real))
    if highest > HIGHEST[quantity]:
        return f"{quantity} of {highest:.4g} {si}, above {HIGHEST[quantity]:.4g} {si}"
    lowest = kind.rises.get(quantity, 0.0)
    if highest < lowest:
        return f"{quantity} of {highest:.4g} {si} at most, never {lowest:.4g} {si} in a {kind.name}"
    least = kind.travels.get(quantity, 0.0)
    if 0 < travel < least:
        return f"{quantity} changes by {travel:.3g} {si} in all, less than {least:.3g} {si}"
    if quantity == "load" and highest < HIGHEST["load"] / 1000:
        grain, usual = _grain(real), max(sensor.step, sensor.noise)
        if 0 < grain < FINEST * usual:
            return f"load changes by {grain:.3g} N between samples, the sensor by {usual:.3g} N"
    if quantity in kind.stands_out and travel > 0:
        peak = float(np.max(np.abs(real - np.median(real))))
        if peak <= ABOVE_NOISE * sensor.noise:
            return (
                f"{quantity} rises by {peak:.3g} {si}, not above {ABOVE_NOISE:g} times the "
                f"sensor's noise of {sensor.noise:.3g} {si}: no {kind.name} is seen"
            )
    return ""


def _grain(values: np.ndarray) -> float:
    """Return what successive samples usually differ by where they differ; 0 if they never do."""
    change = np.abs(np.diff(values[np.isfinite(values)]))
    change = change[change > 0]
    return float(np.median(change)) if len(change) else 0.0


def _better(
    quantity: str,
    unit: str,
    plausible: Callable[[float], bool],
    unlike: Callable[[float], float],
) -> str:
    """Return the likeliest unit of the plausible ones, empty if none; of equals a thousandfold.

    - plausible, unlike: of the ratio by which the values would change
    """
    if unit not in UNITS:
        return ""
    factor = UNITS[unit][1]
    ratios = [(name, other / factor) for name, other in _others(quantity, unit)]
    likely = [(name, unlike(ratio)) for name, ratio in ratios if plausible(ratio)]
    return min(likely, key=lambda pair: pair[1], default=("", 0.0))[0]


def _others(quantity: str, unit: str) -> list[tuple[str, float]]:
    """Return the other units of the quantity with their factors, a thousandfold first."""
    factor = UNITS[unit][1]
    same = [
        (name, other)
        for name, (dimension, other) in UNITS.items()
        if dimension == DIMENSIONS[quantity] and other != factor and name != TIMESTAMP
    ]
    return sorted(same, key=lambda pair: abs(abs(np.log10(pair[1] / factor)) - 3.0))


def _advice(unit: str, better: str) -> str:
    """Return what to do about the unit."""
    if unit == COUNTS:
        return "check the scale of the channel"
    if not better:
        return f"check the unit, now {quoted(unit)}, and the column"
    return f"the unit is given as {quoted(unit)}, {better!r} would be plausible"

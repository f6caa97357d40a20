"""Values that can hardly be meant: a unit that is wrong by a factor of about 1,000."""

import numpy as np

from rigid.records.units import COUNTS, DIMENSIONS, SI_NAMES, TIMESTAMP, UNITS

# Largest magnitude, in SI, on any rig of this kind.
HIGHEST = {"load": 3e6, "stroke": 3.0, "pressure": 1e9, "acceleration": 2e4}
# A frame is loaded: its load and pressure rise above these, in SI.
FRAME_LOWEST = {"load": 1e3, "pressure": 1e3}
# How far a channel travels at least, in SI, by kind of record.
TRAVEL = {
    ("frame", "stroke"): 20e-6,
    ("free-run", "stroke"): 20e-6,
    ("release", "acceleration"): 1e-3,
}
LONGEST_INTERVAL, SHORTEST_INTERVAL = 10.0, 10e-6  # s


def implausible(kind: str, quantity: str, values: np.ndarray, unit: str) -> str:
    """Return what is implausible about the values and what would be plausible; empty if nothing.

    - kind: of the record; values: (n,) SI; unit: in the file
    """
    says = _says(kind, quantity, values)
    if not says:
        return ""
    better = []
    if unit in UNITS:
        factor = UNITS[unit][1]
        for name, other in _others(quantity, unit):
            if not _says(kind, quantity, values * (other / factor)):
                better.append(name)
    return f"{says}; {_advice(unit, better)}"


def implausible_interval(interval: float, unit: str) -> str:
    """Return what is implausible about the sampling interval [s]; empty if nothing."""
    if SHORTEST_INTERVAL <= interval <= LONGEST_INTERVAL:
        return ""
    too = "long" if interval > LONGEST_INTERVAL else "short"
    better = []
    if unit in UNITS and unit != TIMESTAMP:
        factor = UNITS[unit][1]
        better = [
            name
            for name, other in _others("time", unit)
            if SHORTEST_INTERVAL <= interval * other / factor <= LONGEST_INTERVAL
        ]
    return f"the sampling interval, {interval:.4g} s, is implausibly {too}; {_advice(unit, better)}"


def _says(kind: str, quantity: str, values: np.ndarray) -> str:
    """Return what is implausible, empty if nothing."""
    real = values[np.isfinite(values)]
    if len(real) == 0 or quantity not in HIGHEST:
        return ""
    si = SI_NAMES[DIMENSIONS[quantity]]
    highest, travel = float(np.max(np.abs(real))), float(np.ptp(real))
    if highest > HIGHEST[quantity]:
        return f"{quantity} of {highest:.4g} {si}, above {HIGHEST[quantity]:.4g} {si}"
    lowest = FRAME_LOWEST.get(quantity, 0.0) if kind == "frame" else 0.0
    if highest < lowest:
        return f"{quantity} of {highest:.4g} {si} at most, never {lowest:.4g} {si} in a frame"
    least = TRAVEL.get((kind, quantity), 0.0)
    if 0 < travel < least:
        return f"{quantity} changes by {travel:.3g} {si} in all, less than {least:.3g} {si}"
    return ""


def _others(quantity: str, unit: str) -> list[tuple[str, float]]:
    """Return the other units of the quantity with their factors, a thousandfold first."""
    factor = UNITS[unit][1]
    same = [
        (name, other)
        for name, (dimension, other) in UNITS.items()
        if dimension == DIMENSIONS[quantity] and other != factor and name != TIMESTAMP
    ]
    return sorted(same, key=lambda pair: abs(abs(np.log10(pair[1] / factor)) - 3.0))


def _advice(unit: str, better: list[str]) -> str:
    """Return what to do about the unit."""
    if unit == COUNTS:
        return "check the scale of the channel"
    if not better:
        return f"check the unit, now {unit!r}, and the column"
    shown = " or ".join(repr(name) for name in better[:2])
    return f"the unit is given as {unit!r}, {shown} would be plausible"

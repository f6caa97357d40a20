"""Units that are doubted, but not refused: what a column's name says, and forces out of balance."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from rigid.io.errors import quoted
from rigid.kinds import KINDS
from rigid.records.checks import FEWEST, Sheets, resolution, stretches
from rigid.records.record import Record
from rigid.records.units import UNITS, hinted, known
from rigid.spec import Stretch

FAR = 3.0
"""Ratio of load and S_Pl p from which a unit is doubted: in the simulated frames of the reference
campaign they agree to 0.2 %; units that are mistaken for each other differ by 4.4 and more."""
CLEAR = 10.0
"""Times a sensor's step or noise, beyond which a reading says what the force is."""
BALANCED = ("open", "shut")
"""Where the valve is while the plate is pressed on; to the tank, friction may hold all of it."""


def misnamed(names: Mapping[str, str], units: Mapping[str, str]) -> Iterator[str]:
    """Yield a note for each column whose name says another unit than the spec.

    - `names`: column in the file, `units`: unit in the spec, both by quantity
    """
    for quantity, name in names.items():
        said, given = hinted(name, quantity), units[quantity]
        if said and known(given) and UNITS[said] != UNITS[given]:
            yield (
                f"{quantity}: the name of column {quoted(name)} says {said}, the spec "
                f"{quoted(given)}; correct the spec if the name is right"
            )


def off_record(time: np.ndarray, valve: Sequence[Stretch]) -> Iterator[str]:
    """Yield a note where the valve switches when the record does not run.

    - `time`: (n,) s of the samples, on the clock of the file
    """
    off = [f"{s.until:g}" for s in valve[:-1] if not time[0] <= s.until <= time[-1]]
    if off:
        yield (
            f"valve: it moves at {', '.join(off)} s, the record runs from {time[0]:.4g} to "
            f"{time[-1]:.4g} s; correct `until` (in s, on the clock of the file) unless the rest "
            "was cut away"
        )


def balanced(record: Record, area: float, sensors: Sheets) -> Record:
    """Return the record, with a note where load and S_Pl p are far apart; in a frame alone.

    - `area`: S_Pl, m^2

    What the oil presses on the plunger stands on the frame, but for friction and inertia.
    """
    if KINDS[record.kind].contact != "frame" or not {"load", "pressure"} <= set(record.channels):
        return record
    load, pressure = (record.channels[quantity] for quantity in ("load", "pressure"))
    force = area * pressure.values
    clear = np.abs(load.values) > CLEAR * resolution(sensors, "load")
    clear |= np.abs(force) > CLEAR * area * resolution(sensors, "pressure")
    pressed = np.array([s.position in BALANCED for s in record.valve] or [True])
    told = clear & pressed[stretches(record.time, record.valve)[0]] & load.valid & pressure.valid
    if np.count_nonzero(told) < FEWEST:
        return record
    seen, due = float(np.median(load.values[told])), float(np.median(force[told]))
    if abs(due) < FAR * abs(seen) and abs(seen) < FAR * abs(due) and seen * due > 0.0:
        return record
    note = (
        f"load and pressure are out of balance: load is {seen:.4g} N, S_Pl p {due:.4g} N (medians "
        f"of {np.count_nonzero(told)} samples); check units, scales and signs of both, and S_Pl"
    )
    return replace(record, notes=(*record.notes, note))

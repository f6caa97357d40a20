"""Units a channel may be recorded in, each with its factor to SI."""

import re

from rigid.io.errors import InputError, quoted

DIMENSIONS = {
    "time": "time",
    "load": "force",
    "stroke": "length",
    "pressure": "pressure",
    "acceleration": "acceleration",
    "position": "length",
    "force": "force",
    "command": "number",
}
GRAVITY = 9.80665  # m/s^2, standard
POUND_FORCE = 4.4482216152605  # N
PSI = 6894.757293168361  # Pa
COUNTS = "counts"
TIMESTAMP = "timestamp"
UNITS: dict[str, tuple[str, float]] = {
    "s": ("time", 1.0),
    "ms": ("time", 1e-3),
    "us": ("time", 1e-6),
    "min": ("time", 60.0),
    "h": ("time", 3600.0),
    TIMESTAMP: ("time", 1.0),
    "N": ("force", 1.0),
    "kN": ("force", 1e3),
    "MN": ("force", 1e6),
    "kgf": ("force", GRAVITY),
    "lbf": ("force", POUND_FORCE),
    "m": ("length", 1.0),
    "cm": ("length", 1e-2),
    "mm": ("length", 1e-3),
    "um": ("length", 1e-6),
    "in": ("length", 0.0254),
    "Pa": ("pressure", 1.0),
    "kPa": ("pressure", 1e3),
    "MPa": ("pressure", 1e6),
    "bar": ("pressure", 1e5),
    "mbar": ("pressure", 1e2),
    "psi": ("pressure", PSI),
    "m/s^2": ("acceleration", 1.0),
    "m/s2": ("acceleration", 1.0),
    "g": ("acceleration", GRAVITY),
    "mg": ("acceleration", GRAVITY * 1e-3),
    "1": ("number", 1.0),
    "%": ("number", 1e-2),
}

SAME = {  # other ways in which files write these units
    "sec": "s",
    "seconds": "s",
    "msec": "ms",
    "\u00b5s": "us",
    "\u03bcs": "us",
    "\u00b5m": "um",
    "\u03bcm": "um",
    "inch": "in",
    "m/s\u00b2": "m/s^2",
    "PSI": "psi",
}
BETWEEN = re.compile(r"[\s_.\-]+")
"""What stands between the words of a column's name."""
IN_NAME = re.compile(r".*[\[(]([^\[\]()]*)[\])]\s*")


def to_si(quantity: str, unit: str, scale: float | None, where: str) -> float:
    """Return what a recorded 1 is worth in SI: the unit's factor, or `scale` for counts.

    - quantity: a key of `DIMENSIONS`
    - unit: a name of `UNITS`, or `counts`
    - scale: SI per count; None unless the unit is `counts`
    - where: what the message begins with, such as the file, record and channel

    Raises InputError when the unit is unknown or of another dimension, when counts lack a scale,
    and when a scale stands beside a unit that has its own factor.
    """
    wanted = dimension(quantity, where)
    if unit == COUNTS:
        if scale is None or scale == 0:
            raise InputError(
                f"{where}: the unit is counts, which needs a scale in {SI_NAMES[wanted]} per "
                f"count; found {scale}; add scale = ..."
            )
        return scale
    found, factor = UNITS.get(unit, ("", 0.0))
    if found != wanted:
        what = f"is a unit of {found}" if found else "is not known"
        raise InputError(
            f"{where}: the unit {quoted(unit)} {what}; for {quantity} use one of "
            f"{', '.join(allowed(quantity))}"
        )
    if scale is not None:
        raise InputError(
            f"{where}: both the unit {quoted(unit)} and a scale, {scale:g}, are given; leave out "
            f"the scale, or set unit = 'counts' with the scale in {SI_NAMES[wanted]} per number"
        )
    return factor


def allowed(quantity: str) -> tuple[str, ...]:
    """Return the names of the units `quantity` may have."""
    return (*(u for u, (d, _) in UNITS.items() if d == DIMENSIONS[quantity]), COUNTS)


def known(text: str) -> str:
    """Return the unit that a file's `kN`, `[kN]` or `(kN)` names; empty where none is known."""
    bare = text.strip().strip("[]()").strip()
    name = SAME.get(bare, bare)
    return name if name in UNITS and name != TIMESTAMP else ""


def in_name(name: str) -> str:
    """Return the known unit that ends a column's name, as in `time [s]`; empty where none does."""
    match = IN_NAME.fullmatch(name)
    return known(match[1]) if match else ""


def hinted(name: str, quantity: str) -> str:
    """Return the unit of `quantity` among the words of a column's name, as in `p_MPa`, `p/MPa`.

    Empty where there is none, or more than one; the first word is the name.
    """
    words = {known(word) for word in (*BETWEEN.split(name.strip())[1:], name.partition("/")[2])}
    fit = [unit for unit in words - {""} if UNITS[unit][0] == DIMENSIONS[quantity]]
    return fit[0] if len(fit) == 1 else ""


def dimensioned(of: str) -> str:
    """Return the quantity of the rig that has a dimension: `load` of a force."""
    return next(quantity for quantity, dimension in DIMENSIONS.items() if dimension == of)


def contradiction(stated: str, unit: str) -> str:
    """Return what to say where file and spec name different units; empty where they do not.

    - stated: by the file, empty where it states none; unit: in the spec
    """
    if not known(unit) or stated not in UNITS or UNITS[stated] == UNITS[unit]:
        return ""
    return (
        f"the file gives the unit {quoted(stated)}, the spec {quoted(unit)}; "
        "correct the spec, or name another column"
    )


def dimension(quantity: str, where: str) -> str:
    """Return the dimension of `quantity`; raises InputError for a quantity that is not known."""
    if quantity not in DIMENSIONS:
        raise InputError(
            f"{where}: {quoted(quantity)} is no quantity of a record; use one of "
            f"{', '.join(DIMENSIONS)}"
        )
    return DIMENSIONS[quantity]


SI_NAMES = {
    "time": "s",
    "force": "N",
    "length": "m",
    "pressure": "Pa",
    "acceleration": "m/s^2",
    "number": "1",
}

"""Field records of the rig: for each test its cylinders."""

from collections.abc import Mapping

import numpy as np

from rigid.io.errors import InputError
from rigid.likelihood.tracks import make_track
from rigid.records.record import Record
from rigid.smoothing.field import QUANTITIES, Field, rig_setup

AT_REST = 1
"""Samples at the start that must read a rig at rest; the valve may be open from then on."""

MOST_OFF = 6.0
"""Standard deviations of noise and zero beyond which the start is not at rest."""


def make_field(record: Record, spread: Mapping[str, float]) -> Field:
    """Lay a field record on its grid.

    - `spread`: of each quantity, the sd of noise and zero together [SI].

    Raises InputError where a channel is missing, samples are not evenly spaced, or the record does
    not begin out of load.
    """
    missing = [q for q in QUANTITIES if q not in record.channels]
    if missing:
        raise InputError(
            f"{record.path}: field record '{record.name}', cylinder {record.cylinder}, has no "
            f"channel {' and no '.join(missing)}; bands need load, stroke and pressure"
        )
    track, series = make_track(record)
    reading = np.stack([series.data[q] for q in QUANTITIES], axis=1)
    known = np.stack([series.weight[q] for q in QUANTITIES], axis=1)
    for i, quantity in enumerate(QUANTITIES):
        begin = reading[:AT_REST, i][known[:AT_REST, i] > 0]
        if begin.size and abs(np.median(begin)) > MOST_OFF * spread[quantity]:
            raise InputError(
                f"{record.path}: field record '{record.name}', cylinder {record.cylinder}, begins "
                f"with a {quantity} of {np.median(begin):.4g} (SI); it must begin at rest and out "
                "of load, cut with `rows` where it does"
            )
    return Field(
        name=record.name,
        place=record.cylinder,
        files={f"{record.name},{record.cylinder}": record.sha256},
        first=float(track.first),
        interval=record.interval,
        reading=reading,
        known=known,
        setup=rig_setup(record.cylinder),
        kind=record.kind,
    )

"""Field records of the rig: for each test its cylinders."""

import numpy as np

from rigid.io.errors import InputError
from rigid.likelihood.tracks import make_track
from rigid.records.record import Record
from rigid.smoothing.field import QUANTITIES, Field, rig_setup
from rigid.smoothing.rest import require_at_rest
from rigid.spec.sheets import SensorsSpec


def make_field(record: Record, sensors: SensorsSpec) -> Field:
    """Lay a field record on its grid; `sensors`: their sheets.

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
    field = Field(
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
    where = f"{record.path}: field record '{record.name}', cylinder"
    require_at_rest(field, sensors, where)
    return field

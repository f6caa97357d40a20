"""From a recorded position to a motion, and the force beside it, both through the same filters.

Velocity and acceleration of a recorded position are noise above some frequency. So position, force
and pressure go through one zero-phase Butterworth filter; a quintic spline through the position has
velocity and acceleration as its derivatives; and what the model says of the force goes through the
same low-pass as the force itself, so that steps of a dry friction are rounded alike on both sides.
Source: Janot, Vandanjon and Gautier 2014, IEEE Trans. Control Systems Technology 22(1), for the two
filters; here the order of the first is 4 in all and derivatives are a spline's.
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.signal import butter, firwin, sosfiltfilt

from rigid.io.errors import InputError
from rigid.physics.inverse import Along
from rigid.records.record import Channel, Record, longest_step

SMOOTHER = 2.0
"""Corner of the Butterworth filter over that of the low-pass, which then is what limits."""

ORDER = 2
"""Of the Butterworth filter, which runs forth and back."""

NODES = 12.0
"""Nodes in a period of the corner. A bristle turns over between two of them; the instant of it is
known to half their spacing, a twelfth of what a sample of the force averages over."""

STRIDE = 6
"""Nodes between samples of the force: two samples in a period of the corner, so that noise behind
the low-pass is as good as white from sample to sample. What little folds over at the corner does so
on both sides alike."""

TAPS = 121
"""Of the low-pass (Hamming window): it falls from 1 to 0 within 0.33 corners about the corner."""

HIGHEST = 0.2
"""Corner over sampling frequency at most, so that the Butterworth filter has room below half of
it."""

FEWEST = 20
"""Samples of the force that make a record."""


class Laid(NamedTuple):
    """A record of a motion as the model meets it.

    - `along`: the motion. - `first` [s]: time of the first sample of the force; `interval` [s].
    - `force`, `weight` (samples,): in N, and 0 where the record has a gap under the low-pass.
    """

    along: Along
    first: float
    interval: float
    force: np.ndarray
    weight: np.ndarray


def lay(record: Record) -> Laid:
    """Smooth, differentiate and filter a record of kind motion.

    An uneven record is interpolated linearly onto its median interval first.

    Raises InputError where the corner is too high for the sampling or the record too short for it.
    """
    corner = record.corner
    assert corner is not None  # reading gives every motion one
    _require_room(record, corner)
    interval = float(f"{STRIDE / (NODES * corner):.9g}")
    spacing = interval / STRIDE
    nodes = spacing * np.arange(_steps(_even(record)[-1], spacing) + 1)
    read = {q: _smoothed(record, c, corner) for q, c in record.channels.items()}
    position = read["position"]
    pressure = read["pressure"](nodes) if "pressure" in read else np.zeros(len(nodes))
    kernel = np.asarray(firwin(TAPS, corner, fs=NODES * corner), dtype=float)
    along = Along(
        position(nodes),
        position.derivative(1)(nodes),
        position.derivative(2)(nodes),
        pressure,
        np.asarray(float(record.time[0])),
        kernel,
        spacing,
        STRIDE,
    )
    force = _under(kernel, read["force"](nodes))
    half = TAPS // 2 * spacing
    times = float(record.time[0]) + half + interval * np.arange(len(force))
    return Laid(along, float(times[0]), interval, force, _weights(record, times, half, corner))


def _steps(length: float, step: float) -> int:
    """How many whole steps a length holds."""
    return int(length / step + 1e-9)


def _even(record: Record) -> np.ndarray:
    """Even times since the first sample [s], one for each sample of a record without gaps."""
    span = float(record.time[-1] - record.time[0])
    return record.interval * np.arange(_steps(span, record.interval) + 1)


def _under(kernel: np.ndarray, series: np.ndarray) -> np.ndarray:
    """The low-pass on a series (nodes,), every STRIDE nodes, nothing made up beyond its ends."""
    return np.convolve(series, kernel, mode="valid")[::STRIDE]


def _require_room(record: Record, corner: float) -> None:
    """Refuse a corner that the sampling or the length of the record cannot carry."""
    where = f"{record.path}: record '{record.name}'"
    highest = HIGHEST / record.interval
    if corner > highest * (1.0 + 1e-9):
        raise InputError(
            f"{where}: corner is {corner:g} Hz; samples {record.interval:.4g} s apart allow "
            f"{highest:.4g} Hz at most"
        )
    least = (TAPS + STRIDE * FEWEST) / (NODES * corner)
    span = float(record.time[-1] - record.time[0])
    if span < least:
        raise InputError(
            f"{where}: lasts {span:.4g} s; with corner = {corner:g} Hz at least {least:.4g} s are "
            "needed: record for longer, or raise the corner"
        )


def _smoothed(record: Record, channel: Channel, corner: float):
    """Quintic spline through a channel behind the Butterworth filter; 0 is the first sample."""
    since = record.time - record.time[0]
    even = _even(record)
    values = np.interp(even, since[channel.valid], channel.values[channel.valid])
    sections = butter(ORDER, SMOOTHER * corner, fs=1.0 / record.interval, output="sos")
    return make_interp_spline(even, sosfiltfilt(sections, values), k=5)


def _weights(record: Record, times: np.ndarray, half: float, corner: float) -> np.ndarray:
    """1 for samples (samples,) under whose kernel every channel was read closely enough, else 0.

    - `half` [s]: half the length of the kernel.
    """
    weight = np.ones(len(times))
    for channel in record.channels.values():
        read = np.concatenate([record.time[:1], record.time[channel.valid], record.time[-1:]])
        wide = np.diff(read) > longest_step(corner)
        for begin, end in zip(read[:-1][wide], read[1:][wide], strict=True):
            weight[(times > begin - half) & (times < end + half)] = 0.0
    return weight

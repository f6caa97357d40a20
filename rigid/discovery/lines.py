"""At which frequency each record beats, if it beats at all: candidates such as the pump's ripple.

A beat is a line of a tenth of a hertz somewhere in a prior of some octaves, and its phase is each
record's own matter; a few settings of its prior would miss it. So each record is searched: the
frequency at which its residuals beat most, and the phase that suits them. The best of so many
settings counts for the share of the prior that it stands for.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.signal import zoom_fft
from scipy.stats import norm

from rigid.discovery.fitting.candidates import Candidate, laws_of
from rigid.discovery.fitting.families import Family
from rigid.discovery.fitting.local import Local
from rigid.discovery.fitting.traces import traces
from rigid.discovery.refit import standard_of
from rigid.effects import AbstractEffect
from rigid.priors import AbstractLaw
from rigid.tracks import Track

SPREAD = 2.0
"""Sds of the frequency's prior, either way, that are searched."""
FINER = 8
"""Frequencies tried in one over the time that the valve is open."""
NARROW = math.sqrt(2.0 * math.pi) / (2.0 * math.pi)
"""Share of all phases that a line of strength 1 leaves; one of strength s leaves 1/s of it."""
DIFFERENCE = 0.01


class Line(NamedTuple):
    """Where one record beats most.

    - `track`: "record,cylinder". - `frequency` [Hz]; `phase` [rad]: of the effect.
    - `log_share`: log of the share of frequency and phase priors that it stands for.
    - `tried`: how many independent settings it is the best of.
    """

    track: str
    frequency: float
    phase: float
    log_share: float
    tried: int

    def candidate(self, effect: type[AbstractEffect], given: dict[str, AbstractLaw]) -> Candidate:
        """Return the effect in this record alone."""
        laws = laws_of(effect, given)
        amplitude = next(label for label, (info, _) in laws.items() if info.absent is not None)
        info, law = laws[amplitude]
        absent = float(info.absent or 0.0)
        assert effect.beat is not None  # the caller asks
        frequency, phase = effect.beat
        shape = {amplitude: absent, frequency: self.frequency, phase: self.phase}
        return Candidate(
            effect, amplitude, absent, law, shape, self.track,
            log_share=self.log_share, tried=self.tried,
        )  # fmt: skip


def lines(
    local: Local, programs: tuple[Family, ...], effect: type[AbstractEffect]
) -> tuple[tuple[Line, ...], np.ndarray]:
    """Find the line of every record with an open valve, and its trace, (n, lines).

    - `effect`: one that beats.
    """
    given = dict(local.hypothesis.given)
    assert effect.beat is not None  # the caller asks
    law = laws_of(effect, given)[effect.beat[0]][1]
    tracks = [t for group in local.layout.problem.groups for t in group.tracks]
    beats = [(t, _beat(local, t, law)) for t in tracks if effect.acts_in(t.kind)]
    found = [(t, *beat) for t, beat in beats if beat is not None]
    if not found:
        return (), np.zeros((len(local.layout.channel), 0))
    two = [
        Line(t.label, frequency, phase, 0.0, 1).candidate(effect, given)
        for t, frequency, _, _ in found
        for phase in (0.0, 0.5 * math.pi)
    ]
    columns = traces(local, programs, two)
    out, best = [], []
    for i, (track, frequency, span, tried) in enumerate(found):
        pair = columns[:, 2 * i : 2 * i + 2]
        known = pair.T @ (pair * local.terms.bend[:, None]) + 1e-300 * np.eye(2)
        pull = pair.T @ local.terms.score
        phase = float(np.arctan2(*np.linalg.lstsq(known, pull, rcond=None)[0][::-1]))
        trace = pair @ np.array([math.cos(phase), math.sin(phase)])
        size = math.sqrt(max(float(trace @ (trace * local.terms.bend)), 1e-300))
        strength = max(abs(float(trace @ local.terms.score)) / size, 1.0)
        share = _density(law, frequency) / span * NARROW / strength
        out.append(Line(track.label, frequency, phase, math.log(share), tried))
        best.append(trace)
    return tuple(out), np.stack(best, axis=1)


def _beat(local: Local, track: Track, law: AbstractLaw) -> tuple[float, float, int] | None:
    """Frequency [Hz] at which a record beats most, time the valve is open [s], settings tried.

    None where its valve is never open for long enough.
    """
    layout = local.layout
    low, high = (float(law.from_standard(z)) for z in (-SPREAD, SPREAD))
    best, tried, span = (0.0, 0.0), 0, 0.0
    for number, channel in enumerate(layout.channels):
        if channel.track != track.label:
            continue
        rows = np.flatnonzero((layout.channel == number) & layout.read)
        rows = rows[_open(track, layout.time[rows])]
        open_for = len(rows) * channel.interval
        weight = float(local.terms.bend[rows].sum())
        top = min(high, 0.5 / channel.interval)
        if open_for * (top - low) < 1.0 or weight <= 0.0:
            continue
        span = max(span, open_for)
        since = layout.time[rows] - layout.time[rows[0]]
        score = np.zeros(round(float(since[-1]) / channel.interval) + 1)
        score[np.round(since / channel.interval).astype(int)] = local.terms.score[rows]
        count = math.ceil(FINER * open_for * (top - low))
        wave = zoom_fft(score, [2.0 * f * channel.interval for f in (low, top)], count)
        power = np.abs(wave) ** 2 / weight
        i = int(np.argmax(power))
        best = max(best, (float(power[i]), low + i * (top - low) / count))
        tried += math.ceil(open_for * (top - low))
    return None if tried == 0 else (best[1], span, tried)


def _open(track: Track, times: np.ndarray) -> np.ndarray:
    """Whether the pump feeds a record at some times [s] (n,)."""
    if track.drive is None:
        return np.zeros(len(times), dtype=bool)
    levels = np.asarray(track.drive.levels)
    return levels[np.searchsorted(np.asarray(track.drive.switches), times)] == 1


def _density(law: AbstractLaw, value: float) -> float:
    """Density of a law at a value."""
    z = standard_of(law, value)
    ends = [float(law.from_standard(z + d)) for d in (-DIFFERENCE, DIFFERENCE)]
    return float(norm.pdf(z)) * 2.0 * DIFFERENCE / abs(ends[1] - ends[0])

"""What an effect explains of the residuals, channel by channel and all together."""

import numpy as np

from rigid.discovery.outcome import Step
from rigid.discovery.refit import Refit
from rigid.report.discovery.section import MOST_PANELS, AgainstShown, ResidualShown

EVIDENCE_A_CLASS, FEWEST, MOST = 6.0, 6, 24
"""Squared strength that each class of samples holds, and how many classes there are."""


def residuals(step: Step) -> tuple[ResidualShown, ...]:
    """Channels that gain most, before and after; by frequency where the effect beats."""
    one = step.came_in
    if one is None:
        return ()
    beats = isinstance(one, Refit) and one.candidate.effect.beat is not None
    layout = one.before.layout
    gain = one.after.terms.value - one.before.terms.value
    totals = np.bincount(layout.channel, weights=gain, minlength=len(layout.channels))
    shown = np.argsort(-totals)[:MOST_PANELS]
    slowest = max(layout.channels[number].interval for number in shown)
    band = step.place.frequency_Hz
    # What swings and dies out is a line as well, but better seen over time.
    if not beats or (band is not None and band[1] > 0.5 / slowest):
        band = None
    out = []
    for number in shown:
        channel = layout.channels[number]
        rows = (layout.channel == number) & layout.read
        left = [fit.residual[rows] / layout.floor[rows] for fit in (one.before, one.after)]
        name = f"{channel.track} {channel.quantity}"
        if band is not None:
            found = [line_sizes(series, channel.interval, band) for series in left]
            (place, before), (_, after) = found
            out.append(ResidualShown(name, place, before, after, 1, None, band, frequencies=True))
            continue
        count = max(int(rows.sum()) // 25, 1)
        before, after = (np.convolve(series, np.ones(count) / count, "same") for series in left)
        here = (channel.track, channel.quantity) == (step.place.track, step.place.channel)
        stretch = step.place.time_s if here else None
        out.append(
            ResidualShown(name, layout.time[rows], before, after, count, before - after, stretch)
        )
    return tuple(out)


def line_sizes(
    series: np.ndarray, interval: float, band: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies [Hz] about a band and the amplitudes of the lines of a series there."""
    frequency = np.fft.rfftfreq(len(series), interval)
    size = 2.0 * np.abs(np.fft.rfft(series)) / len(series)
    near = (frequency > 0.5 * band[0]) & (frequency < 1.5 * band[1])
    return frequency[near], size[near]


def against(step: Step) -> AgainstShown | None:
    """What was left over against what the effect explains, in classes of as much evidence each.

    Source: the added-variable plot; Cook and Weisberg 1982, Residuals and Influence in Regression,
    sec. 2.3.2. Here what is added is what the effect changed in the expected records, all else
    refitted; scores stand for residuals, curvatures for weights.
    """
    one = step.came_in
    if one is None:
        return None
    # Sorted by what is expected alone: how much a rounded sample tells depends on how its noise
    # fell, and classes by that would have means of their own.
    floor, curvature = one.before.layout.floor, np.maximum(one.before.terms.curvature, 0.0)
    explained = (one.before.residual - one.after.residual) / floor
    order = np.argsort(np.where(curvature > 0.0, explained, np.inf))[: np.count_nonzero(curvature)]
    explained, curvature = explained[order], curvature[order] * floor[order] ** 2
    scores = [fit.terms.score[order] * floor[order] for fit in (one.before, one.after)]
    evidence = np.cumsum(curvature * explained**2)
    count = int(np.clip(evidence[-1] / EVIDENCE_A_CLASS, FEWEST, MOST))
    edges = np.unique(np.searchsorted(evidence, evidence[-1] * np.arange(count) / count))
    weight = np.abs(explained)
    told = np.add.reduceat(curvature * weight, edges)

    def mean(slope: np.ndarray) -> np.ndarray:
        return np.add.reduceat(slope * weight, edges) / told

    sd = np.sqrt(np.add.reduceat(curvature * weight**2, edges)) / told
    return AgainstShown(mean(curvature * explained), mean(scores[0]), mean(scores[1]), sd)

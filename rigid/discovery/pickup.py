"""Whether sensors read a line of one frequency, each channel with an angle of its own.

Nothing need be simulated: what a sensor picks up is read beside all else. So each channel has a
sine and a cosine of unknown size, and the evidence for both has a closed form, which also holds
where they are hardly two: at half the sampling frequency, where many loggers have the mains. In the
search the amplitude of a sensor's line differs from channel to channel by Rayleigh's law, about a
size that is averaged over; the refit has one amplitude for all channels of a sort.
"""

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from scipy.signal import ZoomFFT

from rigid.discovery.fitted import Fitted
from rigid.discovery.periodic import (
    BY_CHANCE,
    CHANCES,
    FINER,
    QUANTILES,
    SPREAD,
    Line,
    Sizes,
    log_prior_of,
    noise,
    total,
)
from rigid.effects import AbstractEffect
from rigid.likelihood.per_record import Channel, picking_up
from rigid.likelihood.priors import AbstractPrior
from rigid.localfit.candidates import amplitude_of, priors_of
from rigid.localfit.evidence import amplitudes, log_bayes
from rigid.localfit.integral import log_sum
from rigid.localfit.local import LocalFit

REFERENCE = "load"
"""The quantity whose amplitude ratios are taken of."""
TURNS = 10.0
"""Of a line in a record, at least. One whose alias is slower looks like a zero that wanders, and
anything that moves the readings of whole records would be taken for it."""
AT_ONCE = 30
"""Simulated records without a line that are weighed side by side."""


class ChannelSamples(NamedTuple):
    """A channel that reads something.

    - `label`: of a line's angle. - `rows`: its samples; of each, `since` [s] when its record began,
      and its `weight`: minus the curvature of the log-likelihood by the reading. - `interval` [s].
    """

    label: str
    rows: np.ndarray
    since: np.ndarray
    weight: np.ndarray
    interval: float


class ChannelSpectrum(NamedTuple):
    """A channel in which a line is looked for.

    - `label`: of the line's angle. - `rows`: its samples, `at` (rows,): their places on an even
      grid from the first on. - `spectrum`: of the grid at all frequencies; `late` (frequencies,):
      turns it to where the record began, and is 0 where a line is too slow to be one.
    - `known` (3, frequencies): information of sine, of both, of cosine, per unit of the reading.
    """

    label: str
    rows: np.ndarray
    at: np.ndarray
    spectrum: ZoomFFT
    late: np.ndarray
    known: np.ndarray

    def slopes(self, score: np.ndarray) -> np.ndarray:
        """Slope of the log-likelihood by sine and cosine (2, draws, frequencies).

        - `score` (n, draws): by every sample.
        """
        series = np.zeros((int(self.at[-1]) + 1, score.shape[1]))
        series[self.at] = score[self.rows]
        found = self.spectrum(series.T) * self.late
        return np.stack([-found.imag, found.real])


class Weighing(NamedTuple):
    """How channels of one quantity weigh a line.

    - `channels`: those of the quantity. - `inverse` (3, sizes, channels, frequencies): of the
      information with the prior in, for all amplitudes that are averaged over.
    - `room` (sizes, frequencies): what the room for a line costs. - `log_mass` (sizes,
      frequencies): of the amplitudes' prior.
    """

    channels: tuple[ChannelSpectrum, ...]
    inverse: np.ndarray
    room: np.ndarray
    log_mass: np.ndarray

    def of_sizes(self, score: np.ndarray) -> np.ndarray:
        """Log Bayes factor times the prior of each size (frequencies, sizes, draws)."""
        slope = np.stack([one.slopes(score) for one in self.channels], axis=1)
        products = np.stack([slope[0] ** 2, 2.0 * slope[0] * slope[1], slope[1] ** 2])
        frequencies, sizes = self.room.T.shape
        inverse = self.inverse.transpose(3, 1, 0, 2).reshape(frequencies, sizes, -1)
        each = products.transpose(3, 0, 1, 2).reshape(frequencies, inverse.shape[-1], -1)
        return 0.5 * inverse @ each - (self.room - self.log_mass).T[:, :, None]

    def likeliest(self, score: np.ndarray, frequency: int) -> "Likeliest":
        """Return what line of a frequency, by its number, the channels read most likely."""
        one = score[:, None]
        sine, cosine = np.stack([c.slopes(one)[:, 0, frequency] for c in self.channels], axis=1)
        likeliest = int(np.argmax(self.of_sizes(one)[frequency, :, 0]))
        first, both, second = self.inverse[:, likeliest, :, frequency]
        parts = np.stack([first * sine + both * cosine, both * sine + second * cosine])
        angles = np.arctan2(parts[1], parts[0])
        u, v = np.cos(angles), np.sin(angles)
        known = np.stack([one.known[:, frequency] for one in self.channels], axis=1)
        return Likeliest(
            float(np.sqrt(np.mean(np.sum(parts**2, axis=0)))),
            angles,
            float(np.sum(u * sine + v * cosine)),
            float(np.sum(u**2 * known[0] + 2.0 * u * v * known[1] + v**2 * known[2])),
        )


class Likeliest(NamedTuple):
    """A line in all channels of one quantity.

    - `amplitude` [SI]; `angles` (channels,) [rad].
    - `slope`, `information`: of the log-likelihood by an amplitude that all channels share.
    """

    amplitude: float
    angles: np.ndarray
    slope: float
    information: float


def picked_up(fit: Fitted, effect: type[AbstractEffect]) -> Line | None:
    """Find the likeliest line that sensors pick up; None where none could be told.

    - `effect`: one that sensors pick up.
    """
    local = fit.local
    assert effect.beat is not None  # the caller asks
    priors = priors_of(effect, dict(local.hypothesis.given))
    frequencies = _grid(local, priors[effect.beat][1])
    if len(frequencies) < FINER:
        return None
    units = {REFERENCE: 1.0} | {q: _median(priors[label][1]) for q, label in effect.ratios.items()}
    _, absent, prior = amplitude_of(priors)
    sizes = np.asarray(prior.from_standard(QUANTILES)) - absent
    labels = picking_up([effect], local.layout.problem.tracks)
    spectra = _spectra(local, labels, frequencies)
    weighings = {q: weighing(channels, sizes * units[q]) for q, channels in spectra.items()}
    law = log_prior_of(priors[effect.beat][1], frequencies)

    def weigh(by: Mapping[str, Weighing], score: np.ndarray) -> np.ndarray:
        each = (w.of_sizes(score).swapaxes(1, 2) for w in by.values())
        return law[:, None] + sum(log_sum(one) for one in each)

    def chances() -> Iterator[float]:
        few = {q: weighing(w.channels, sizes * units[q], BY_CHANCE) for q, w in weighings.items()}
        for some in np.array_split(noise(local).T, CHANCES // AT_ONCE, axis=1):
            yield from log_sum(weigh(few, some).T).tolist()

    each = weigh(weighings, local.terms.score[:, None])[:, 0]
    best = int(np.argmax(each))
    every = ((q, one.likeliest(local.terms.score, best)) for q, one in weighings.items())
    found = {q: one for q, one in every if one.amplitude > 0.0}
    if not found:
        return None
    unit = min(found, key=lambda q: q != REFERENCE)
    reference = found[unit].amplitude / units[unit]
    ratios = {q: one.amplitude / reference for q, one in found.items()}
    slope = np.sum([ratios[q] * one.slope for q, one in found.items()])
    information = np.sum([ratios[q] ** 2 * one.information for q, one in found.items()])
    angles = (
        (channel.label, float(angle))
        for q, one in found.items()
        for channel, angle in zip(weighings[q].channels, one.angles, strict=True)
    )
    return Line(
        float(frequencies[best]),
        tuple(angles),
        # Each channel has an amplitude of its own here: what that explains more, no refit does.
        min(total(each) - float(log_bayes(slope, information, amplitudes(prior, absent))), 0.0),
        tuple(chances()),
        tuple((effect.ratios[q], ratio) for q, ratio in ratios.items() if q != REFERENCE),
    )


def _median(prior: AbstractPrior) -> float:
    return float(prior.from_standard(0.0))


def _grid(local: LocalFit, prior: AbstractPrior) -> np.ndarray:
    """Frequencies [Hz] that are tried, evenly spaced."""
    low, high = (float(prior.from_standard(z)) for z in (-SPREAD, SPREAD))
    longest = max(float(t.interval * t.samples) for t in local.layout.problem.tracks)
    return low + np.arange(0.0, high - low, 1.0 / (FINER * longest))


def _spectra(
    local: LocalFit, labels: Mapping[Channel, str], frequencies: np.ndarray
) -> dict[str, tuple[ChannelSpectrum, ...]]:
    """Channels that read something, by quantity."""
    found: dict[str, tuple[ChannelSpectrum, ...]] = {}
    for number, channel in enumerate(local.layout.channels):
        label = labels.get(Channel(channel.track, channel.quantity))
        rows = np.flatnonzero((local.layout.channel == number) & local.layout.read)
        if label is None or local.terms.curvature[rows].sum() <= 0.0:
            continue
        since = local.layout.time[rows] - float(local.layout.problem.track(channel.track).first)
        samples = ChannelSamples(label, rows, since, local.terms.curvature[rows], channel.interval)
        spectrum = spectrum_of(samples, frequencies)
        found[channel.quantity] = (*found.get(channel.quantity, ()), spectrum)
    return found


def spectrum_of(samples: ChannelSamples, frequencies: np.ndarray) -> ChannelSpectrum:
    """Return the spectrum of a channel at the `frequencies` [Hz]."""
    since = samples.since
    at = np.round((since - since[0]) / samples.interval).astype(int)
    weight = np.zeros(int(at[-1]) + 1)
    weight[at] = samples.weight
    low, high = frequencies[0], 2.0 * frequencies[-1] - frequencies[-2]

    def spectrum(times: float) -> ZoomFFT:
        ends = [2.0 * times * samples.interval * f for f in (low, high)]
        return ZoomFFT(len(weight), ends, len(frequencies))

    seen = np.abs(alias(frequencies, samples.interval)) * (since[-1] - since[0]) >= TURNS
    late = np.exp(-2j * np.pi * frequencies * since[0]) * seen
    double, whole = spectrum(2.0)(weight) * late**2, weight.sum() * seen
    known = 0.5 * np.stack([whole - double.real, -double.imag, whole + double.real])
    return ChannelSpectrum(samples.label, samples.rows, at, spectrum(1.0), late, known)


def alias(frequencies: np.ndarray, interval: float) -> np.ndarray:
    """Where lines appear [Hz], up to half the sampling frequency either way.

    - `interval` [s]: between samples.
    """
    return frequencies - np.round(frequencies * interval) / interval


def weighing(
    channels: tuple[ChannelSpectrum, ...], listed: np.ndarray, most: float = math.inf
) -> Weighing:
    """Return how channels weigh a line.

    - `listed`, `most`: its amplitudes, as in `Sizes.of`.
    """
    first, both, second = np.stack([one.known for one in channels], axis=1)[:, None]
    sizes = Sizes.of(listed, 0.5 * (first + second).sum(axis=(0, 1)), most)
    variance = 0.5 * sizes.at[:, None] ** 2
    held, kept = first + 1.0 / variance, second + 1.0 / variance
    product = held * kept - both**2
    inverse = np.stack([kept, -both * np.ones_like(kept), held]) / product
    room = 0.5 * np.sum(np.log(variance**2 * product), axis=1)
    return Weighing(channels, inverse, room, sizes.log_mass)

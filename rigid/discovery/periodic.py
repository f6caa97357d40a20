"""Whether records beat at one frequency, each with a phase of its own: the pump's ripple.

A beat is a line of a tenth of a hertz somewhere in a prior of some octaves; a few settings of it
would miss it. All of them are weighed instead. How strongly a record answers changes slowly with
frequency, so few simulations tell it for all. With that the evidence for a line is one sum over
frequencies and amplitudes, the phases integrated over: of a record whose residuals go by G at a
frequency, the mean over all phases of its likelihood ratio is I_0(a |G|) exp(-a^2 J/2).
"""

import itertools
import math
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.signal import ZoomFFT
from scipy.special import i0e, logsumexp
from scipy.stats import norm

from rigid.discovery.fitted import Fitted
from rigid.effects import AbstractEffect
from rigid.likelihood.per_record import beating
from rigid.likelihood.priors import AbstractPrior, make_prior
from rigid.likelihood.tracks import Track
from rigid.localfit.candidates import Candidate, all_standard_of, amplitude_of, priors_of
from rigid.localfit.evidence import amplitudes, log_bayes
from rigid.localfit.local import LocalFit
from rigid.localfit.samples import ChannelKey
from rigid.localfit.signature import signatures

SPREAD = 2.0
"""Sds of the frequency's prior, either way, that are searched."""
ANSWERS = 12
"""Frequencies at which the records' answers are simulated; between them they are interpolated."""
FINER = 3
"""Frequencies tried in one over the longest time that a valve is open."""
CHANCES = 300
"""Simulated records without a line."""
QUANTILES = np.linspace(-4.0, 4.0, 33)
"""Of the amplitude's prior, on the standard normal scale, over which evidence is summed."""
MASS = norm.pdf(QUANTILES) / norm.pdf(QUANTILES).sum()
UNSEEN, BY_CHANCE = 0.03, 30.0
"""Amplitudes, in the sd that the records leave: up to the one a line is as good as none, beyond the
other chance makes none, and sums over amplitudes where there is no line need not go further."""


class Line(NamedTuple):
    """The likeliest frequency at which the records beat.

    - `frequency` [Hz]. - `angles`: label and value [rad] of the pump's angle in each record, or of
      that of a line in each channel.
    - `log_share`: log of the share of all settings that it stands for. - `chance`: log Bayes
      factors of a line in simulated records that have none. - `ratios`: label and value of what
      amplitudes of some channels are over those of others.
    """

    frequency: float
    angles: tuple[tuple[str, float], ...]
    log_share: float
    chance: tuple[float, ...]
    ratios: tuple[tuple[str, float], ...] = ()

    def candidate(self, effect: type[AbstractEffect], given: dict[str, AbstractPrior]) -> Candidate:
        """Return the effect with these numbers, every angle's prior turned so as to be around it.

        All angles are alike, but a posterior that is cut in two by the end of its prior is no bell.
        """
        priors = priors_of(effect, given)
        amplitude, absent, prior = amplitude_of(priors)
        assert effect.beat is not None  # the caller asks
        shape = {amplitude: absent, effect.beat: self.frequency}
        shape |= dict(self.angles) | dict(self.ratios)
        around = {
            label: make_prior("uniform", {"low": at - math.pi, "high": at + math.pi}, label)
            for label, at in self.angles
            if label not in given
        }
        return Candidate(
            effect, amplitude, absent, prior, shape,
            log_share=self.log_share, priors=around, chance=tuple(self.chance),
        )  # fmt: skip


class Sizes(NamedTuple):
    """Amplitudes over which evidence is summed.

    - `at` (sizes, frequencies) [SI]. - `log_mass` (sizes, frequencies): of their prior.
    """

    at: np.ndarray
    log_mass: np.ndarray

    @classmethod
    def of(cls, listed: np.ndarray, known: np.ndarray, most: float = math.inf) -> "Sizes":
        """Take at each frequency the amplitudes that may matter there.

        - `listed` (QUANTILES,) [SI]: of the prior. - `known` (frequencies,) [1/SI^2]: what the
          records know of an amplitude. - `most`: of the greatest, in the sd that they leave.

        The first stands for all that are smaller.
        """
        order = np.argsort(np.abs(listed), kind="stable")
        sizes, below = np.abs(listed)[order], np.cumsum(MASS[order])
        told = sizes[:, None] * np.sqrt(known)
        first = np.maximum((told < UNSEEN).sum(axis=0) - 1, 0)
        last = np.minimum((told <= most).sum(axis=0), len(sizes) - 1)
        count = int(np.max(last - first)) + 1
        first = np.minimum(first, len(sizes) - count)
        at = first + np.arange(count)[:, None]
        mass = np.where(at == first, below[at], MASS[order][at])
        return cls(sizes[at], np.log(mass))


class BeatingChannel(NamedTuple):
    """A channel of a record in which the pump beats: its number, and that of its angle."""

    number: int
    channel: ChannelKey
    track: Track
    angle: int


class Answers(NamedTuple):
    """What all samples answer to a unit of the effect at few frequencies.

    - `frequencies` [Hz]. - `columns`: to sin and cos of each in turn.
    """

    frequencies: Float[np.ndarray, " few"]
    columns: Float[np.ndarray, "n 2*few"]


class ChannelResponse(NamedTuple):
    """How one channel answers to a beat.

    - `angle`: number of its record's angle. - `rows`: its samples while the valve is open,
      `at` (rows,): their places on an even grid from `begin` [s], of which `spectrum` is taken.
    - `answer` (frequencies,): complex amplitude of its reading to a unit of the effect.
    - `weight`: half the sum of what its samples count.
    """

    angle: int
    rows: np.ndarray
    at: np.ndarray
    begin: float
    spectrum: ZoomFFT
    answer: np.ndarray
    weight: float


class BeatSearch(NamedTuple):
    """Where a beat is looked for: labels of the pump's angles, frequencies tried [Hz], channels."""

    angles: tuple[str, ...]
    frequencies: np.ndarray
    channels: tuple[ChannelResponse, ...]

    def gradients(self, score: np.ndarray) -> np.ndarray:
        """How residuals go by a beat (..., angles, frequencies).

        - `score` (..., n): slope of the log-likelihood by every sample.
        """
        shape = (*score.shape[:-1], len(self.angles), len(self.frequencies))
        out = np.zeros(shape, dtype=complex)
        for one in self.channels:
            series = np.zeros((*score.shape[:-1], int(one.at[-1]) + 1))
            series[..., one.at] = score[..., one.rows]
            late = np.exp(-2j * np.pi * self.frequencies * one.begin)
            out[..., one.angle, :] += one.answer * np.conj(one.spectrum(series) * late)
        return out

    def known(self) -> np.ndarray:
        """What is known of a beat's size (angles, frequencies)."""
        out = np.zeros((len(self.angles), len(self.frequencies)))
        for one in self.channels:
            out[one.angle] += np.abs(one.answer) ** 2 * one.weight
        return out


def lines(fit: Fitted, effect: type[AbstractEffect]) -> Line | None:
    """Find the likeliest line; None where no valve is open for long enough.

    - `effect`: one that beats.
    """
    local = fit.local
    assert effect.beat is not None  # the caller asks
    priors = priors_of(effect, dict(local.hypothesis.given))
    search = _search(fit, effect, priors[effect.beat][1])
    if search is None:
        return None
    (_, absent, prior), known = amplitude_of(priors), search.known()
    listed = np.asarray(prior.from_standard(QUANTILES)) - absent
    of_all = known.sum(axis=0)
    weigh = partial(
        log_bayes_of_line,
        known=known,
        log_prior=log_prior_of(priors[effect.beat][1], search.frequencies),
    )
    gradients = search.gradients(local.terms.score)
    each = weigh(gradients, sizes=Sizes.of(listed, of_all))
    best = int(np.argmax(each))
    gradient, size = np.abs(gradients[:, best]).sum(), known[:, best].sum()
    few = Sizes.of(listed, of_all, BY_CHANCE)
    share = total(each) - float(log_bayes(gradient, size, amplitudes(prior, absent)))
    turned = np.mod(1.5 * math.pi - np.angle(gradients[:, best]), 2.0 * math.pi) - math.pi
    return Line(
        float(search.frequencies[best]),
        tuple(zip(search.angles, turned.tolist(), strict=True)),
        share,
        tuple(total(weigh(one, sizes=few)) for one in search.gradients(noise(local))),
    )


def _search(fit: Fitted, effect: type[AbstractEffect], prior: AbstractPrior) -> BeatSearch | None:
    """Where a beat of this prior is looked for; None where no two frequencies could be parted."""
    local = fit.local
    labels = beating([effect], local.layout.problem.tracks)
    angles = tuple(dict.fromkeys(labels.values()))
    tracks = {t.label: t for t in local.layout.problem.tracks}
    channels = [
        BeatingChannel(number, channel, tracks[channel.track], angles.index(labels[channel.track]))
        for number, channel in enumerate(local.layout.channels)
        if channel.track in labels
    ]
    frequencies = _grid(local, prior, channels)
    if len(frequencies) < FINER:
        return None
    some = np.geomspace(frequencies[0], frequencies[-1], ANSWERS)
    two = [
        Line(float(f), tuple((label, at) for label in angles), 0.0, ()).candidate(
            effect, dict(local.hypothesis.given)
        )
        for f, at in itertools.product(some, (0.0, 0.5 * math.pi))
    ]
    answers = Answers(some, signatures(local, fit.programs, two))
    responses = (_response(local, one, frequencies, answers) for one in channels)
    return BeatSearch(angles, frequencies, tuple(one for one in responses if one is not None))


def _response(
    local: LocalFit, one: BeatingChannel, frequencies: np.ndarray, answers: Answers
) -> ChannelResponse | None:
    """Return how a channel answers at the `frequencies`, interpolated between the `answers`."""
    rows, interval = _open(local, one), one.channel.interval
    weight = local.terms.curvature[rows]
    if weight.sum() <= 0.0:
        return None
    some, columns = answers
    since = local.layout.time[rows] - float(one.track.first)
    # To sin(w t) and cos(w t): imaginary and real part of the answer times exp(i w t).
    waves = columns[rows, 1::2] + 1j * columns[rows, ::2]
    mean = weight @ (waves * np.exp(-2j * np.pi * some * since[:, None])) / weight.sum()
    answer = np.exp(
        np.interp(frequencies, some, np.log(np.maximum(np.abs(mean), 1e-300)))
        + 1j * np.interp(frequencies, some, np.unwrap(np.angle(mean)))
    )
    answer[frequencies > 0.5 / interval] = 0.0
    at = np.round((since - since[0]) / interval).astype(int)
    ends = [2.0 * interval * f for f in (frequencies[0], 2.0 * frequencies[-1] - frequencies[-2])]
    spectrum = ZoomFFT(int(at[-1]) + 1, ends, len(frequencies))
    known = 0.5 * float(weight.sum())
    return ChannelResponse(one.angle, rows, at, float(since[0]), spectrum, answer, known)


def _open(local: LocalFit, one: BeatingChannel) -> np.ndarray:
    """Samples of a channel that were read while the pump fed its record."""
    rows = np.flatnonzero((local.layout.channel == one.number) & local.layout.read)
    assert one.track.drive is not None  # the pump fed it
    levels = np.asarray(one.track.drive.levels)
    return rows[levels[np.searchsorted(one.track.drive.switches, local.layout.time[rows])] == 1]


def _grid(local: LocalFit, prior: AbstractPrior, channels: Sequence[BeatingChannel]) -> np.ndarray:
    """Frequencies [Hz] that are tried, evenly spaced; none where no line could be parted."""
    low, high = (float(prior.from_standard(z)) for z in (-SPREAD, SPREAD))
    spans = [len(_open(local, one)) * one.channel.interval for one in channels]
    top = min(high, max((0.5 / one.channel.interval for one in channels), default=0.0))
    count = int(FINER * max(spans, default=0.0) * max(top - low, 0.0))
    return low + (top - low) / max(count, 1) * np.arange(count)


def log_prior_of(prior: AbstractPrior, frequencies: np.ndarray) -> np.ndarray:
    """Log of the prior of each frequency tried, one of which it is."""
    edges = np.append(frequencies, 2.0 * frequencies[-1] - frequencies[-2])
    below = norm.cdf(all_standard_of(prior, edges))
    logs = np.log(np.maximum(np.diff(below), 1e-300))
    return logs - np.asarray(logsumexp(logs))


def log_bayes_of_line(
    gradients: np.ndarray, known: np.ndarray, sizes: Sizes, log_prior: np.ndarray
) -> np.ndarray:
    """Log Bayes factor of a beat of each frequency times its prior (frequencies,).

    Amplitude and phases are averaged over.

    - `gradients`, `known` (angles, frequencies). - `sizes`. - `log_prior` (frequencies,).
    """
    argument = sizes.at[:, None] * np.abs(gradients)
    mean = np.sum(np.log(i0e(argument)) + argument, axis=1)
    each = mean - 0.5 * sizes.at**2 * known.sum(axis=0) + sizes.log_mass
    return np.asarray(logsumexp(each, axis=0)) + log_prior


def total(logs: np.ndarray) -> float:
    """Logarithm of a sum of exponentials."""
    return float(np.asarray(logsumexp(logs)))


def noise(local: LocalFit) -> np.ndarray:
    """Slopes of the log-likelihood in records whose residuals are noise (CHANCES, n)."""
    rng = np.random.default_rng(CHANCES)
    spread = np.sqrt(np.maximum(local.terms.curvature, 0.0))
    return rng.standard_normal((CHANCES, len(spread))) * spread

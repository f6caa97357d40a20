"""Laws of stationary noise, fitted to a periodogram: white, autoregressive, or with slow parts.

A converter's rounding is white beside a sensor that drifts, and drifts are slower than a few lags
show: an autoregression of eight finds a third of the memory of noise of which 30 % lasts for fifty
samples. So noise may also be a sum of white noise and one or two parts that each fade
exponentially. Which it is, Whittle's likelihood tells (Whittle 1953, Ark. Mat. 2), at a price for
every number.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter

from rigid.likelihood.periodogram import Classes, Found

MAX_ORDER = 8
"""Of an autoregression, for noise that beats; parts that fade stand for longer memory."""
MEMORIES = 24
"""Memories that are tried, from one sample to a sixth of the series."""
ROUNDS, FIRST_ROUNDS, NEAR = 60, 12, 32
"""In which the sizes of parts settle (multiplicative updates; Fevotte and Idier 2011, Neural
Computation 23, eq. 12, which never lead down); after the first of them so many of the likeliest
memories go on, and no others."""
FAINT = 1e-9
"""Share of the variance below which a part is not there."""
LONGEST = 500.0
"""Greatest sum of autocorrelations [samples]: a channel whose residuals are all trend still counts
as something."""
SETTLED = 5.0
"""Memories in which simulated noise forgets that it began."""
LEAST_GAIN = 1e-6
"""Of an autoregression's answer to a constant."""
TELLING = 0.2
"""Share that has to be left at a frequency whose period is that of the longest memory: of slower
parts the tail alone would be seen, which is the same for all."""


class NoiseLaw(NamedTuple):
    """r[k] = sum coefficients[j] r[k-1-j] + e[k] + sum averages[j] e[k-1-j].

    - `coefficients` (p,), `averages` (q,). - `time` [samples]: sum of all autocorrelations, at
      least 1. - `variance`: of the innovations e. - `memory` [samples]: of its slowest part.
    """

    coefficients: np.ndarray
    time: float
    variance: float = 1.0
    averages: np.ndarray = np.zeros(0)
    memory: float = 0.0

    @property
    def settling(self) -> int:
        """Samples in which noise forgets that it began."""
        return int(np.ceil(SETTLED * self.memory))

    @property
    def power(self) -> float:
        """Variance of the noise."""
        begin = np.eye(1, 1 + self.settling)[0]
        answer = np.asarray(lfilter([1.0, *self.averages], [1.0, *-self.coefficients], begin))
        return self.variance * float(np.sum(answer**2))


WHITE = NoiseLaw(np.zeros(0), 1.0)


class Fit(NamedTuple):
    """A law, and twice what it costs in Whittle's log-likelihood and for its numbers."""

    cost: float
    law: NoiseLaw


def law_of(found: Found, price: float) -> NoiseLaw:
    """Fit the law of a series' noise.

    - `price`: of a number, in twice the log-likelihood: log n for BIC.
    """
    if found.empty:
        return WHITE._replace(variance=0.0)
    return scaled(_cheapest(_fits(found, price)).law, found.level)


def swings(found: Found, price: float) -> bool:
    """Whether an autoregression is likelier than any sum of parts, and by more than a number."""
    parts, swings = _fits(found, price)
    return swings.cost + price < parts.cost


def _fits(found: Found, price: float) -> tuple[Fit, Fit]:
    """The likeliest of white noise and parts that fade, and of autoregressions."""
    whittle = Whittle.of([found], price)
    parts = [whittle.white(), *whittle.fading()]
    swings = [*whittle.autoregressive(found.fine)] or parts
    return _cheapest(parts), _cheapest(swings)


def _cheapest(fits: Sequence[Fit]) -> Fit:
    return min(fits, key=lambda fit: fit.cost)


def scaled(law: NoiseLaw, level: float) -> NoiseLaw:
    """Return a law with the variance of its innovations multiplied."""
    return law._replace(variance=level * law.variance)


class Tried(NamedTuple):
    """Laws of white noise and parts that fade.

    - `size` (m, 1 + k): variances of the white noise and of the parts. - `decay` (m, k).
    - `cost` (m,): twice what they cost in Whittle's log-likelihood. - `of`: how many they are the
      likeliest of.
    """

    size: np.ndarray
    decay: np.ndarray
    cost: np.ndarray
    of: int


class Whittle(NamedTuple):
    """What laws of noise with a variance of 1 are held against.

    - `power`, `weight` (b,): of the classes of all series, each over its level. - `classes`: of
      each series. - `price`: of a number.
    """

    power: np.ndarray
    weight: np.ndarray
    classes: tuple[Classes, ...]
    price: float

    @classmethod
    def of(cls, found: Sequence[Found], price: float) -> "Whittle":
        """Put series together."""
        power = np.concatenate([one.power / one.level for one in found])
        weight = np.concatenate([one.weight for one in found])
        return cls(power, weight, tuple(Classes.of(len(one.fine)) for one in found), price)

    def mean(self, spectrum: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Means in all classes (..., b) of a spectrum, which takes turns (m,) to (..., m)."""
        return np.concatenate([c.mean(spectrum(c.turn)) for c in self.classes], axis=-1)

    def cost(self, spectrum: np.ndarray) -> np.ndarray:
        """Twice minus the log-likelihood of spectra (..., b)."""
        return np.asarray(2.0 * (np.log(spectrum) + self.power / spectrum) @ self.weight)

    def level(self, shape: np.ndarray) -> float:
        """What a spectrum of a known shape (b,) is best multiplied by."""
        return float(np.sum(self.weight * self.power / shape) / self.weight.sum())

    def white(self) -> Fit:
        """Noise without memory."""
        return Fit(float(self.cost(np.ones_like(self.power))) + self.price, WHITE)

    def fading(self) -> Iterator[Fit]:
        """White noise with one part that fades, and with two."""
        return map(self.best, self.tried())

    def tried(self) -> Iterator[Tried]:
        """The likeliest of all memories that are tried, of one part that fades and of two."""
        turn, size = self.mean(np.asarray), np.concatenate([c.sizes for c in self.classes])
        lowest = turn[self.weight > TELLING * size].min(initial=np.pi)
        decay = np.exp(-1.0 / np.geomspace(1.0, max(1.0 / lowest, 2.0), MEMORIES))
        parts = self.mean(lambda turn: _fading(decay[:, None], turn))
        one = np.ones_like(self.power)
        alone, pairs = np.arange(MEMORIES)[:, None], np.stack(np.triu_indices(MEMORIES, 1), axis=1)
        for which in (alone, pairs):
            shapes = np.concatenate(
                [np.broadcast_to(one, (len(which), 1, len(one))), parts[which]], axis=1
            )
            even = np.full(shapes.shape[:2], 1.0 / shapes.shape[1])
            size, cost = self._sizes(shapes, even, FIRST_ROUNDS)
            near = np.argsort(cost)[:NEAR]
            size, cost = self._sizes(shapes[near], size[near], ROUNDS - FIRST_ROUNDS)
            yield Tried(size, decay[which[near]], cost, len(which))

    def best(self, tried: Tried) -> Fit:
        """Return the likeliest of some laws."""
        best = int(np.argmin(tried.cost))
        law = of_parts(tried.size[best, 0], tried.size[best, 1:], tried.decay[best])
        return Fit(float(tried.cost[best]) + self.price * (1 + 2 * tried.decay.shape[1]), law)

    def log_weights(self, tried: Sequence[Tried]) -> np.ndarray:
        """Log of how likely white noise is and each law that was `tried`, all in a row.

        Sizes cost their price; all memories are alike beforehand.
        """
        logs = [-0.5 * np.array([self.white().cost])]
        for one in tried:
            sizes = 1 + one.decay.shape[1]
            logs.append(-0.5 * (one.cost + self.price * sizes) - np.log(one.of))
        return np.concatenate(logs)

    def _sizes(
        self, shapes: np.ndarray, size: np.ndarray, rounds: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Sizes (m, k) of spectra (m, k, b) whose sum is likely, and what they cost (m,).

        - `size` (m, k): where to begin.
        """
        for _ in range(rounds):
            total = np.matmul(size[:, None], shapes)[:, 0]
            share = self.weight / total
            up = np.matmul(shapes, (share * self.power / total)[:, :, None])[:, :, 0]
            down = np.matmul(shapes, share[:, :, None])[:, :, 0]
            size = np.maximum(size * np.sqrt(up / down), 1e-300)
        return size, self.cost(np.matmul(size[:, None], shapes)[:, 0])

    def autoregressive(self, fine: np.ndarray) -> Iterator[Fit]:
        """Autoregressions by Yule and Walker of every order, from a periodogram (m,)."""
        covariance = np.fft.irfft(np.append(fine[0], fine))
        for order in range(1, min(MAX_ORDER, len(fine) // 5) + 1):
            pull = solve_toeplitz(covariance[:order], covariance[1 : order + 1])
            shape = self.mean(lambda turn, pull=pull: _answering(pull, turn))
            level = self.level(shape)
            rest = 1.0 - float(pull @ covariance[1 : order + 1]) / covariance[0]
            time = rest / max(1.0 - float(pull.sum()), LEAST_GAIN) ** 2
            law = NoiseLaw(pull, bounded(time), level, memory=_memory(np.abs(_poles(pull))))
            yield Fit(float(self.cost(level * shape)) + self.price * (1 + order), law)


def _answering(pull: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Spectrum of an autoregression (order,) with innovations of variance 1."""
    return 1.0 / np.abs(np.fft.rfft(np.append(1.0, -pull), 2 * len(turn))[1:]) ** 2


def _fading(decay: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Spectrum of a part of variance 1 of which a share `decay` is left a sample later."""
    return (1.0 - decay**2) / (1.0 - 2.0 * decay * np.cos(turn) + decay**2)


def of_parts(white: float, sizes: np.ndarray, decays: np.ndarray) -> NoiseLaw:
    """Law of white noise and parts that fade, (k,) each, by their variances."""
    there = sizes > FAINT * (white + sizes.sum())
    sizes, decays = sizes[there], decays[there]
    poles = [np.array([1.0, -decay]) for decay in decays]
    bottom = _product(poles)
    top = white * _autocorrelation(bottom)
    for i, (size, decay) in enumerate(zip(sizes, decays, strict=True)):
        others = _product([pole for j, pole in enumerate(poles) if j != i])
        more = size * (1.0 - decay**2) * _autocorrelation(others)
        top = top + np.pad(more, (0, len(top) - len(more)))
    averages, variance = _factor(top)
    time = float(times_of(np.append(white, sizes), decays))
    return NoiseLaw(-bottom[1:], bounded(time), variance, averages, _memory(decays))


def times_of(size: np.ndarray, decay: np.ndarray) -> np.ndarray:
    """Sums of all autocorrelations (...,) of white noise and parts that fade.

    - `size` (..., 1 + k): variances of the white noise and of the parts. - `decay` (..., k): share
      of a part that is left a sample later.
    """
    lasting = np.sum(size[..., 1:] * (1.0 + decay) / (1.0 - decay), axis=-1)
    return np.asarray((size[..., 0] + lasting) / size.sum(axis=-1))


def _product(polynomials: list[np.ndarray]) -> np.ndarray:
    out = np.ones(1)
    for one in polynomials:
        out = np.convolve(out, one)
    return out


def _autocorrelation(polynomial: np.ndarray) -> np.ndarray:
    """Sums of products of coefficients with those so many further on, from 0 on."""
    return np.correlate(polynomial, polynomial, "full")[len(polynomial) - 1 :]


def _factor(covariance: np.ndarray) -> tuple[np.ndarray, float]:
    """Moving average (q,) and variance of its innovations that have a covariance (q + 1,)."""
    while len(covariance) > 1 and abs(covariance[-1]) < FAINT * covariance[0]:
        covariance = covariance[:-1]
    order = len(covariance) - 1
    if not order:
        return np.zeros(0), float(covariance[0])
    roots = np.roots(np.append(covariance[::-1], covariance[1:]))
    inside = roots[np.argsort(np.abs(roots))][:order]
    averages = np.real(np.poly(inside))[1:]
    return averages, float(covariance[0] / (1.0 + averages @ averages))


def _poles(coefficients: np.ndarray) -> np.ndarray:
    return np.roots([1.0, *-coefficients])


def _memory(decays: np.ndarray) -> float:
    """Samples in which the slowest of decays (k,) leaves 1/e."""
    slowest = float(np.clip(decays, 1e-9, 1.0 - 1.0 / LONGEST).max(initial=1e-9))
    return float(-1.0 / np.log(slowest))


def bounded(time: float) -> float:
    """Return a sum of autocorrelations [samples] from 1 to LONGEST."""
    return float(np.clip(time, 1.0, LONGEST))

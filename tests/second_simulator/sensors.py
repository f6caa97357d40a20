"""The analogue chain: low-pass by averaging, sample and hold, gain and zero, noise, converter."""

from dataclasses import dataclass

import numpy as np

NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)
SHEETS = {  # sd of gain, sd of zero, noise, step: as a spec states them where it states nothing
    "load": (1e-3, 100.0, 147.5, 295.0),
    "stroke": (1e-3, 0.12e-3, 0.055e-3, 0.22e-3),
    "pressure": (1e-3, 25e3, 11491.0, 34474.0),
    "acceleration": (1e-2, 0.05, 0.35, 200.0 * 9.80665 / 32768),
}


@dataclass(frozen=True)
class Chain:
    """How a record is taken.

    - window: share of an interval over which the converter integrates; place: of its end on the
      instant of the sample, 0 end and 0.5 middle
    - jitter: sd of the sampling instants in intervals; cut: the converter cuts off, not rounds
    - colour: AR(1) coefficients between which each channel draws its own; slow: a second, slower
      part of the noise; tails: degrees of freedom of Student's t, scaled to the same variance
    - growing: share of the reading that adds to the noise; hum: amplitude in noise, at 50 Hz
    - spikes: share of samples hit; late: channels read late [s]
    """

    window: float = 0.0
    place: float = 0.0
    jitter: float = 0.0
    cut: bool = False
    step: float = 1.0
    noise: float = 1.0
    colour: tuple[float, float] = (0.0, 0.0)
    slow: float = 0.0
    tails: float = 0.0
    growing: float = 0.0
    hum: float = 0.0
    spikes: float = 0.0
    late: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class Sensor:
    """One sensor of a campaign, SI."""

    gain: float
    zero: float
    noise: float
    step: float
    colour: float


def drawn(chain: Chain, channel: str, rng: np.random.Generator) -> Sensor:
    """A sensor whose gain and zero are uniform with the sheet's sd, its noise near the sheet's."""
    gain, zero, noise, step = SHEETS[channel]
    wide = 3.0**0.5
    slow = channel != "acceleration"
    return Sensor(
        1.0 + gain * wide * rng.uniform(-1.0, 1.0),
        zero * wide * rng.uniform(-1.0, 1.0),
        noise * chain.noise * float(rng.uniform(0.85, 1.18)),
        step * (chain.step if slow else 1.0),
        float(rng.uniform(*chain.colour)),
    )


def instants(chain: Chain, times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """When samples are really taken [s], (n,)."""
    interval = times[1] - times[0]
    return times + chain.jitter * interval * rng.standard_normal(times.size)


def averaged(chain: Chain, times: np.ndarray, interval: float) -> np.ndarray:
    """Instants over which each sample is the weighted mean, (n, nodes)."""
    if chain.window == 0.0:
        return times[:, None]
    end = times + chain.place * chain.window * interval
    return end[:, None] + (NODES - 1.0) * 0.5 * chain.window * interval


def noise_of(chain: Chain, colour: float, times, rng: np.random.Generator) -> np.ndarray:
    """Noise of unit variance, (n,), by the chain's law; spikes and hum come on top."""
    n = times.size
    white = rng.standard_normal(n)
    if chain.tails:
        t = chain.tails
        white = rng.standard_t(t, n) * ((t - 2.0) / t) ** 0.5
    found = _coloured(white, colour, rng)
    if chain.slow:
        found = (1.0 - chain.slow) ** 0.5 * found
        found += chain.slow**0.5 * _coloured(rng.standard_normal(n), 0.98, rng)
    found += chain.hum * np.sin(2.0 * np.pi * (50.0 * times + rng.uniform()))
    hit = rng.uniform(size=n) < chain.spikes
    return found + hit * rng.choice((-1.0, 1.0), n) * rng.uniform(5.0, 20.0, n)


def _coloured(fresh: np.ndarray, colour: float, rng: np.random.Generator) -> np.ndarray:
    """AR(1) by its innovations, stationary from the first sample."""
    if colour == 0.0:
        return fresh
    from scipy.signal import lfilter

    found, _ = lfilter(
        [(1.0 - colour**2) ** 0.5], [1.0, -colour], fresh, zi=[colour * rng.standard_normal()]
    )
    return found


def converted(chain: Chain, sensor: Sensor, exact: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Codes of the converter, (n,) whole numbers."""
    read = sensor.gain * exact + sensor.zero
    # Growing noise: the sheet's at nothing, more of it in proportion to the reading's size.
    scale = sensor.noise * (1.0 + chain.growing * np.abs(exact) / max(np.ptp(exact), 1e-30))
    codes = (read + scale * noise) / sensor.step
    return (np.floor(codes) if chain.cut else np.round(codes)).astype(int)

"""Sensors and converters: gain, zero, noise, rounding to a step."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import accumulate

import numpy as np


@dataclass(frozen=True)
class Sensor:
    """One sensor with its converter, SI; it stays the same through a campaign.

    - gain: what it reads per unit of what is there
    - zero: what it reads of nothing
    - noise: standard deviation of one sample before conversion
    - step: of the converter; readings are whole multiples of it
    """

    gain: float
    zero: float
    noise: float
    step: float

    def reading(self, values: np.ndarray) -> np.ndarray:
        """Read true values without noise and before conversion."""
        return self.gain * values + self.zero

    def codes(self, values: np.ndarray, noise: np.ndarray, top: float | None = None) -> np.ndarray:
        """Convert true values to integer codes; `noise` is of unit variance, `top` the range's."""
        read = self.gain * values + self.zero + self.noise * noise
        if top is not None:
            read = np.minimum(read, top)
        return np.rint(read / self.step).astype(int)


@dataclass(frozen=True)
class Flaws:
    """What can be wrong with records though no physics is missing.

    - outliers: share of the samples that a spike has hit
    - tops: ends of the range of sensors ("pressure,A" -> SI) that saturate
    - tolerance: of the solver, where it is not the usual one
    """

    outliers: float = 0.0
    tops: Mapping[str, float] = field(default_factory=dict)
    tolerance: float | None = None


def spikes(rng: np.random.Generator, size: int, share: float) -> np.ndarray:
    """Spikes of 6 to 15 times the noise, either way, in a share of the samples; else zero."""
    hit = rng.uniform(size=size) < share
    return hit * rng.choice((-1.0, 1.0), size) * rng.uniform(6.0, 15.0, size)


def unit_noise(rng: np.random.Generator, size: int, correlation: float = 0.0) -> np.ndarray:
    """Stationary Gaussian noise of unit variance, AR(1) with the given coefficient."""
    fresh = rng.standard_normal(size)
    if correlation == 0.0:
        return fresh
    fresh[1:] *= np.sqrt(1.0 - correlation**2)
    return np.array(list(accumulate(fresh, lambda last, new: correlation * last + new)))

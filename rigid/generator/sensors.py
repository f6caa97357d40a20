"""Sensors and converters: gain, zero, noise, rounding to a step."""

from dataclasses import dataclass
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

    def codes(self, values: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """Convert true values to integer codes; `noise` is of unit variance."""
        read = self.gain * values + self.zero + self.noise * noise
        return np.rint(read / self.step).astype(int)


def unit_noise(rng: np.random.Generator, size: int, correlation: float = 0.0) -> np.ndarray:
    """Stationary Gaussian noise of unit variance, AR(1) with the given coefficient."""
    fresh = rng.standard_normal(size)
    if correlation == 0.0:
        return fresh
    fresh[1:] *= np.sqrt(1.0 - correlation**2)
    return np.array(list(accumulate(fresh, lambda last, new: correlation * last + new)))

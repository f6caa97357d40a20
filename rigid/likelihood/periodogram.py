"""What a series shows of its noise over frequency, and what a converter leaves of it."""

from typing import NamedTuple

import numpy as np

WIDENING = 1.12
"""Of a class of frequencies over the one before; the lowest frequencies stand alone."""
LEAST_LEFT = 0.02
"""Share of the noise, left at a frequency, below which that frequency does not count."""
LEAST_READ = 0.01
"""Of the power of noise so far, what is left of it at least where a converter's is taken off."""


class Classes(NamedTuple):
    """Frequencies of a series in classes.

    - `first` (b,): numbers of each class's first. - `sizes` (b,). - `turn` (m,): radians a sample.
    """

    first: np.ndarray
    sizes: np.ndarray
    turn: np.ndarray

    @classmethod
    def of(cls, frequencies: int) -> "Classes":
        """Part so many frequencies, those of a series of twice as many samples, without 0."""
        edges = [0]
        while edges[-1] < frequencies:
            wide = round(WIDENING * (edges[-1] + 1)) - 1
            edges.append(min(frequencies, max(edges[-1] + 1, wide)))
        turn = np.pi * np.arange(1, frequencies + 1) / max(frequencies, 1)
        return cls(np.array(edges[:-1], dtype=int), np.diff(edges).astype(float), turn)

    def spread(self, values: np.ndarray) -> np.ndarray:
        """Give all frequencies (m,) the values (b,) of their classes."""
        return np.repeat(values, self.sizes.astype(int))

    def mean(self, series: np.ndarray) -> np.ndarray:
        """Means of a series (..., m) in the classes (..., b)."""
        return np.add.reduceat(series, self.first, axis=-1) / self.sizes


def periodogram(series: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """Power of series (n, ...) at all frequencies but 0, on average over them (m,).

    - `valid` (n,): where they were read. From the first sample that was to the last, what was not
      counts as 0.
    """
    read = np.flatnonzero(valid)
    if len(read) < 2:
        return np.zeros(0)
    span = slice(int(read[0]), int(read[-1]) + 1)
    clean = np.where(valid[span].reshape(-1, *[1] * (series.ndim - 1)), series[span], 0.0)
    power = np.abs(np.fft.rfft(clean, axis=0)[1:]) ** 2 / len(read)
    return power.reshape(len(power), -1).mean(axis=1)


class Read(NamedTuple):
    """Power of noise, and of what a converter makes of it, in classes of frequencies (b,) each.

    Rounding takes a part of the noise and makes of slow noise some that is quick.

    - `gain`: share of the former that is left.
    """

    before: np.ndarray
    after: np.ndarray
    gain: float

    @classmethod
    def of(cls, before: np.ndarray, after: np.ndarray) -> "Read":
        """From mean periodograms (m,) before the converter and after it."""
        classes = Classes.of(len(before))
        if not len(before):
            return cls(before, after, 0.0)
        one, two = classes.mean(before), classes.mean(after)
        strength = classes.sizes @ one**2
        return cls(one, two, float(classes.sizes @ (one * two) / max(strength, 1e-300)))

    @property
    def made(self) -> np.ndarray:
        """Power of the quick noise."""
        return np.maximum(self.after - self.gain * self.before, 0.0)

    @property
    def told(self) -> np.ndarray:
        """How surely the noise is told beside the quick noise, 1 where there is none of that."""
        whole = self.gain * self.before + self.made
        return self.gain * self.before / np.where(whole > 0.0, whole, 1.0)


class Found(NamedTuple):
    """What a series shows of its noise.

    - `fine` (m,): its periodogram, as read. - `power`, `weight` (b,): in classes, and how many
      frequencies each stands for.
    """

    fine: np.ndarray
    power: np.ndarray
    weight: np.ndarray

    @classmethod
    def of(
        cls, power: np.ndarray, left: np.ndarray | None = None, read: Read | None = None
    ) -> "Found":
        """Lay out a periodogram (m,).

        - `left` (b,): share of the noise that is left in each class of frequencies, where some of
          it was taken out; 1 without it. - `read`: what a converter makes of the noise.
        """
        classes = Classes.of(len(power))
        seen = np.ones(len(classes.sizes)) if left is None else left
        good = seen > LEAST_LEFT
        fine = power / classes.spread(np.maximum(seen, LEAST_LEFT))
        mean = classes.mean(power) if len(power) else np.zeros(0)
        mean, told = mean / np.where(good, seen, 1.0), seen
        if read is not None and read.gain > 0.0:
            told = seen * read.told**2
            mean = np.maximum((mean - read.made) / read.gain, LEAST_READ * read.before)
        return cls(fine, np.where(good, mean, 0.0), np.where(good, classes.sizes * told, 0.0))

    @property
    def empty(self) -> bool:
        """Whether it shows nothing."""
        return not (self.power * self.weight).sum() > 0.0

    @property
    def level(self) -> float:
        """Mean power of all frequencies."""
        return float(self.weight @ self.power / self.weight.sum())

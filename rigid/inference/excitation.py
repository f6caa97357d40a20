"""At which frequencies records move the plunger: where they can say anything of its friction."""

from collections.abc import Iterable

import numpy as np

from rigid.inference.derived import LEVELS, ChannelDraws
from rigid.kinds import KINDS

OUTSIDE = 0.05
"""Part of the energy that lies below a band, and part that lies above it."""

Band = tuple[str, float, float]
"""What excites, lowest and highest frequency [Hz]."""


def excited(channels: Iterable[ChannelDraws]) -> tuple[Band, ...]:
    """Give the bands in which the plunger moves, one for each kind of record that tells.

    A band holds nine tenths of the energy of the plunger's velocity in every record of its kind,
    from the stroke or the acceleration that the posterior's median says the sensor should have
    read; that of a record that only rises and rests begins at half the frequency it could resolve.
    """
    bands: dict[str, list[tuple[float, float]]] = {}
    for channel in channels:
        spectrum = _velocity(channel)
        if KINDS[channel.kind].excites and spectrum is not None:
            bands.setdefault(channel.kind, []).append(_middle(*spectrum))
    listed = sorted(KINDS.values(), key=lambda kind: kind.solver != "slow")  # low frequencies first
    return tuple(
        (kind.excites, min(low for low, _ in found), max(high for _, high in found))
        for kind in listed
        if (found := bands.get(kind.name))
    )


def _velocity(channel: ChannelDraws) -> tuple[np.ndarray, np.ndarray] | None:
    """Frequencies [Hz] and energy of the velocity at them (m,); None where no sensor tells it."""
    read = channel.quantiles[LEVELS.index(50.0)]
    interval = float(channel.time[1] - channel.time[0])
    if channel.quantity == "stroke":
        moved = np.diff(read)
        frequency = np.fft.rfftfreq(len(moved), interval)
        size = np.abs(np.fft.rfft(moved))
    elif channel.quantity == "acceleration":
        frequency = np.fft.rfftfreq(len(read), interval)[1:]
        size = np.abs(np.fft.rfft(read - read[0]))[1:] / frequency
    else:
        return None
    return frequency, size**2


def _middle(frequency: np.ndarray, energy: np.ndarray) -> tuple[float, float]:
    """Frequencies [Hz] below and above which lies no more than OUTSIDE of the energy."""
    part = np.cumsum(energy) / np.sum(energy)
    resolved = 0.5 * (frequency[1] - frequency[0])
    low, high = (frequency[int(np.searchsorted(part, p))] for p in (OUTSIDE, 1.0 - OUTSIDE))
    return max(float(low), resolved), max(float(high), resolved)

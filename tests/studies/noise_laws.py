"""How well a series of residuals tells how long its noise lasts.

    python tests/studies/noise_laws.py

Simulates series of known laws, fits the law of each as a fit does, with and without parts that
fade, and prints a table: geometric mean of the autocorrelation times and the scatter of their
logarithm. No rig is in it; a minute.
"""

import sys
from collections.abc import Callable, Mapping
from unittest.mock import patch

import numpy as np
from scipy.signal import lfilter

from rigid.likelihood import noise_spectrum
from rigid.likelihood.correlation import noise_law

SERIES, LENGTHS, SEED = 100, (400, 1500), 20261127


def fading(rng: np.random.Generator, decay: float, n: int) -> np.ndarray:
    """A part of variance 1 of which a share `decay` is left a sample later, in equilibrium."""
    white = np.sqrt(1.0 - decay**2) * rng.standard_normal(n + 2000)
    return np.asarray(lfilter([1.0], [1.0, -decay], white))[2000:]


def lasting(parts: Mapping[float, float]) -> float:
    """Autocorrelation time of parts, by decay: their shares."""
    return sum(share * (1.0 + decay) / (1.0 - decay) for decay, share in parts.items())


def made(rng: np.random.Generator, parts: Mapping[float, float], n: int) -> np.ndarray:
    """One series of them (n,)."""
    return sum(
        (np.sqrt(share) * fading(rng, decay, n) for decay, share in parts.items()), np.zeros(n)
    )


NOISES: Mapping[str, Mapping[float, float]] = {
    "white": {0.0: 1.0},
    "AR(1), 0.3": {0.3: 1.0},
    "AR(1), 0.6": {0.6: 1.0},
    "AR(1), 0.9": {0.9: 1.0},
    "43 % white, the rest AR(1) of 0.8": {0.0: 0.43, 0.8: 0.57},
    "43 % white, the rest AR(1) of 0.95": {0.0: 0.43, 0.95: 0.57},
    "30 % AR(1) of 0.98, the rest AR(1) of 0.45": {0.98: 0.3, 0.45: 0.7},
}


def told(times: list[float]) -> str:
    """Geometric mean, and scatter of the logarithm."""
    logs = np.log(times)
    return f"{np.exp(logs.mean()):.1f} ({logs.std():.2f})"


def row(name: str, parts: Mapping[float, float], n: int, rng: np.random.Generator) -> str:
    """One line of the table."""
    series = [made(rng, parts, n) for _ in range(SERIES)]
    read = np.ones(n, dtype=bool)

    def times() -> list[float]:
        return [noise_law(one, read).time for one in series]

    now = told(times())
    nothing: Callable = lambda _: ()  # noqa: E731
    with patch.object(noise_spectrum.Whittle, "fading", nothing):
        before = told(times())
    return f"| {name} | {n} | {lasting(parts):.1f} | {before} | {now} |\n"


def main() -> None:
    rng = np.random.default_rng(SEED)
    sys.stdout.write(
        "| noise | samples | true tau | autoregressions alone | with parts that fade |\n"
    )
    sys.stdout.write("|---|---|---|---|---|\n")
    for n in LENGTHS:
        for name, parts in NOISES.items():
            sys.stdout.write(row(name, parts, n, rng))


if __name__ == "__main__":
    main()

"""How strongly a hidden cause shows once every uncertain constant has been refitted.

The strength is the square root of twice the expected log-likelihood gain of the true cause over
the base model, refitted: the norm of the cause's trace in units of noise, after the campaign's
constants have absorbed what their priors let them,

    s^2 = min over z of |t - f(z)|^2 + |z|^2,

with t the change of the noiseless readings over sqrt(sigma^2 + step^2/12) that the cause makes, and
f(z) the change that the constants make, z prior standard deviations from the truth. Noise counts
as white. `strength` takes f(z) = J z; `refitted` takes f as it is.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import exp, log, sqrt
from typing import NamedTuple

import numpy as np

from rigid.generator.core import Piece
from rigid.generator.draw import Truth
from rigid.generator.hidden import Hidden
from rigid.generator.refit import Key, Layout, change, constants, moved, noiseless, slopes

TOLERANCE = 0.05  # relative, of a strength that is asked for
COARSE = 0.15  # the same, where the constants have to be refitted in earnest
MOST_TRIALS = 30
MOST_FACTOR = 4.0  # of the amplitude from one trial to the next
REFITS = 12
SETTLED = 5e-3  # relative change of the strength at which a refit has settled
FAINT = 1e-6  # strength below which a cause counts as not there


class Refit(NamedTuple):
    """Constants refitted to a trace.

    - strength: what is left; z (k,): where they end up, in the order of `constants`
    - made (size,): the change they make there; slopes (size, k): of it, near there
    """

    strength: float
    z: np.ndarray
    made: np.ndarray
    slopes: np.ndarray


@dataclass(frozen=True)
class Ground:
    """A campaign's base plant, ready to judge causes by: made once, used for all.

    - truth: with the runs that are fitted (no field record); layout: of its samples
    - base: noiseless readings, SI
    - shape (size, k), price (k, k): QR of the constants' slopes over the identity, so that
      shape @ price are the slopes and price.T @ price = J.T J + 1
    """

    truth: Truth
    layout: Layout
    base: Mapping[Key, np.ndarray]
    shape: np.ndarray
    price: np.ndarray

    def trace(self, cause: Piece) -> np.ndarray:
        """Change of all readings that a cause makes, (size,) in units of noise."""
        runs = [run for run in self.truth.runs if cause.within(self.truth.rig, run)]
        return self.layout.flat(change(noiseless(self.truth, (cause,), runs), self.base))

    def product(self, one: np.ndarray, other: np.ndarray) -> float:
        """Scalar product of two traces after the constants have absorbed what they can."""
        return float(one @ other - (self.shape.T @ one) @ (self.shape.T @ other))

    def strength(self, trace: np.ndarray) -> float:
        """Strength of a trace, the constants' part taken as linear."""
        return sqrt(max(self.product(trace, trace), 0.0))

    def cosines(self, traces: Sequence[np.ndarray]) -> np.ndarray:
        """Cosines between traces after the constants have absorbed what they can."""
        products = np.array([[self.product(a, b) for b in traces] for a in traces])
        sizes = np.sqrt(np.diag(products))
        return products / np.outer(sizes, sizes)

    def refitted(self, trace: np.ndarray, near: Refit | None = None) -> Refit:
        """Refit the constants to a trace in earnest, from where a refit to a like one ended.

        Gauss-Newton steps; after each the slopes are corrected by what it did (Broyden 1965,
        Math. Comp. 19), and a step that makes it worse is tried at half its length.
        """
        size = self.price.shape[0]
        if near is None:
            made = np.zeros(self.layout.size)
            near = Refit(np.inf, np.zeros(size), made, self.shape @ self.price)
        z, made, slopes = near.z, near.made, near.slopes
        best, share = float(np.linalg.norm(np.concatenate([trace - made, z]))), 1.0
        for _ in range(REFITS):
            q, r = np.linalg.qr(np.concatenate([slopes, np.eye(size)]))
            step = share * np.linalg.solve(r, q.T @ np.concatenate([trace - made, -z]))
            new = self._made_by(z + step)
            slopes = slopes + np.outer(new - made - slopes @ step, step / (step @ step))
            now = float(np.linalg.norm(np.concatenate([trace - new, z + step])))
            if now >= best:
                share /= 2.0
                continue
            gain, best, z, made, share = best - now, now, z + step, new, 1.0
            if gain < SETTLED * best:
                break
        return Refit(best, z, made, slopes)

    def _made_by(self, z: np.ndarray) -> np.ndarray:
        """Change of all readings, (size,), that constants z prior sds from the truth make."""
        by = dict(zip(constants(self.truth), z.tolist(), strict=True))
        return self.layout.flat(change(noiseless(moved(self.truth, by)), self.base))


def ground(truth: Truth) -> Ground:
    """Simulate a campaign and its slopes by every constant that a fit adjusts."""
    truth = replace(truth, runs=tuple(run for run in truth.runs if run.kind != "field"))
    base, layout = noiseless(truth), Layout(truth)
    design = slopes(truth, layout, base)
    shape, price = np.linalg.qr(np.concatenate([design, np.eye(design.shape[1])]))
    return Ground(truth, layout, base, shape[: len(design)], price)


def at_strength(
    on: Ground, cause: Hidden, wanted: float, tolerance: float = TOLERANCE
) -> tuple[Hidden, float]:
    """Find the amplitude at which a cause has a wanted strength; gives the cause and its strength.

    - tolerance: relative, of the strength

    The linear strength leads there; where refitting in earnest gives another by more than the
    tolerance, the search goes on with that, at COARSE tolerance since it costs much. Raises
    ValueError where no amplitude reaches the strength.
    """
    found, _ = _search(lambda c: on.strength(on.trace(c)), cause, wanted, tolerance)
    last = on.refitted(on.trace(found))
    if abs(last.strength - wanted) <= tolerance * wanted:
        return found, last.strength

    def earnest(trial: Hidden) -> float:
        nonlocal last
        last = on.refitted(on.trace(trial), last)
        return last.strength

    factor = min(max(wanted / last.strength, 1.0 / MOST_FACTOR), MOST_FACTOR)
    return _search(earnest, found.of(found.amplitude * factor), wanted, COARSE)


def _search(
    measure: Callable[[Hidden], float], cause: Hidden, wanted: float, tolerance: float
) -> tuple[Hidden, float]:
    """Regula falsi in the logarithms, held inside the bracket."""
    below = above = None
    amplitude = cause.amplitude
    for _ in range(MOST_TRIALS):
        trial = cause.of(amplitude)
        strength = measure(trial)
        if abs(strength - wanted) <= tolerance * wanted:
            return trial, strength
        point = (log(amplitude), log(max(strength, FAINT)))
        below, above = (point, above) if strength < wanted else (below, point)
        amplitude = _next(point, log(wanted), below, above)
    raise ValueError(f"{cause.name} does not reach a strength of {wanted} in {MOST_TRIALS} trials")


Point = tuple[float, float]


def _next(last: Point, wanted: float, below: Point | None, above: Point | None) -> float:
    """Amplitude of the next trial; points are (log amplitude, log strength)."""
    if below is None or above is None:
        most = log(MOST_FACTOR)
        return exp(last[0] + min(max(wanted - last[1], -most), most))
    share = (wanted - below[1]) / (above[1] - below[1])
    return exp(below[0] + min(max(share, 0.1), 0.9) * (above[0] - below[0]))

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

import numpy as np

from rigid.generator.draw import Truth
from rigid.generator.hidden import Hidden
from rigid.generator.plant import Piece
from rigid.generator.refit import Key, Layout, change, constants, moved, noiseless, slopes

TOLERANCE = 0.05  # relative, of a strength that is asked for
MOST_TRIALS = 30
MOST_FACTOR = 4.0  # of the amplitude from one trial to the next
REFITS = 12
SETTLED = 1e-3  # relative change of the strength at which a refit has settled
FAINT = 1e-6  # strength below which a cause counts as not there


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

    def refitted(self, trace: np.ndarray) -> tuple[float, np.ndarray]:
        """Strength of a trace with the constants refitted in earnest, and where they end up.

        Gauss-Newton steps with the slopes at the truth, halved as long as they make it worse.
        Gives the strength and z (k,) in the order of `constants`.
        """
        z, left = np.zeros(self.price.shape[0]), trace
        best, share = float(np.linalg.norm(trace)), 1.0
        for _ in range(REFITS):
            target = left + self.shape @ (self.price @ z)
            step = np.linalg.solve(self.price, self.shape.T @ target) - z
            new = z + share * step
            rest = trace - self._made_by(new)
            now = sqrt(float(rest @ rest + new @ new))
            if now >= best:
                share /= 2.0
                continue
            gain, best, z, left = best - now, now, new, rest
            if gain < SETTLED * best:
                break
        return best, z

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
    tolerance, the search goes on with that. Raises ValueError where no amplitude reaches it.
    """
    found, _ = _search(lambda c: on.strength(on.trace(c)), cause, wanted, tolerance)
    strength, _ = on.refitted(on.trace(found))
    if abs(strength - wanted) <= tolerance * wanted:
        return found, strength
    start = found.of(found.amplitude * min(max(wanted / strength, 0.25), MOST_FACTOR))
    return _search(lambda c: on.refitted(on.trace(c))[0], start, wanted, tolerance)


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

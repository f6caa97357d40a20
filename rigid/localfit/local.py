"""A hypothesis fitted to all samples: Newton steps on the host, few simulations a step.

Only readings and slopes come from the compiled programs; likelihood, steps and evidence are linear
algebra on the list of samples. Where simulations are dear (rigs that are not steady), slopes by
the model's old numbers are kept from the fit that the hypothesis began with and only those of the
added effects are renewed (a chord method): the readings themselves are always exact. Where no part
of a step then leads up, all slopes are renewed once: a slack of 2 um moves those by k_LC by a
hundredth, three hundred noise sds.
"""

import dataclasses
from functools import cached_property

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array
from scipy.linalg import cho_factor, cho_solve

from rigid.likelihood import noise
from rigid.likelihood.channels import SensorSheet
from rigid.localfit.families import Family, read, sweep
from rigid.localfit.hypothesis import Hypothesis
from rigid.localfit.samples import Layout, Terms, data_of, flat_readings, split_swept, terms

LONGEST = 2.0
"""Largest change of an entry of w in one step."""
CLOSE = 0.02
"""Done when a step promises less than this in log-posterior."""
MOST_STEPS = 12
HALVINGS = 3
STEP = 1e-6
"""Change of w, in prior sds, whose difference gives a slope where derivatives cost much. Beside
those, slopes were off by less than 0.1 noise sds (root of the sum over all samples) where their
size was up to 1e5, log evidences by 1e-4."""
NOISE_GRID = np.linspace(-5.0, 5.0, 81)
NOISE_ROUNDS = 2


@dataclasses.dataclass(frozen=True)
class Local:
    """A hypothesis at w, and all that is known of the samples there.

    - `residual` (n,): recorded less expected; `reading` (n,): ideal. - `terms`: the likelihood.
    - `design` (n, size): slope of the expected reading by w.
    """

    hypothesis: Hypothesis
    family: Family
    layout: Layout
    w: np.ndarray
    z_noise: np.ndarray
    reading: np.ndarray
    residual: np.ndarray
    terms: Terms
    design: np.ndarray

    @cached_property
    def value(self) -> float:
        """Log-posterior, up to a constant that all hypotheses share."""
        prior = 0.5 * (self.w @ self.w + self.z_noise @ self.z_noise)
        return float(self.terms.value.sum() - prior)

    @cached_property
    def information(self) -> np.ndarray:
        """Minus the Hessian of the log-posterior by w, prior included (size, size)."""
        weighted = self.design * self.terms.bend[:, None]
        return np.eye(len(self.w)) + self.design.T @ weighted

    @cached_property
    def gradient(self) -> np.ndarray:
        """Slope of the log-posterior by w (size,)."""
        return self.design.T @ self.terms.score - self.w

    @cached_property
    def covariance(self) -> np.ndarray:
        """Of the Gaussian law around w (size, size)."""
        return cho_solve(cho_factor(self.information), np.eye(len(self.w)))

    @cached_property
    def log_evidence(self) -> float:
        """Log of the integral of the posterior by Laplace's method, noise levels at their best."""
        return self.value - 0.5 * float(np.linalg.slogdet(self.information)[1])


def expand(
    hypothesis: Hypothesis,
    where: tuple[Family, Layout],
    w: np.ndarray,
    z_noise: np.ndarray,
    known: np.ndarray | None = None,
) -> Local:
    """Simulate a hypothesis and expand its likelihood.

    - `where`: program and samples. - `known` (n, size): slopes to keep for all but the added
      effects' numbers.
    """
    base = len(hypothesis.parameters) - added_size(hypothesis)
    moved = range(base, len(hypothesis.parameters)) if known is not None else None
    swept = _swept(hypothesis, where, w, moved)
    return laid(hypothesis, where, (w, z_noise), swept, known)


def laid(
    hypothesis: Hypothesis,
    where: tuple[Family, Layout],
    place: tuple[np.ndarray, np.ndarray],
    swept: tuple[np.ndarray, np.ndarray],
    known: np.ndarray | None = None,
) -> Local:
    """Expand the likelihood of a hypothesis around readings that have been simulated.

    - `where`, `known`: as in `expand`. - `place`: w and noise levels on the scale of their priors.
    - `swept`: readings (n,) and their slopes by w (n, k): by the added effects' numbers where
      others are `known`, else by all.
    """
    (family, layout), (w, z_noise), (reading, slopes) = where, place, swept
    base = len(hypothesis.parameters) - added_size(hypothesis)
    spreads = layout.spreads
    own = hypothesis.sensors(w) * spreads
    gain, zero = own[layout.sensor].T
    residual = data_of(layout) - (1.0 + gain) * reading - zero
    design = np.zeros((len(reading), hypothesis.size))
    if known is not None:
        design[:, :base] = known[:, :base]
    first = base if known is not None else 0
    design[:, first : first + slopes.shape[1]] = slopes * (1.0 + gain)[:, None]
    rows, at = np.arange(len(reading)), len(hypothesis.parameters) + 2 * layout.sensor
    design[rows, at] = reading * spreads[layout.sensor, 0]
    design[rows, at + 1] = spreads[layout.sensor, 1]
    found = terms(layout, residual, hypothesis.sigmas(z_noise))
    return Local(hypothesis, family, layout, w, z_noise, reading, residual, found, design)


def added_size(hypothesis: Hypothesis) -> int:
    """Number of parameters of what was added."""
    inside = {p.label for p in hypothesis.problem.parameters.sampled}
    return sum(p.label not in inside for p in hypothesis.parameters)


def _swept(
    hypothesis: Hypothesis, where: tuple[Family, Layout], w: np.ndarray, moved: range | None
) -> tuple[np.ndarray, np.ndarray]:
    """Readings (n,) and their slopes (n, moved) by some of the parameters, all where None.

    An added effect that is confined to a record is absent from the rows of all others.
    """
    place = hypothesis.values(w)
    numbers = list(range(len(hypothesis.parameters)) if moved is None else moved)
    wanted = [hypothesis.labels[number] for number in numbers]
    simulated = _derivatives if where[0].steady else _differences

    def run(quiet: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
        here = {k: v for k, v in place.items() if k not in quiet}
        return simulated(where, hypothesis.constants(), here, wanted)

    layout = where[1]
    reading, slopes = run(())
    for effect in hypothesis.added:
        record = hypothesis.only.get(effect.name)
        if record is None:
            continue
        labels = tuple(label for info in effect.parameters() for label in info.labels)
        without, flat = run(labels)
        elsewhere = layout.track != layout.tracks.index(record)
        reading = np.where(elsewhere, without, reading)
        slopes = np.where(elsewhere[:, None], flat, slopes)
    return reading, slopes


def _derivatives(
    where: tuple[Family, Layout],
    fixed: dict[str, float],
    place: dict[str, tuple[float, float]],
    moved: list[str],
) -> tuple[np.ndarray, np.ndarray]:
    """Readings (n,) and their derivatives (n, moved) by w, one in each lane.

    - `place`: value and its slope by w, by label; a parameter that is not in it is absent.
    """
    lanes = max(len(moved), 1)
    values = {k: np.full(lanes, v) for k, v in fixed.items()}
    values |= {k: np.full(lanes, v) for k, (v, _) in place.items()}
    along = {k: np.eye(lanes)[i] * place[k][1] for i, k in enumerate(moved) if k in place}
    reading, slopes = split_swept(where[1], sweep(where[0], values, along))
    return reading[:, 0], slopes[:, : len(moved)]


def _differences(
    where: tuple[Family, Layout],
    fixed: dict[str, float],
    place: dict[str, tuple[float, float]],
    moved: list[str],
) -> tuple[np.ndarray, np.ndarray]:
    """The same by differences of bare simulations, the place itself in the first lane."""
    lanes = len(moved) + 1
    values = {k: np.full(lanes, v) for k, v in fixed.items()}
    values |= {k: np.full(lanes, v) for k, (v, _) in place.items()}
    for i, label in enumerate(moved, start=1):
        if label in place:
            values[label][i] += STEP * place[label][1]
    reading = flat_readings(where[1], read(where[0], values))
    return reading[:, 0], (reading[:, 1:] - reading[:, :1]) / STEP


def refined(local: Local, chord: bool = False, most: int = MOST_STEPS) -> Local:
    """Lead a hypothesis to its optimum and its noise levels to theirs.

    - `chord`: keep the slopes by all but the added effects' numbers.
    """
    for _ in range(NOISE_ROUNDS):
        local = _descended(local, chord, most)
        local = with_noise(local, fitted_noise(local))
    return _descended(local, chord, most)


def _descended(local: Local, chord: bool, most: int) -> Local:
    known = local.design if chord else None
    where, renewed = (local.family, local.layout), not chord
    for _ in range(most):
        step = cho_solve(cho_factor(local.information), local.gradient)
        step *= min(1.0, LONGEST / max(float(np.abs(step).max()), 1e-12))
        if 0.5 * step @ local.gradient < CLOSE:
            break
        for _ in range(HALVINGS + 1):
            tried = expand(local.hypothesis, where, local.w + step, local.z_noise, known)
            if np.isfinite(tried.value) and tried.value > local.value:
                break
            step = 0.4 * step
        else:
            if renewed:
                break
            tried = expand(local.hypothesis, where, local.w, local.z_noise)
            known, renewed = tried.design, True
        local = tried
    return local


@eqx.filter_jit
def _levels(sheet: SensorSheet, residual: Array, weight: Array, sigma: Array) -> Array:
    """Log-likelihood of a channel's samples (n,) for several noise levels (levels,)."""
    return weight @ noise.sample_law(sigma, sheet.step, sheet.noise)(residual[:, None]).value


def fitted_noise(local: Local) -> np.ndarray:
    """Most probable noise levels, on the scale of their priors (levels,), the rest held."""
    problem, layout = local.layout.problem, local.layout
    laws = {p.label: p.law for p in problem.parameters.sampled if p.base == "noise"}
    total = dict.fromkeys(laws, -0.5 * NOISE_GRID**2)
    sheets = [piece.sheet for piece in problem.pieces for _ in piece.tracks]
    for number, (channel, sheet) in enumerate(zip(layout.channels, sheets, strict=True)):
        label = f"noise[{channel.sensor}]"
        if label in laws:
            rows = layout.channel == number
            sigma = laws[label].from_standard(jnp.asarray(NOISE_GRID))
            residual, weight = jnp.asarray(local.residual[rows]), jnp.asarray(layout.weight[rows])
            total[label] = total[label] + np.asarray(_levels(sheet, residual, weight, sigma))
    return np.array([_peak(total[label]) for label in laws])


def _peak(height: np.ndarray) -> float:
    """Place on the noise grid of the peak of a curve, by a parabola through its top."""
    i = int(np.clip(np.argmax(height), 1, len(height) - 2))
    left, top, right = height[i - 1 : i + 2]
    bend = left - 2.0 * top + right
    shift = 0.5 * (left - right) / bend if bend < 0.0 else 0.0
    return float(NOISE_GRID[i] + np.clip(shift, -1.0, 1.0) * (NOISE_GRID[1] - NOISE_GRID[0]))


def with_noise(local: Local, z_noise: np.ndarray) -> Local:
    """Return the same fit with other noise levels."""
    return _again(local, local.layout, z_noise)


def with_weights(local: Local, weight: np.ndarray) -> Local:
    """Return the same fit with other weights of the samples (n,)."""
    return _again(local, local.layout.weighed(weight), local.z_noise)


def _again(local: Local, layout: Layout, z_noise: np.ndarray) -> Local:
    found = terms(layout, local.residual, local.hypothesis.sigmas(z_noise))
    return dataclasses.replace(local, layout=layout, z_noise=z_noise, terms=found)

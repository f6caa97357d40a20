"""The ridge of a posterior: what is told well, as a function of what is hardly told.

Records tell some combinations of the numbers a thousand times better than the priors tell each of
them: the release k_LC over the masses that swing, the frame the sum of 1/k_LC and 1/k_frame. The
posterior then is a thin sheet, and a bent one: within one standard deviation of k_frame it leaves
its tangent by several of its thicknesses. No Gaussian law covers it, walkers do not find their way
along it, and what they miss no R-hat shows (docs/studies/validation-notes.md).

But given the few directions w that are hardly told, the posterior of all others x is all but
Gaussian, and some Newton steps lead to its top x*(w): the conditional mode, as of the nested
Laplace approximation (Tierney and Kadane 1986; Rue, Martino and Chopin 2009). That of some dozen w,
with the slopes dx*/dw that the information there tells, gives x* as a polynomial, and

    v = (w, x - x*(w))

are coordinates in which the posterior is straight. The map is triangular, so that volumes are kept:
densities are the same in both. At the best fit x* and its slope are zero: it and the Gaussian law
around it stay what they are.
"""

import dataclasses
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.stats import norm, qmc

from rigid.inference.coordinates import Bend, Chart, Floats, bend_slopes, bend_terms, chart_of
from rigid.inference.newton import Expansion, expanded, is_noise, joined
from rigid.inference.proposal import Mode, kish
from rigid.inference.search import Found, Optimum
from rigid.likelihood.problem import Problem

WIDE = (0.3, 0.1)
"""Posterior sd [prior sds] from which on a direction counts as hardly told, in a first map and in a
second one in its coordinates: those told by a tenth of the prior bend with those wider than a
third. Where narrower ones than these count as well, points in so many dimensions lie off the
ridge of hard campaigns, whose tails are then missed (docs/studies/validation-notes.md)."""
SPREAD = 1.25
"""Of the points w, in posterior sds: a polynomial is worth little beyond them, and stays there."""
FEWEST, MOST = 32, 64
"""Points w in the first round, and at most; each round has twice as many as the one before."""
COVERED = 0.9
"""Overlap with the posterior from which on no further points are asked for."""
STRAIGHT = 0.98
"""Overlap with the posterior from which on it is taken for straight as it is."""
STRENGTHS = tuple(10.0**k for k in range(-1, 5))
"""How far one prior sd of a direction may bend others [their sds]: from hardly to freely. Each
coefficient has a normal prior whose sd is this, times the width of every direction in its term."""
FAR = 3.0
"""Sds beyond which one miss counts like another."""
STEPS = 8
SETTLED = 1.0
"""Nats that the last step to a conditional mode promises; what it leaves is of second order."""

Local = Callable[[Floats, Floats], Expansion]
"""(u (size,), gains and zeros (n,)) -> value, gradient (size + n,), information of both."""


class Directions(NamedTuple):
    """Directions of u in units of the Gaussian law around an optimum.

    - `factor` (size, size): in its columns, the wide ones that are hardly told first, then those
      that are told well, `narrow` of them, then what is held.
    - `widths` (wide,): of those hardly told, in prior sds.
    """

    factor: Floats
    widths: Floats
    narrow: int

    @property
    def wide(self) -> int:
        """How many are hardly told."""
        return len(self.widths)


class ConditionalMode(NamedTuple):
    """Where the posterior is highest given w (wide,).

    - `x` (n,): the narrow entries, then gains and zeros; `slopes` (n, wide): dx/dw.
    - `factor` (narrow, narrow): lower Cholesky factor of the narrow entries' covariance there.
    - `value`: minus the log of the posterior integrated over x, as if it were Gaussian there.
    """

    w: Floats
    x: Floats
    slopes: Floats
    factor: Floats
    value: float


class Followed(NamedTuple):
    """Conditional modes along a ridge, in units of directions around an optimum.

    - `centre` (size,): the optimum. - `rarity` (modes,): logs, up to a constant, of how often such
      w were tried.
    """

    centre: Floats
    along: Directions
    modes: list[ConditionalMode]
    rarity: Floats


class Bent(NamedTuple):
    """What following a ridge has led to.

    - `bend`: what straightens it; None where it is straight, or cannot be followed.
    - `followed`: None where no mode was found.
    """

    bend: Bend | None
    followed: Followed | None


class Ridge(NamedTuple):
    """The ridge of a posterior.

    - `chart`: coordinates along it. - `followed`: in the coordinates `before`.
    """

    chart: Chart
    before: Chart
    followed: Followed | None


def ridge_of(found: Found) -> Ridge:
    """Follow the ridge through the best optimum of a search."""
    problem, best = found.problem, found.optima[0]
    chart = chart_of(problem)
    ridge = Ridge(chart, chart, None)
    # `expanded` holds noise levels; they do not bend what the records say of the other numbers.
    held = is_noise(problem)
    for width in WIDE:
        local = expansion_of(problem, chart)
        before, bent = chart, bend_of(local, chart.straightened(best), held, width)
        if bent.bend is not None:
            chart = dataclasses.replace(chart, bends=(*chart.bends, bent.bend))
        ridge = Ridge(chart, before, bent.followed)
    return ridge


def as_wide_as_prior(problem: Problem, there: Optimum) -> Mode:
    """Return a law over an optimum that is the prior along what records hardly tell."""
    along = directions(there, is_noise(problem), WIDE[0])
    narrower = np.minimum(along.widths, 1.0)
    axes = along.factor[:, : along.wide] / along.widths
    covariance = there.covariance + (axes * (1.0 - narrower**2)) @ axes.T
    mean = there.z - axes @ (axes.T @ there.z)
    factor = np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)
    return Mode(mean, factor, there.log_posterior)


def bend_of(local: Local, there: Optimum, held: NDArray[np.bool_], width: float) -> Bent:
    """Find what straightens a posterior around an optimum.

    - `held` (size,): entries that stay as they are. - `width`: as in WIDE.
    """
    along = directions(there, held, width)
    if not along.wide or not along.narrow:
        return Bent(None, None)
    normal = np.asarray(norm.ppf(qmc.Sobol(along.wide, rng=1).random(MOST)), dtype=np.float64)
    far, clouds = Cloud.of_prior(there, along), [Cloud(np.zeros(along.wide), np.ones(along.wide))]
    about = partial(mode_at, local, there, along)
    origin = about(np.zeros(along.wide), np.zeros(along.narrow + there.standard.size))
    if origin is None:
        return Bent(None, None)
    modes, design, done, share, strengths = [], None, None, -1.0, np.zeros(0)
    tried, count = 0, FEWEST
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        while share < COVERED and tried < MOST:
            # The far ones after the near ones, for they begin where these lead.
            for cloud, first in ((clouds[-1], tried), (far, tried + 1)):
                w = cloud.points(normal[first:count:2])
                near = [followed([origin, *modes], at) for at in w]
                modes += [mode for mode in pool.map(about, w, near) if mode is not None]
            tried, count = count, 2 * count
            if len(modes) < 2:
                return Bent(None, None)
            rarity = rarity_of(modes, [*clouds, far])
            design = Design.of(modes, origin, along, rarity)
            done = Followed(there.z, along, list(modes), rarity)
            clouds.append(clouds[0].moved(modes, rarity))
            if design.overlap(np.zeros(design.x.shape)) > STRAIGHT:
                return Bent(None, done)
            share, strengths = design.chosen()
    assert design is not None
    coefficients = design.coefficients(strengths)[:, : along.narrow]
    reached = np.array([mode.w for mode in modes])
    low, high = reached.min(axis=0), reached.max(axis=0)
    return Bent(Bend(there.z, along.factor, low, high, coefficients), done)


def directions(there: Optimum, held: NDArray[np.bool_], least: float) -> Directions:
    """Return the directions of the Gaussian law around an optimum, the widest first.

    - `held` (size,): what is no direction. - `least`: width of those that are hardly told.
    """
    free, fixed = np.flatnonzero(~held), np.flatnonzero(held)
    variance, axes = np.linalg.eigh(there.covariance[np.ix_(free, free)])
    width, axes = np.sqrt(variance[::-1]), axes[:, ::-1]
    factor = np.zeros((len(held), len(held)))
    factor[np.ix_(free, np.arange(len(free)))] = axes * width
    own = np.sqrt(there.covariance[fixed, fixed])
    factor[fixed, np.arange(len(free), len(held))] = own
    wide = int(np.sum(width > least))
    return Directions(factor, width[:wide], len(free) - wide)


def mode_at(
    local: Local, there: Optimum, along: Directions, w: Floats, near: Floats
) -> ConditionalMode | None:
    """Return the conditional mode at w (wide,); None where Newton steps lead to none.

    - `near` (narrow + gains and zeros,): x where they begin, from that of the optimum on.
    """
    size, wide = len(there.z), along.wide
    last = wide + along.narrow
    axes = np.asarray(block_diag(along.factor[:, wide:last], np.eye(there.standard.size)))
    value, x = np.inf, near
    before = x
    for _ in range(STEPS):
        q = np.concatenate([w, x[: along.narrow], np.zeros(size - last)])
        others = there.standard.ravel() + x[along.narrow :]
        at = local(there.z + along.factor @ q, others)
        if not at.value <= value:  # too long a step, or one to where nothing can be simulated
            if before is x:
                return None
            x = 0.5 * (before + x)
            continue
        information, gradient = np.asarray(at.information), np.asarray(at.gradient)
        known, slope = axes.T @ information @ axes, axes.T @ gradient
        step = -np.linalg.solve(known, slope)
        before, x, promise = x, x + step, -0.5 * float(slope @ step)
        if promise < SETTLED:
            across = information[:, :size] @ along.factor[:, :wide]
            slopes = np.asarray(-np.linalg.solve(known, axes.T @ across), dtype=np.float64)
            volume = 0.5 * float(np.linalg.slogdet(known)[1])
            spread = np.linalg.inv(known)[: along.narrow, : along.narrow]
            factor = np.asarray(np.linalg.cholesky(spread), dtype=np.float64)
            return ConditionalMode(w, x, slopes, factor, float(at.value) - promise + volume)
        value = float(at.value) + SETTLED
    return None


def followed(modes: list[ConditionalMode], w: Floats) -> Floats:
    """Where the nearest of some modes and its slopes say that the one at w is."""
    nearest = min(modes, key=lambda mode: float(np.sum((mode.w - w) ** 2)))
    return nearest.x + nearest.slopes @ (w - nearest.w)


class Cloud(NamedTuple):
    """What is known of the posterior of w: centre and sds (wide,)."""

    centre: Floats
    sds: Floats

    @classmethod
    def of_prior(cls, there: Optimum, along: Directions) -> "Cloud":
        """That of the prior along those told by less than the first of WIDE; others as told."""
        axes = along.factor[:, : along.wide] / along.widths
        hardly = along.widths > WIDE[0]
        centre = np.where(hardly, -(there.z @ axes) / along.widths, 0.0)
        return cls(centre, np.where(hardly, 1.0 / (SPREAD * along.widths), 1.0))

    def points(self, normal: Floats) -> Floats:
        """Points (n, wide) for standard normal numbers, SPREAD times as far."""
        return self.centre + SPREAD * self.sds * normal

    def log_density(self, w: Floats) -> Floats:
        """Of its points at w (n, wide), up to a constant, (n,)."""
        off = (w - self.centre) / (SPREAD * self.sds)
        return -0.5 * np.sum(off**2, axis=1) - np.sum(np.log(self.sds))

    def moved(self, modes: list[ConditionalMode], rarity: Floats) -> "Cloud":
        """Centre and sds that modes tell; this cloud counts as many draws as there are entries.

        No sd becomes less than it is here.
        """
        w = np.array([mode.w for mode in modes])
        logs = -np.array([mode.value for mode in modes]) - rarity
        weight = np.exp(logs - logs.max())
        share = 1.0 / (1.0 + len(self.centre) / kish(weight))
        weight = share * weight / weight.sum()
        centre = (1.0 - share) * self.centre + weight @ w
        variance = weight @ (w - centre) ** 2
        variance += (1.0 - share) * (self.sds**2 + (self.centre - centre) ** 2)
        return Cloud(centre, np.maximum(np.sqrt(variance), self.sds))


def rarity_of(modes: list[ConditionalMode], clouds: list[Cloud]) -> Floats:
    """How often points of some clouds lie where modes do, logs up to a constant, (modes,)."""
    w = np.array([mode.w for mode in modes])
    return np.logaddexp.reduce([cloud.log_density(w) for cloud in clouds], axis=0)


class Design(NamedTuple):
    """Modes as equations for the coefficients of polynomials.

    - `terms` (modes, terms), `slopes` (modes, wide, terms): of the polynomial at each mode.
    - `x` (modes, n), `by_w` (modes, wide, n): what they are to be there.
    - `weight` (modes,): of each; `scale` (terms,): product of the widths in each term.
    - `narrow`: how many of the n directions count; after them come gains and zeros.
    """

    terms: Floats
    slopes: Floats
    x: Floats
    by_w: Floats
    weight: Floats
    scale: Floats
    narrow: int

    @classmethod
    def of(
        cls,
        modes: list[ConditionalMode],
        origin: ConditionalMode,
        along: Directions,
        rarity: Floats,
    ) -> "Design":
        """Gather modes; `origin` is that at the optimum, `rarity` (modes,) of points near them."""
        w = np.array([mode.w for mode in modes])
        # What the posterior at w is to how often such w are tried.
        logs = -rarity - [m.value - origin.value for m in modes]
        weight = np.exp(np.minimum(0.5 * (logs - np.median(logs)), 1.0))
        x, by_w = np.array([m.x for m in modes]), np.array([m.slopes.T for m in modes])
        scale = bend_terms(along.widths)
        return cls(bend_terms(w), bend_slopes(w), x, by_w, weight, scale, along.narrow)

    def coefficients(self, strengths: Floats) -> Floats:
        """Coefficients (terms, n) where each direction has one of STRENGTHS."""
        terms, n = len(self.scale), self.x.shape[1]
        weight = self.weight[:, None, None]
        rows = np.concatenate([self.terms[:, None], self.slopes], axis=1)
        asked = np.concatenate([self.x[:, None], self.by_w], axis=1)
        rows = rows * self.scale
        known = np.einsum("mek,mel->kl", rows * weight, rows)
        told = np.einsum("mek,men->kn", rows * weight, asked)
        found = np.zeros((terms, n))
        for strength in set(strengths.tolist()):
            some = strengths == strength
            prior = np.eye(terms) / strength**2
            found[:, some] = np.linalg.solve(known + prior, told[:, some])
        return found * self.scale[:, None]

    def chosen(self) -> tuple[float, Floats]:
        """The strengths (n,) with which one half foretells the other best, and its overlap."""
        foretold = np.array([self._by_halves(strength) for strength in STRENGTHS])
        loss = np.minimum((foretold - self.x) ** 2, FAR**2)
        best = np.argmin(np.einsum("m,smn->sn", self.weight, loss), axis=0)
        picked = np.take_along_axis(foretold, best[None, None], axis=0)[0]
        return self.overlap(picked), np.array(STRENGTHS)[best]

    def overlap(self, foretold: Floats) -> float:
        """Overlap of the posterior with one whose modes are where they are foretold.

        A mean over the modes: 1 where they hit, exp(-1/4) where they are one sd off.
        """
        off = np.sum((foretold - self.x)[:, : self.narrow] ** 2, axis=1)
        return float(self.weight @ np.exp(-0.25 * off) / self.weight.sum())

    def _by_halves(self, strength: float) -> Floats:
        """What each half of the modes is foretold by the other (modes, n)."""
        found = np.zeros(self.x.shape)
        for fold in (0, 1):
            half = self._replace(
                terms=self.terms[fold::2],
                slopes=self.slopes[fold::2],
                x=self.x[fold::2],
                by_w=self.by_w[fold::2],
                weight=self.weight[fold::2],
            )
            coefficients = half.coefficients(np.full(self.x.shape[1], strength))
            found[1 - fold :: 2] = self.terms[1 - fold :: 2] @ coefficients
        return found


def expansion_of(problem: Problem, chart: Chart) -> Local:
    """Return what expands a problem in the coordinates of a chart; noise levels are held."""
    return partial(_expanded, problem, chart)


def _expanded(problem: Problem, chart: Chart, u: Floats, others: Floats) -> Expansion:
    """Expand a problem around u and its gains and zeros; entries of noise levels are zero."""
    noise, z = is_noise(problem), chart.standard(u)
    free = np.flatnonzero(~noise)
    found = expanded(problem, joined(problem, z, others.reshape(-1, 2)), z[noise])
    back = np.linalg.inv(chart.slopes(z))[np.ix_(free, free)]
    to = np.zeros((len(free) + len(others), len(z) + len(others)))
    to[: len(free), free] = back
    to[len(free) :, len(z) :] = np.eye(len(others))
    return Expansion(found.value, to.T @ found.gradient, to.T @ found.information @ to)

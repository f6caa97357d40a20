"""Draws along a ridge that no polynomial follows: each at a conditional mode of its own.

A law over the modes is as good as the map that straightens the posterior. Where that map is off by
some thicknesses of the sheet, hardly a draw counts, and a chain that begins in that law stays where
the law was: truths then weigh more than all draws (`weight` in docs/validation.md). But given w,
what is hardly told, all else is next to Gaussian wherever w lies (`ridge`). So w is drawn from a
law fitted to its marginal, as Laplace has it; Newton steps lead from the nearest mode that is known
to the one at w; some x are drawn of the law there, and one of them is kept by its weight. Weights
are those of the exact posterior: what Laplace leaves out makes them uneven, not wrong.

Source: Rue, Martino and Chopin (2009), nested Laplace approximations, here as a proposal; one kept
of several by weight as in Andrieu, Doucet and Holenstein (2010), particle Markov chain methods.
"""

import dataclasses
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rigid.inference.adaptation import Weighted, adapted
from rigid.inference.coordinates import Chart, Floats
from rigid.inference.newton import is_noise
from rigid.inference.proposal import LogProb, MixtureProposal, Mode, Random
from rigid.inference.ridge import (
    WIDE,
    ConditionalMode,
    Directions,
    Local,
    directions,
    expansion_of,
    followed,
    mode_at,
)
from rigid.inference.search import SAME_WITHIN, Found, Optimum

FAR_SHARE = 0.2
"""Of the first draws of w, for a law as wide as the prior."""
FIRST_DOF, DOF = 8.0, 16.0
"""Of the laws of w before and after fitting, and of x."""
ROUND = 96
"""Conditional modes in each round in which the law of w is fitted."""
TOGETHER = 16
"""Modes looked for at a time, from those that are known by then."""
TRIED = 8
"""Draws of x at each w, of which one is kept."""

STRIDES = 4
"""From the best optimum to another one along the ridge."""
ELSEWHERE = 0.01
"""Share of the posterior that optima off the ridge may hold."""

About = Callable[[Floats, Floats], ConditionalMode | None]


@dataclasses.dataclass(eq=False)
class Slices:
    """Conditional modes of a posterior, found when they are asked for.

    - `about`: (w, where to begin) -> mode. - `known`: modes found so far, that at the optimum
      first.
    """

    about: About
    known: list[ConditionalMode]

    def at(self, w: Floats) -> list[ConditionalMode | None]:
        """Find the modes at w (n, wide); None where Newton steps lead to none."""
        out: list[ConditionalMode | None] = [None] * len(w)
        # The near ones first, for the far ones begin where these lead.
        order = np.argsort(np.sum(w**2, axis=1))
        with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
            for first in range(0, len(w), TOGETHER):
                some = order[first : first + TOGETHER]
                begun = [followed(self.known, w[i]) for i in some]
                found = list(pool.map(self.about, w[some], begun))
                for i, mode in zip(some.tolist(), found, strict=True):
                    out[i] = mode
                self.known += [mode for mode in found if mode is not None]
        return out

    def marginal(self, w: Floats) -> Floats:
        """Log of Laplace's marginal of w (n, wide), up to a constant, (n,)."""
        return np.array([-np.inf if m is None else -m.value for m in self.at(w)])


@dataclasses.dataclass(frozen=True, eq=False)
class Nested:
    """A posterior in units of the law around its optimum: w, then x, then what is held.

    - `centre` (size,), `along`: what the units are. - `slices`: its conditional modes.
    - `law`: of w.
    """

    centre: Floats
    along: Directions
    slices: Slices
    law: MixtureProposal

    def drawn(self, log_prob: LogProb, rng: Random, draws: int) -> Weighted:
        """Draw and weigh for a posterior; where Newton steps led nowhere the weight is nothing.

        - `log_prob`: (n, size) -> (n,), of the coordinates in which the optimum is.
        """
        w = self.law.sample(rng, draws)
        modes = self.slices.at(w)
        d = len(self.centre) - self.along.wide
        units = rng.standard_normal((draws, TRIED, d))
        units *= np.sqrt(DOF / rng.chisquare(DOF, (draws, TRIED, 1)))
        q = np.zeros((draws, TRIED, len(self.centre)))
        q[..., : self.along.wide] = w[:, None]
        volume = np.full(draws, np.inf)
        for i, mode in enumerate(modes):
            if mode is not None:
                q[i, :, self.along.wide :] = units[i]
                bent = slice(self.along.wide, self.along.wide + self.along.narrow)
                top = mode.x[: self.along.narrow]
                q[i, :, bent] = top + units[i, :, : self.along.narrow] @ mode.factor.T
                volume[i] = np.sum(np.log(np.diag(mode.factor)))
        z = self.centre + q @ self.along.factor.T
        raw = np.asarray(log_prob(z.reshape(draws * TRIED, -1)), dtype=float).reshape(draws, TRIED)
        raw = np.where(np.isfinite(raw) & np.isfinite(volume)[:, None], raw, -np.inf)
        student = -0.5 * (DOF + d) * np.log1p(np.sum(units**2, axis=-1) / DOF)
        log_weight = raw - student + np.where(np.isfinite(volume), volume, 0.0)[:, None]
        # One of those tried, each with the chance that its weight gives it.
        gumbel = rng.gumbel(size=log_weight.shape)
        kept = np.argmax(log_weight + gumbel, axis=1)
        mean = np.logaddexp.reduce(log_weight, axis=1) - np.log(TRIED)
        rows = np.arange(draws)
        return Weighted(z[rows, kept], raw[rows, kept], mean - self.law.log_density(w))


def nested(found: Found, chart: Chart, shares: Floats, rng: Random) -> Nested | None:
    """Fit the law of what is hardly told; None where all is told, or nothing is.

    - `chart`: coordinates in which conditional modes lie near each other. - `shares` (optima,): of
      the posterior. Where those off the ridge hold more than ELSEWHERE there is no such law.
    """
    held = is_noise(found.problem)
    local = expansion_of(found.problem, chart)
    at = [(chart.straight(o.z), s) for o, s in zip(found.optima, shares.tolist(), strict=True)]
    return nested_about(local, chart.straightened(found.optima[0]), held, rng, at[1:])


def nested_about(
    local: Local,
    there: Optimum,
    held: NDArray[np.bool_],
    rng: Random,
    others: Sequence[tuple[Floats, float]] = (),
) -> Nested | None:
    """Fit the law of what is hardly told around an optimum.

    - `held` (size,): entries that conditional modes leave as they are. - `others`: places (size,)
      of other optima, and their shares of the posterior.
    """
    along = directions(there, held, min(WIDE))
    if not along.wide or not along.narrow:
        return None
    about = partial(mode_at, local, there, along)
    origin = about(np.zeros(along.wide), np.zeros(along.narrow + there.standard.size))
    if origin is None:
        return None
    slices = Slices(about, [origin])
    off = sum(s for z, s in others if s > 0.0 and not _on_ridge(slices, along, z - there.z))
    if off > ELSEWHERE:
        return None
    law = adapted(slices.marginal, _first(there.z, along), rng, ROUND, DOF)
    return Nested(there.z, along, slices, law)


def _on_ridge(slices: Slices, along: Directions, away: Floats) -> bool:
    """Whether the way along the ridge, from its optimum, leads to a place `away` (size,) of it."""
    q = np.asarray(np.linalg.solve(along.factor, away), dtype=np.float64)
    w, x = q[: along.wide], q[along.wide : along.wide + along.narrow]
    mode = None
    for step in range(1, STRIDES + 1):
        mode = slices.at(step / STRIDES * w[None])[0]
        if mode is None:
            return False
    assert mode is not None  # of the last step
    off = np.linalg.solve(mode.factor, mode.x[: along.narrow] - x)
    return bool(np.sqrt(np.mean(off**2)) < SAME_WITHIN)


def _first(centre: Floats, along: Directions) -> MixtureProposal:
    """Laws of w as told around the optimum, and as the prior has it."""
    axes = along.factor[:, : along.wide] / along.widths
    near = Mode(np.zeros(along.wide), np.eye(along.wide), 0.0)
    far = Mode(-(centre @ axes) / along.widths, np.diag(1.0 / along.widths), 0.0)
    weights = np.array([1.0 - FAR_SHARE, FAR_SHARE])
    return MixtureProposal((near,), weights, FIRST_DOF, (far,))

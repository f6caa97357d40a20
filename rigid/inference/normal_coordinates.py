"""Normal coordinates: those in which the posterior around an optimum is straight to second order.

Records tell some combinations of the numbers a thousand times better than the priors tell each of
them: the release k_LC over the masses that swing, the frame the sum of 1/k_LC and 1/k_frame. The
posterior then is a thin sheet, and a bent one: within one standard deviation of k_frame it leaves
its tangent by several of its thicknesses. No Gaussian law covers it.

What bends it is how the information matrix G changes from place to place. In units q of the
Gaussian law at the optimum, where G is the identity, the widest direction first,

    v_k = q_k + 1/2 sum_{i,j<k} C_ijk q_i q_j,    C_ijk = 1/2 (dG_jk/dq_i + dG_ik/dq_j - dG_ij/dq_k)

with Christoffel's symbols C. These are Riemann's normal coordinates (do Carmo 1992, "Riemannian
geometry", chapter 3), but for terms that would bend a direction by one that is not much wider.
Without them each q_k follows from v_k and the wider q, and volumes are kept: densities are the same
in q and in v. Nor would they straighten anything: of two directions that the priors tell and the
records hardly, G changes from place to place by orders of magnitude, and what bends at second order
folds at third. A chain in such coordinates stays where it began (docs/studies/validation.md).
"""

import dataclasses
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from rigid.inference.coordinates import Bend, Chart, Floats, chart_of
from rigid.inference.newton import expanded, is_noise, joined
from rigid.inference.search import Found, Optimum
from rigid.likelihood.problem import Problem

WIDE = 0.02
"""Posterior sd [prior sds] of directions along which G is taken to change: the records are all but
linear along narrower ones. With 0.003 the law covers no better (docs/studies/coordinates.md)."""
THIN = 0.3
"""Width, of that of the directions that bend it, up to which a direction is bent."""


def normal_chart(found: Found) -> Chart:
    """Return the normal coordinates at the best optimum of a search."""
    problem, best = found.problem, found.optima[0]
    chart = chart_of(problem)
    # `expanded` holds noise levels; they do not bend what the records say of the other numbers.
    bend = bend_of(
        lambda u: _information(problem, chart, best, u),
        chart.straightened(best),
        is_noise(problem),
    )
    return dataclasses.replace(chart, bend=bend)


def bend_of(
    information: Callable[[Floats], Floats], there: Optimum, held: NDArray[np.bool_]
) -> Bend:
    """Return what straightens a posterior around an optimum.

    - `information`: u (size,) -> G (size, size); where it is no number the posterior is taken for
      straight. - `held` (size,): entries on which it tells nothing.
    """
    variance, axes = np.linalg.eigh(there.covariance)
    width, axes = np.sqrt(variance[::-1]), axes[:, ::-1]
    factor = axes * width
    wide = np.flatnonzero((width > WIDE) & (np.sum(axes[held] ** 2, axis=0) < 0.5))

    def informed(step: Floats) -> Floats:
        return factor.T @ information(there.z + step) @ factor

    steps = np.concatenate([factor.T[wide], -factor.T[wide]])
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        up, down = np.split(np.array([*pool.map(informed, steps)]).reshape(-1, *factor.shape), 2)
    changes = np.zeros((len(width),) * 3)
    changes[wide] = np.nan_to_num(0.5 * (up - down), posinf=0.0, neginf=0.0)
    return Bend(there.z, factor, _symbols(changes, width))


def _symbols(changes: Floats, width: Floats) -> Floats:
    """Christoffel's symbols (i, j, k) of dG_jk/dq_i (i, j, k), where k is thin beside i and j.

    - `width` (k,): of the directions, falling.
    """
    symbols = 0.5 * (changes + changes.transpose(1, 0, 2) - changes.transpose(1, 2, 0))
    thin = width <= THIN * width[:, None]
    return symbols * thin[:, None] * thin


def _information(problem: Problem, chart: Chart, best: Optimum, u: Floats) -> Floats:
    """Information on u (size, size) at u (size,), gains and zeros integrated out, noise held.

    Where the rig cannot be simulated there it is no number.
    """
    noise = is_noise(problem)
    free = np.flatnonzero(~noise)
    z, n = chart.standard(u), len(free)
    whole = expanded(problem, joined(problem, z, best.standard), z[noise]).information
    shared = np.asarray(whole)[:n, n:]
    known = np.zeros((len(z), len(z)))
    known[np.ix_(free, free)] = whole[:n, :n] - shared @ np.linalg.solve(whole[n:, n:], shared.T)
    back = np.linalg.inv(chart.slopes(z))
    return back.T @ known @ back

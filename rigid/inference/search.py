"""Best fits from many starts, and the Gaussian law around each.

The release record has several optima in (k_LC, mu); a single start ends in one of them without a
sign of it. Starts are drawn from the prior and each is led to an optimum of the exact likelihood,
first with the noise taken for a thousand and for thirty times what it is: where the records tell a
part in ten thousand a bent valley lies, along which descents creep; from afar it is a bowl. Starts
that a coarse descent has led to one point go on as one. Runs of a machine, which may swing through
many periods, are fitted from their beginnings on. Where profiles of the best end lead to
other optima, these are taken in (`profiles`). Then noise levels and correlation times are brought
up to date and the best optima refined.
"""

import contextlib
import dataclasses
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from rigid.inference.descents import AGREE, Descents, End, Led, agree, distance, through
from rigid.inference.newton import Expansion, descend, is_noise, joined, lower, split
from rigid.inference.noise_levels import fit_noise, noise_curvature, noise_gain
from rigid.inference.profiles import other_optima
from rigid.inference.scores import residuals, score_correlation, scores, weighted
from rigid.inference.settled import Settled, away_from_top, settled
from rigid.inference.stages import eased
from rigid.io.errors import InputError
from rigid.likelihood.noise_spectrum import NoiseLaw
from rigid.likelihood.problem import Problem, log_density
from rigid.likelihood.set_aside import readings_of, set_aside, without

KEEP_WITHIN = 40.0
"""Optima that lie further below the best in log-posterior have a weight below 1e-17."""
FIRST = 2
"""Points whose optimum is told before the others go, where two starts agree on it."""
SAME_WITHIN = 3.0
"""Optima closer than this many standard deviations (root of mean square) are one."""
REFINEMENTS, MOST_REFINEMENTS = 2, 12
"""Rounds of noise levels, correlation and optimum in turn, until the optimum stands: least, most.
With a right model that is two; where a model misses much, each of the three moves the others."""
MOST_CLIMBS = 3
"""Times that profiles are followed to a better optimum."""
STANDS = 0.05
"""Nats by which another round may still raise the log-posterior."""


@dataclasses.dataclass(frozen=True)
class Optimum:
    """One mode of the posterior.

    - `z` (size,); `standard` (sensors, 2): gains and zeros there.
    - `covariance` (size, size): of the Gaussian law around it.
    - `log_posterior`: at `z`. - `reached`: number of starts that ended there.
    - `away` [posterior sds]: no number was further from the top of the expansion there.
    """

    z: np.ndarray
    standard: np.ndarray
    covariance: np.ndarray
    log_posterior: float
    reached: int
    away: float


@dataclasses.dataclass(frozen=True)
class Found:
    """Outcome of a search.

    - `problem`: with weights for the correlation found. - `optima`: best first.
    - `correlation`: by (group, quantity, track), of the scores at the best optimum.
    - `starts`: how many there were. - `levels` (starts,): what each reached, as minus the
      log-posterior.
    - `aside` (n,): samples that do not count, in the order of `set_aside.readings_of`.
    """

    problem: Problem
    optima: tuple[Optimum, ...]
    correlation: dict[tuple[int, str, int], NoiseLaw]
    starts: int
    levels: np.ndarray
    aside: np.ndarray

    @property
    def settled(self) -> Settled:
        """Whether the best optimum is one: flat, and near the priors of its numbers."""
        problem, best = self.problem, self.optima[0]
        free = [p.label for p in problem.parameters.sampled if p.base != "noise"]
        sensors = [f"{part}[{s}]" for s in problem.sensors for part in ("gain", "zero")]
        w = joined(problem, best.z, best.standard)
        return settled([*free, *sensors], w, best.away)


@contextlib.contextmanager
def compiling(problem: Problem) -> Iterator[None]:
    """Have the programs of a fit compiled, that of the search first.

    XLA fills one core with a program, and Python traces one at a time: the others are traced while
    the search is compiled, and are ready when the context ends. What needs one earlier waits.
    """
    z_noise, zero = centre(problem)
    z = np.zeros(problem.parameters.size)
    nowhere = np.full_like(joined(problem, z, zero), np.nan)  # the solver ends there at once
    with ThreadPoolExecutor(1) as pool:
        lower(problem, nowhere, z_noise)
        ready = pool.submit(scores, problem, z)  # asks for all others
        descend(problem, nowhere, z_noise)
        yield
        ready.result()


def prior_draws(problem: Problem, count: int, seed: int) -> np.ndarray:
    """Draws of the prior (count, size), its centre first."""
    drawn = np.random.default_rng(seed).standard_normal((count, problem.parameters.size))
    drawn[0] = 0.0
    return drawn


def centre(problem: Problem) -> tuple[np.ndarray, np.ndarray]:
    """Noise levels, and gains and zeros (sensors, 2), at the centre of their priors."""
    return np.zeros(int(is_noise(problem).sum())), np.zeros((len(problem.sensors), 2))


def search(
    problem: Problem, starts: int, seed: int, report: Callable[[int], None] = lambda _: None
) -> Found:
    """Find the modes of the posterior from `starts` draws of the prior.

    - `report(done)` is called after each start.
    """
    return search_from(problem, prior_draws(problem, starts, seed), report)


def search_from(
    problem: Problem,
    first: np.ndarray,
    report: Callable[[int], None] = lambda _: None,
    counts: np.ndarray | None = None,
    answered: Callable[[Found], None] | None = None,
) -> Found:
    """Find the modes of the posterior that points z (points, size) lead to.

    - `counts` (points,): how many starts had led to each, one where left out. - `answered`: is told
      the optimum of the first FIRST points as soon as two starts agree on it, before the others go.
    """
    z_noise, zero = centre(problem)
    counts = np.ones(len(first), dtype=int) if counts is None else counts
    ends = [End(joined(problem, z, zero), n) for z, n in zip(first, counts.tolist(), strict=True)]
    stages = tuple(Descents(one, z_noise) for one in eased(problem))
    if answered is not None and len(ends) > FIRST:
        led = through(stages, ends[:FIRST])
        if agree(led):
            with contextlib.suppress(InputError):  # an end that others may lead away from
                answered(_refined(problem, _by_value(led), _levels(led), z_noise))
    led = through(stages, ends, report)
    return _refined(problem, _with_others(problem, led, z_noise), _levels(led), z_noise)


def _levels(led: Led) -> np.ndarray:
    """What each start has reached, as minus the log-posterior; inf where that is no number."""
    levels = np.array([at.value if np.isfinite(at.value) else np.inf for _, at in led])
    return np.repeat(levels, [end.starts for end, _ in led])


def _by_value(led: Led) -> list[End]:
    """Ends with a value, the best first."""
    some = [(end, there) for end, there in led if np.isfinite(there.value)]
    return [end for end, _ in sorted(some, key=lambda one: one[1].value)]


def _with_others(problem: Problem, led: Led, z_noise: np.ndarray) -> list[End]:
    """Return the ends of a search, the best first, and the optima along the profiles of that.

    Those have the starts of the end that led there. Where one is better, its profiles are followed.
    """
    ends = sorted((one for one in led if np.isfinite(one[1].value)), key=lambda one: one[1].value)
    if not ends:
        return [end for end, _ in led]
    for _ in range(MOST_CLIMBS):
        end, there = ends[0]
        for w, at in other_optima(problem, end.w, there, z_noise):
            known = np.asarray(at.information)
            if all(distance(one.w, w, known) > SAME_WITHIN for one, _ in ends):
                ends.append((End(w, end.starts), at))
        ends.sort(key=lambda one: one[1].value)
        if ends[0][1].value > there.value - AGREE:
            break
    return [end for end, _ in ends]


def _refined(problem: Problem, ends: list[End], levels: np.ndarray, z_noise: np.ndarray) -> Found:
    """Bring noise and correlation up to date at the best end, then refine all good ends.

    What then stands off its neighbours, or beyond a sensor's range, is set aside.

    - `ends`: the best first. - `levels` (starts,): what each start has reached.
    """
    best = ends[0].w
    plain, aside = problem, np.zeros(sum(p.data.size for p in problem.pieces), dtype=bool)
    moved = np.inf
    for done in range(MOST_REFINEMENTS):
        z, standard = (np.asarray(part) for part in split(plain, best, z_noise))
        if done >= REFINEMENTS and moved + noise_gain(problem, z) < STANDS:
            break
        z = fit_noise(plain if done < REFINEMENTS else problem, z)
        more = _aside(plain, z)
        if more.any():
            aside |= more
            plain = without(plain, more)
            z = fit_noise(plain, z)
        z_noise = z[is_noise(plain)]
        correlation = score_correlation(plain, z)
        problem, before = weighted(plain, correlation), best
        best, there = descend(problem, joined(plain, z, standard), z_noise)
        moved = 0.5 * float((best - before) @ np.asarray(there.information) @ (best - before))
    optima = [
        _optimum(problem, end, reached, there, z_noise)
        for end, reached, there in _distinct(problem, [End(best, 0), *ends], z_noise)
    ]
    optima = [one for one in optima if np.isfinite(one.away)]
    if not optima:
        raise InputError(
            "the search ended where the slopes of the simulated readings grow without bound, so "
            "that no optimum can be told; of the rig, look whether a record stays in the change "
            "of stage of the pump (near p_max), and leave that record out with fit = false"
        )
    optima.sort(key=lambda o: -o.log_posterior)
    kept = tuple(o for o in optima if o.log_posterior > optima[0].log_posterior - KEEP_WITHIN)
    return Found(problem, kept, correlation, len(levels), levels, aside)


def _aside(problem: Problem, z: np.ndarray) -> np.ndarray:
    """Samples that do not count at z (n,)."""
    listed = problem.parameters
    placed = [*zip(listed.sampled, z, strict=True), *((p, 0.0) for p in listed.known)]
    level = {p.label: float(p.prior.from_standard(at)) for p, at in placed if p.base == "noise"}
    sigma = np.array([level[f"noise[{s}]"] for s in problem.sensors])
    return set_aside(readings_of(problem, sigma), residuals(problem, z))


def _distinct(problem: Problem, ends: list[End], z_noise: np.ndarray) -> list[list]:
    """Refine the first end and all that are no copies of it, a core each.

    Returns end, number of starts that reached it and expansion, for each that is good enough.
    """
    found: list[list] = []
    floor, cores = np.inf, os.cpu_count() or 1
    with ThreadPoolExecutor(max_workers=cores) as pool:
        for begin in (0, *range(1, len(ends), cores)):
            some = ends[begin : begin + (cores if begin else 1)]
            fresh = [end for end in some if _copy_of(found, end.w) is None]
            refined = pool.map(lambda end: descend(problem, end.w, z_noise), fresh)
            for end in some:
                near = _copy_of(found, end.w)
                if any(end is other for other in fresh):
                    w, there = next(refined)
                    floor = min(floor, there.value)
                    near = _copy_of(found, w)
                    if near is None and there.value < floor + KEEP_WITHIN:
                        near = [w, 0, there]
                        found.append(near)
                if near is not None:
                    near[1] += end.starts
    return found


def _copy_of(found: list[list], w: np.ndarray) -> list | None:
    """Return the end that w is a copy of."""
    return next((f for f in found if distance(f[0], w, f[2].information) < SAME_WITHIN), None)


def _optimum(
    problem: Problem, w: np.ndarray, reached: int, there: Expansion, z_noise: np.ndarray
) -> Optimum:
    """Lay the Gaussian law around an end of the solver."""
    z, standard = (np.asarray(part) for part in split(problem, w, z_noise))
    covariance = np.zeros((len(z), len(z)))
    free, noisy = np.flatnonzero(~is_noise(problem)), np.flatnonzero(is_noise(problem))
    gradient, known = np.asarray(there.gradient), np.asarray(there.information)
    covariance[np.ix_(free, free)] = np.linalg.inv(known)[: len(free), : len(free)]
    covariance[noisy, noisy] = 1.0 / np.maximum(noise_curvature(problem, z)[1], 1.0)
    value = float(log_density(problem, z[None])[0])
    return Optimum(z, standard, covariance, value, reached, away_from_top(gradient, known))


def refit(problem: Problem, found: Found) -> Optimum:
    """Lead the best optimum of a search to that of a problem of the same records and parameters.

    - `problem`: differs in priors only; it takes over weights and noise levels.
    """
    weights = {(p.group, p.quantity): np.asarray(p.weight) for p in found.problem.pieces}
    problem = problem.with_weights(weights)
    best = found.optima[0]
    z_noise = best.z[is_noise(problem)]
    end, there = descend(problem, joined(problem, best.z, best.standard), z_noise)
    return _optimum(problem, end, 0, there, z_noise)

"""The inference of a fit: search, proposal, ensembles, and what the draws say."""

import contextlib
import dataclasses
import hashlib
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rigid.inference.adaptation import LEAST_WEIGHT, adapted
from rigid.inference.checkpoint import Checkpoint
from rigid.inference.coordinates import Chart
from rigid.inference.curvature import sharpened
from rigid.inference.derived import (
    ChannelDraws,
    channels,
    evaluations,
    frictions,
    sensor_draws,
    values_of,
)
from rigid.inference.friction_curve import Friction
from rigid.inference.overlooked import overlooked
from rigid.inference.pointwise import Blocks, blocks
from rigid.inference.posterior import stack
from rigid.inference.proposal import UNRELIABLE, MixtureProposal, ModeWeights, mode_weights
from rigid.inference.reference_check import SolverCheck, against_reference
from rigid.inference.ridge import Ridge, as_wide_as_prior, ridge_of
from rigid.inference.sample import Draws
from rigid.inference.sampling import Kept, sampled
from rigid.inference.search import Found, compiling, search_from
from rigid.inference.search_cache import Searched, once
from rigid.inference.steady_first import beginnings, steady_part, with_ease
from rigid.io.cache import Shelf
from rigid.io.cli import Options
from rigid.io.progress import say, stage
from rigid.io.version import __version__
from rigid.likelihood.effect_lookup import marks
from rigid.likelihood.problem import Problem, log_density
from rigid.records.record import Record
from rigid.spec import Spec

KEPT_STEPS = 20
"""Steps of each walker that enter posterior.nc, evenly taken from all."""

TABLED_STEPS = 200
"""Steps of each walker that the tables rest on."""

PREDICTED = 128
"""Draws from which predictions beside the data are made."""

MODE_DRAWS = 2048
REMADE = "the laws around the best fits do not fit: taken from differences instead"
FAR_SHARE = 0.2
"""Of the first draws, for laws as wide as the prior along what is hardly told."""
FIRST_DOF, DOF = 8.0, 16.0
"""Of the Student laws around the best fits, whose widths are not known well, and of those fitted to
the posterior: heavier tails than a Gaussian, so that no region is proposed too rarely."""


@dataclasses.dataclass(frozen=True, eq=False)
class Asked:
    """What is fitted: a spec, its records as read, and the problem of both, from `assemble`."""

    spec: Spec
    records: tuple[Record, ...]
    problem: Problem


@dataclasses.dataclass(frozen=True)
class Calibrated:
    """All that a fit found.

    - `known`: modes and correlation, coordinates and the law over the modes. - `draws`: of the
      sampler.
    - `values`: SI by label, (chain, draw) each, for the tables. - `frictions`: mu(omega) of the
      same draws, flat.
    - `kept`: `values` of the fewer draws in posterior.nc; `kept_frictions` as well.
    - `sensors`: gain and zero (2, n) of each sensor. - `tracks`: log-likelihoods of each record.
    - `blocks`: those of short stretches of every channel.
    - `shown`, `prior_shown`: channels beside posterior and prior predictions.
    - `solver`: the fast solver against diffrax, None where nothing is solved.
    - `seed`; `compile_s`: time until the search was compiled.
    """

    known: Searched
    draws: Draws
    values: dict[str, np.ndarray]
    frictions: dict[str, Friction]
    kept: dict[str, np.ndarray]
    kept_frictions: dict[str, Friction]
    sensors: dict[str, np.ndarray]
    tracks: dict[str, np.ndarray]
    blocks: Blocks
    shown: list[ChannelDraws]
    prior_shown: list[ChannelDraws]
    solver: SolverCheck | None
    records: tuple[Record, ...]
    seed: int
    compile_s: float

    @property
    def found(self) -> Found:
        """What the search found."""
        return self.known.found

    @property
    def weights(self) -> ModeWeights:
        """How much of the posterior each mode holds."""
        return self.known.weights

    @property
    def problem(self) -> Problem:
        """The problem that was solved."""
        return self.found.problem

    @property
    def shape(self) -> tuple[int, int]:
        """Chains and draws of `values`."""
        return next(iter(self.values.values())).shape

    @property
    def kept_shape(self) -> tuple[int, int]:
        """Chains and draws of `kept`."""
        return next(iter(self.kept.values())).shape

    @property
    def ensembles(self) -> int:
        """Number of independent ensembles."""
        return self.draws.z.shape[0]


class Listener(NamedTuple):
    """Who is told what a search has found before the chain runs.

    - `first`: the optimum that two starts agree on, while the others are under way. - `searched`:
      all, and what `first` was told; None: nothing.
    """

    first: Callable[[Found], None]
    searched: Callable[[Found, Found | None], None]


def calibrate(
    asked: Asked, options: Options, folder: Path, listener: Listener | None = None
) -> Calibrated:
    """Fit a spec to its records.

    - `folder`: where the chain is kept; the caller holds it locked.
    - `listener`: is told what the search found, before the chain runs.
    """
    spec, records = asked.spec, asked.records
    seed = spec.sampler.seed if options.seed is None else options.seed
    began = time.monotonic()
    with contextlib.ExitStack() as until:
        with stage(options.quiet, "compile") as shown:
            until.enter_context(compiling(asked.problem))
            shown.reach(0, f"{asked.problem.parameters.size} parameters")
        compile_s = time.monotonic() - began
        known = search_once(asked, options, folder, listener)
    mark = _mark(asked, seed) | {"coordinates": known.chart.mark}
    rule = {"rule": f"R-hat {spec.sampler.r_hat:g}, ESS {spec.sampler.ess:g}"}
    kept = Kept(
        Shelf(folder, mark | rule, options.resume), Checkpoint(folder, mark, options.resume)
    )
    draws = sampled(spec.sampler, known, (seed, options), kept)
    with stage(options.quiet, "predict and check"):
        return _told(known, draws, records, (seed, compile_s))


def search_once(
    asked: Asked, options: Options, folder: Path, listener: Listener | None = None
) -> Searched:
    """Search and fit a law to the posterior around the modes, or take what a folder keeps of it."""
    spec, problem = asked.spec, asked.problem
    seed = spec.sampler.seed if options.seed is None else options.seed

    def made() -> Searched:
        begin = partial(beginnings, spec, asked.records, problem, seed)
        if steady_part(spec) is None:
            first = begin()
        else:
            starts = with_ease(spec.sampler.starts)
            with stage(options.quiet, "search the steady rig", starts, "starts") as shown:
                first = begin(shown.reach)
        told: list[Found] = []

        def answered(found: Found) -> None:
            told.append(found)
            if listener is not None:
                listener.first(found)

        early = None if listener is None else answered
        with stage(options.quiet, "search", int(first.counts.sum()), "starts") as shown:
            found = search_from(problem, first.z, shown.reach, first.counts, early)
        if listener is not None:
            listener.searched(found, told[0] if told else None)
        with stage(options.quiet, "approximate the posterior"):
            return trusted(found, seed, lambda: say(options.quiet, REMADE))

    return once(Shelf(folder, _mark(asked, seed), options.resume), problem, made)


def _mark(asked: Asked, seed: int) -> dict[str, str]:
    """What a search and a chain depend on, by name."""
    return fingerprint(asked.spec, asked.records, seed) | marks(asked.problem.effects)


def trusted(found: Found, seed: int, remade: Callable[[], None] = lambda: None) -> Searched:
    """Fit a law to the posterior around the modes of a search.

    Where the laws around the best fits do not cover it they are made anew from differences, which
    `remade` is told. The law is in coordinates along the ridge of the posterior.
    """
    ridge = ridge_of(found)
    first = propose(found, np.random.default_rng([seed, 1]), ridge)
    if first.weights.pareto_k < UNRELIABLE:
        return first
    remade()
    again = sharpened(found, first.chart)
    return propose(again, np.random.default_rng([seed, 1]), ridge)


def propose(found: Found, rng: np.random.Generator, ridge: Ridge | None = None) -> Searched:
    """Fit a mixture of laws to the posterior around the modes.

    - `ridge`: gives the coordinates; left out: that through the best fit.
    """
    ridge = ridge_of(found) if ridge is None else ridge
    chart = ridge.chart
    density = chart.density(lambda z: log_density(found.problem, z))
    law = adapted(density, laid_over(found, chart), rng, MODE_DRAWS * len(found.optima), DOF)
    weights = mode_weights(density, law, rng, MODE_DRAWS)
    even = law.shared(np.ones(len(law.modes)))
    missed = overlooked(density, even, weights.greatest, ridge, rng)
    law = law.shared(np.maximum(weights.weights, LEAST_WEIGHT))
    return Searched(found, chart, law, weights, missed)


def laid_over(found: Found, chart: Chart) -> MixtureProposal:
    """Lay a law over each mode, as curvature tells it, and one that the prior tells beside it."""
    modes = tuple(chart.mode(o) for o in found.optima)
    wider = tuple(as_wide_as_prior(found.problem, chart.straightened(o)) for o in found.optima)
    weights = np.repeat([1.0 - FAR_SHARE, FAR_SHARE], len(modes))
    return MixtureProposal(modes, weights, FIRST_DOF, wider)


def fingerprint(spec: Spec, records: tuple[Record, ...], seed: int) -> dict[str, str]:
    """What a chain depends on, by name; when to stop is not part of it."""
    # Where a file lies does not matter, what it holds is in its own mark.
    left_out = dict.fromkeys(
        ("text", "path", "why_solver", "sampler", "title", "bands", "plan"), True
    )
    body = spec.model_dump(mode="json", exclude=left_out | {"records": {"__all__": {"file"}}})
    widths = spec.sampler.model_dump(include={"ensembles", "walkers", "block", "starts"})
    said = hashlib.sha256(repr((body, widths, seed)).encode()).hexdigest()
    return {"spec": said, "version": __version__} | {
        f"record {r.name},{r.cylinder}": r.sha256 for r in records
    }


def _told(
    known: Searched,
    draws: Draws,
    records: tuple[Record, ...],
    run: tuple[int, float],
) -> Calibrated:
    """Work out what the draws say of everything that is reported."""
    seed, compile_s = run
    found = known.found
    problem, rng = found.problem, np.random.default_rng([seed, 2])
    kept, kept_curves, flat = _valued(problem, draws.thinned(KEPT_STEPS))
    # Compiled programs release the interpreter: the rest is worked out while these solve.
    with ThreadPoolExecutor(max_workers=1) as beside:
        solver = beside.submit(against_reference, problem, found.optima[0].z, flat, seed)
        values, curves, _ = _valued(problem, draws.thinned(TABLED_STEPS))
        tracks, laws = evaluations(problem, flat)
        picked = flat[rng.choice(len(flat), PREDICTED - 1, replace=False)]
        best = found.optima[0].z[None]
        prior = rng.standard_normal((PREDICTED, flat.shape[1]))
        sensors = sensor_draws(laws, rng)
        return Calibrated(
            known=known,
            draws=draws,
            values=values,
            frictions=curves,
            kept=kept,
            kept_frictions=kept_curves,
            sensors=sensors,
            tracks=tracks,
            blocks=blocks(found, flat, sensors),
            shown=channels(found, np.concatenate([best, picked]), seed),
            prior_shown=channels(found, prior, seed),
            solver=solver.result(),
            records=records,
            seed=seed,
            compile_s=compile_s,
        )


def _valued(problem: Problem, draws: Draws) -> tuple[dict, dict, np.ndarray]:
    """SI values (chain, draw) by label, friction curves and flat z of draws."""
    chain = stack(draws.z)
    flat = chain.reshape(-1, chain.shape[-1])
    values = values_of(problem, flat)
    shaped = {label: v.reshape(chain.shape[:2]) for label, v in values.items()}
    return shaped, frictions(problem, values), flat

"""Waves over the stroke are found with their length, and made up of nothing in no record."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from rigs import BASE, SHEETS, converted, drive, effects, parameters, track
from scipy.special import logsumexp

from rigid.discovery.fitted import Fitted
from rigid.discovery.signatures import laid_out
from rigid.discovery.turn import weigh
from rigid.discovery.unmodelled.waves import FINER, Wave, waves
from rigid.discovery.weighing.explain import Bundled, best_waves
from rigid.effects import CATALOGUE
from rigid.io.cache import Shelf
from rigid.likelihood.channels import make_pieces
from rigid.likelihood.groups import SlowGroup
from rigid.likelihood.priors import Lognormal
from rigid.likelihood.problem import Problem
from rigid.likelihood.tracks import Series
from rigid.localfit.ascent import refined
from rigid.localfit.evidence import Bundle
from rigid.localfit.expansion import Point, expanded
from rigid.localfit.families import families
from rigid.localfit.hypothesis import Hypothesis, start
from rigid.localfit.local import LocalFit
from rigid.localfit.samples import lay_out

LENGTH, PHASE, FORCE = 5.3e-3, 0.7, 40.0
CHOICE = (CATALOGUE["piston-leakage"], CATALOGUE["constant-force"])


def campaign(seed: int, force: float) -> Problem:
    """Two free runs whose bore pushes to and fro; the gauge reads F/S of it."""
    flows = {"kappa[free-run-1,A]": 0.2, "kappa[free-run-2,B]": 0.15}
    tracks = tuple(
        track(name[6:-1], "free-run", 600, drive=drive(600, (0.5, 28.0), (0, 1, 0)))
        for name in flows
    )
    sensors = tuple(f"{q},{c}" for c in "AB" for q in SlowGroup.quantities)
    listed = parameters(
        {"mu": Lognormal(1e6, 1.5), **{k: Lognormal(v, 1.2) for k, v in flows.items()}},
        quantities=sensors,
    )
    truth = listed.values(jnp.zeros((1, listed.size))) | {"mu": jnp.asarray([1e6])}
    truth |= {k: jnp.asarray([v]) for k, v in flows.items()}
    rng, series = np.random.default_rng(seed), {}
    for one in tracks:
        ideal = {q: x[:, 0, 0] for q, x in SlowGroup((one,), effects(BASE)).predict(truth).items()}
        bore = force * np.sin(2.0 * np.pi * np.asarray(ideal["stroke"]) / LENGTH + PHASE)
        ideal["pressure"] = ideal["pressure"] + bore / float(truth["S_Pl"][0])
        data = {q: converted(x, SHEETS[q], rng) for q, x in ideal.items()}
        series[one.label] = Series(data, {q: np.ones(one.samples) for q in data})
    groups = (SlowGroup(tracks, effects(BASE)),)
    return Problem(effects(BASE), listed, groups, make_pieces(groups, series, SHEETS))


def fitted(problem: Problem) -> tuple[LocalFit, tuple]:
    programs = families(problem, CHOICE)
    noise = np.zeros(sum(p.base == "noise" for p in problem.parameters.sampled))
    w = start(problem, np.zeros(problem.parameters.size), np.zeros((len(problem.sensors), 2)))
    begun = expanded(programs[0], Point(Hypothesis(problem), lay_out(problem), w, noise))
    return refined(begun, most=40), programs


@pytest.mark.slow
def test_a_rough_bore_is_found_with_its_length():
    local, programs = fitted(campaign(1, FORCE))
    bench = laid_out(Fitted(local, programs), CHOICE, Shelf())
    explained = weigh(local, bench, 1)
    target = next(iter(explained.hidden))
    bundle = explained.bundle_of(target)
    assert (target.of.kind, target.about.equation) == ("force", "plunger-momentum")
    span = 0.2  # m, at least, of stroke in each record
    assert target.period == pytest.approx(LENGTH, abs=LENGTH**2 / (FINER * span))
    mean, covariance = bundle.amplitudes(explained.screening.slope)
    sizes = np.hypot(mean[::2], mean[1::2])
    assert np.all(np.abs(sizes - FORCE) < 4.0 * np.sqrt(np.diag(covariance)[::2]))
    assert explained.unnamed > max(*explained.effects.values(), 10.0)
    assert explained.p_value < 0.01


@pytest.mark.slow
def test_no_wave_is_found_where_there_is_none():
    local, programs = fitted(campaign(2, 0.0))
    explained = weigh(local, laid_out(Fitted(local, programs), CHOICE, Shelf()), 2)
    assert explained.unnamed < 2.0
    assert explained.p_value > 0.01


@pytest.mark.slow
def test_a_wave_is_counted_for_the_share_of_lengths_that_it_stands_for():
    """Where nothing is, a Bayes factor is 1 in the mean; that of the best, so weighed, is less."""
    local, _ = fitted(campaign(3, 0.0))
    found = waves(local)
    for target in dict.fromkeys(found.target):
        mine = np.array([t == target for t in found.target])
        columns = found.columns[:, mine]
        information = columns.T @ (columns * local.terms.curvature[:, None])
        bundle = Bundle(np.arange(mine.sum()), information)
        drawn = np.zeros((4000, mine.sum()))
        best_waves(drawn, (Bundled(target, bundle),), 5)
        assert _mean_log(bundle, drawn, target) < np.log(1.5)
        careless = dataclasses.replace(target, log_share=0.0)
        assert _mean_log(bundle, drawn, careless) > np.log(3.0)


def _mean_log(bundle: Bundle, drawn: np.ndarray, target: Wave) -> float:
    logs = bundle.log_bayes(drawn) + target.log_share
    return float(logsumexp(logs) - np.log(len(logs)))

"""A ripple of the pump: a line in each record, with a phase of its own."""

import jax.numpy as jnp
import numpy as np
import pytest
from rigs import BASE, SHEETS, converted, drive, effects, parameters, track
from scipy.special import logsumexp

from rigid.discovery.bench import laid_out
from rigid.discovery.fitting.families import families
from rigid.discovery.fitting.hypothesis import Hypothesis, start
from rigid.discovery.fitting.local import Local, expand, refined
from rigid.discovery.fitting.samples import lay_out
from rigid.discovery.lines import lines
from rigid.discovery.weighing.explain import Z_GRID, best_of_many, curves_of_all
from rigid.discovery.workflow import weigh
from rigid.effects import CATALOGUE
from rigid.groups import SlowGroup
from rigid.likelihood import make_pieces
from rigid.priors import Lognormal
from rigid.problem import Problem
from rigid.shelf import Shelf
from rigid.tracks import Series

RIPPLE = CATALOGUE["pump-ripple"]
CHOICE = (CATALOGUE["piston-leakage"], RIPPLE)
FREQUENCY, PHASES, OPEN = 9.37, (2.0, -1.1), 4.0


def campaign(seed: int, amplitude: float) -> Problem:
    """Two free runs with a ripple of one frequency, in each with its own phase."""
    tracks = tuple(
        track(f"free-run-{i},A", "free-run", 600, drive=drive(600, (0.5, 0.5 + OPEN), (0, 1, 0)))
        for i in (1, 2)
    )
    flows = {"kappa[free-run-1,A]": 0.2, "kappa[free-run-2,A]": 0.15}
    listed = parameters(
        {"mu": Lognormal(1e6, 1.5), **{k: Lognormal(v, 1.2) for k, v in flows.items()}},
        quantities=("load,A", "stroke,A", "pressure,A"),
    )
    truth = listed.values(jnp.zeros((1, listed.size))) | {"mu": jnp.asarray([1e6])}
    truth |= {k: jnp.asarray([v]) for k, v in flows.items()}
    truth |= {"ripple": jnp.asarray([amplitude]), "f_ripple": jnp.asarray([FREQUENCY])}
    rng, series = np.random.default_rng(seed), {}
    for one, phase in zip(tracks, PHASES, strict=True):
        here = truth | {"phase_ripple": jnp.asarray([phase])}
        ideal = SlowGroup((one,), (*effects(BASE), RIPPLE)).predict(here)
        data = {q: converted(ideal[q][:, 0, 0], SHEETS[q], rng) for q in ideal}
        series[one.label] = Series(data, {q: np.ones(one.samples) for q in data})
    groups = (SlowGroup(tracks, effects(BASE)),)
    return Problem(effects(BASE), listed, groups, make_pieces(groups, series, SHEETS))


def fitted(problem: Problem) -> tuple[Local, tuple]:
    programs = families(problem, CHOICE)
    noise = np.zeros(sum(p.base == "noise" for p in problem.parameters.sampled))
    w = start(problem, np.zeros(problem.parameters.size), np.zeros((len(problem.sensors), 2)))
    begun = expand(Hypothesis(problem), (programs[0], lay_out(problem)), w, noise)
    return refined(begun, most=40), programs


@pytest.mark.slow
def test_each_record_has_its_own_phase_and_the_ripple_is_found():
    local, programs = fitted(campaign(1, 0.05))
    found, traces = lines(local, programs, RIPPLE)
    strength = np.abs(traces.T @ local.terms.score)
    strength /= np.sqrt(np.einsum("nk,n,nk->k", traces, local.terms.bend, traces))
    for line, phase, size in zip(found, PHASES, strength, strict=True):
        # Cramer and Rao: sds of frequency and phase of a line of strength s over a time T are
        # sqrt(12)/(2 pi T s) and, at the middle, 1/s; the phase is told at the start of the record.
        off = 4.0 / size
        assert abs(line.frequency - FREQUENCY) < 0.55 * off / OPEN + 0.5 / (8 * OPEN)
        middle = 2.0 * np.pi * (line.frequency - FREQUENCY) * (0.5 + 0.5 * OPEN)
        turned = (line.phase + middle - phase + np.pi) % (2.0 * np.pi) - np.pi
        assert abs(turned) < off + 0.1
    bench = laid_out(local, programs, CHOICE, Shelf())
    explained = weigh(local, bench, 1)
    assert explained.effects["pump-ripple"] > max(explained.effects["piston-leakage"], 10.0)
    assert explained.p_value < 0.01


@pytest.mark.slow
def test_no_ripple_is_found_where_there_is_none():
    local, programs = fitted(campaign(2, 0.0))
    explained = weigh(local, laid_out(local, programs, CHOICE, Shelf()), 2)
    assert explained.effects["pump-ripple"] < 2.0
    assert explained.p_value > 0.01


def test_the_best_of_many_counts_no_more_than_all_of_them():
    """Where nothing is a Bayes factor is 1 in the mean; that of the best for its share, less."""
    local, programs = fitted(campaign(3, 0.0))
    found, _ = lines(local, programs, RIPPLE)
    one = found[0].candidate(RIPPLE, {})
    curve = curves_of_all((one,), np.array([100.0]), Z_GRID)[0]
    drawn = np.zeros((4000, 1))
    best_of_many(drawn, np.array([1.0]), [one.tried], 5)
    # Largest of n exponentials: log n + 0.577 in the mean, sd pi/sqrt(6).
    assert (0.5 * drawn**2).mean() == pytest.approx(np.log(one.tried) + 0.577, abs=0.08)
    log = np.interp(drawn[:, 0], Z_GRID, curve)
    assert logsumexp(log) - np.log(len(log)) < np.log(1.5)

"""A ripple of the pump: a line in each record, with a phase of its own."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from rigs import BASE, SHEETS, converted, drive, effects, parameters, track
from scipy.special import logsumexp

from rigid.discovery.fitted import Fitted
from rigid.discovery.periodic import (
    BY_CHANCE,
    FINER,
    MASS,
    QUANTILES,
    Sizes,
    lines,
    log_bayes_of_line,
)
from rigid.discovery.signatures import laid_out
from rigid.discovery.turn import weigh
from rigid.effects import CATALOGUE
from rigid.io.cache import Shelf
from rigid.likelihood.channels import make_pieces
from rigid.likelihood.groups import SlowGroup
from rigid.likelihood.per_record import beating
from rigid.likelihood.priors import Lognormal
from rigid.likelihood.problem import Problem
from rigid.likelihood.tracks import Series
from rigid.localfit.ascent import refined
from rigid.localfit.expansion import Point, expanded
from rigid.localfit.families import families
from rigid.localfit.hypothesis import Hypothesis, start
from rigid.localfit.local import LocalFit
from rigid.localfit.samples import lay_out
from rigid.localfit.signature import signatures

RIPPLE = CATALOGUE["pump-ripple"]
CHOICE = (CATALOGUE["piston-leakage"], RIPPLE)
FREQUENCY, PHASES, OPEN = 9.37, (2.0, -1.1), 4.0
RECORDS = ("free-run-1", "free-run-2")


def campaign(
    seed: int,
    amplitude: float,
    hum: tuple[float, float] = (50.0, 0.0),
    only: str | None = None,
) -> Problem:
    """Two free runs with a ripple of one frequency, in each with its own phase.

    - `hum`: frequency [Hz] of what all sensors pick up, each at an angle of its own, and its
      amplitude in sds of their noise; `only`: in one record.
    """
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
        here = truth | {f"pump_angle[{one.name}]": jnp.asarray([phase])}
        ideal = SlowGroup((one,), (*effects(BASE), RIPPLE)).predict(here)
        angles, turned = iter((0.4, 2.1, -1.3)), 2.0 * np.pi * hum[0] * one.times
        loud = hum[1] if only in (None, one.name) else 0.0
        data = {
            q: converted(
                ideal[q][:, 0, 0] + loud * SHEETS[q].noise * np.sin(turned + next(angles) * phase),
                SHEETS[q],
                rng,
            )
            for q in ideal
        }
        series[one.label] = Series(data, {q: np.ones(one.samples) for q in data})
    groups = (SlowGroup(tracks, effects(BASE)),)
    return Problem(effects(BASE), listed, groups, make_pieces(groups, series, SHEETS))


def fitted(problem: Problem) -> tuple[LocalFit, tuple]:
    programs = families(problem, CHOICE)
    noise = np.zeros(sum(p.base == "noise" for p in problem.parameters.sampled))
    w = start(problem, np.zeros(problem.parameters.size), np.zeros((len(problem.sensors), 2)))
    begun = expanded(programs[0], Point(Hypothesis(problem), lay_out(problem), w, noise))
    return refined(begun, most=40), programs


def turned(angle: float) -> float:
    """An angle between -pi and pi."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


@pytest.mark.slow
def test_each_record_has_its_own_phase_and_the_ripple_is_found():
    local, programs = fitted(campaign(1, 0.05))
    line = lines(Fitted(local, programs), RIPPLE)
    assert line is not None
    signature = signatures(local, programs, [line.candidate(RIPPLE, {})])[:, 0]
    size = np.sqrt(signature @ (signature * local.terms.curvature))
    strength = signature @ local.terms.score / size
    # Cramer and Rao: sds of frequency and phase of a line of strength s over a time T are
    # sqrt(12)/(2 pi T s) and, at the middle, 1/s; the phase is told at the start of the record, and
    # each record has half of the strength in squares.
    off = 4.0 / strength
    assert abs(line.frequency - FREQUENCY) < 0.55 * off / OPEN + 1.0 / (FINER * OPEN)
    for (label, angle), name, phase in zip(line.angles, RECORDS, PHASES, strict=True):
        assert label == f"pump_angle[{name}]"
        middle = 2.0 * np.pi * (line.frequency - FREQUENCY) * (0.5 + 0.5 * OPEN)
        assert abs(turned(angle + middle - phase)) < np.sqrt(2.0) * off + 0.1
    bench = laid_out(Fitted(local, programs), CHOICE, Shelf())
    explained = weigh(local, bench, 1)
    assert explained.effects["pump-ripple"] > max(explained.effects["piston-leakage"], 10.0)
    assert explained.p_value < 0.01


@pytest.mark.slow
def test_no_ripple_is_found_where_there_is_none():
    local, programs = fitted(campaign(2, 0.0))
    explained = weigh(local, laid_out(Fitted(local, programs), CHOICE, Shelf()), 2)
    assert explained.effects["pump-ripple"] < 2.0
    assert explained.p_value > 0.01


def test_two_cylinders_of_one_record_share_the_pumps_angle():
    one, other = track("free-run-1,A", "free-run", 60), track("free-run-1,B", "free-run", 60)
    late = dataclasses.replace(other, first=0.25)
    label = "pump_angle[free-run-1]"
    with_pump = [
        dataclasses.replace(t, drive=drive(60, (0.1, 0.5), (0, 1, 0))) for t in (one, other, late)
    ]
    shared = beating([RIPPLE], with_pump[:2])
    assert shared == {"free-run-1,A": label, "free-run-1,B": label}
    apart = beating([RIPPLE], [with_pump[0], with_pump[2]])
    assert set(apart.values()) == {"pump_angle[free-run-1,A]", "pump_angle[free-run-1,B]"}
    assert beating([RIPPLE], [one, other]) == {}, "the valve stays shut"
    assert beating([CATALOGUE["piston-leakage"]], with_pump) == {}


def test_amplitudes_that_change_nothing_are_left_out_of_the_sum():
    """Decades of them: of 33 a third is left, and the evidence is that of all, line or none."""
    rng = np.random.default_rng(7)
    known = np.geomspace(1.0, 100.0, 50)[None] * np.array([[1.0], [0.3]])
    listed = np.asarray(Lognormal(0.1, 10.0).from_standard(QUANTILES))
    every = Sizes(*(np.repeat(one[:, None], 50, axis=1) for one in (listed, np.log(MASS))))
    all_told = Sizes.of(listed, known.sum(axis=0))
    few = Sizes.of(listed, known.sum(axis=0), BY_CHANCE)
    assert len(few.at) < 18 < len(all_told.at) < len(every.at)
    assert np.all(np.exp(few.log_mass[0]) > MASS[0]), "the first stands for all below it"
    for size, sizes in ((0.0, few), (0.0, all_told), (100.0, all_told)):
        pulls = np.sqrt(known) * (rng.standard_normal(known.shape) + 1j * size)
        found, whole = (
            log_bayes_of_line(pulls, known, one, np.zeros(50)) for one in (sizes, every)
        )
        np.testing.assert_allclose(found, whole, atol=5e-3)
        if size:
            cut = log_bayes_of_line(pulls, known, few, np.zeros(50))
            assert np.max(whole - cut) > 1.0, "a strong line is not told with the few"


FREQUENCIES, DRAWS = 400, 2000


def without_a_line(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Pulls (draws, records, frequencies) of noise, and what is known of each (records, ...)."""
    known = np.repeat([[30.0**2], [10.0**2], [3.0**2]], FREQUENCIES, axis=1)
    parts = rng.standard_normal((2, DRAWS, *known.shape))
    return np.sqrt(known) * (parts[0] + 1j * parts[1]), known


@pytest.mark.slow
def test_evidence_for_a_line_is_one_in_the_mean_where_there_is_none():
    """A Bayes factor against what is true has the mean 1, for whatever is weighed by it."""
    pulls, known = without_a_line(np.random.default_rng(4))
    listed = np.asarray(Lognormal(0.02, 1.5).from_standard(QUANTILES))
    sizes = Sizes.of(listed, known.sum(axis=0))
    prior = np.full(FREQUENCIES, -np.log(FREQUENCIES))
    factors = np.exp([logsumexp(log_bayes_of_line(one, known, sizes, prior)) for one in pulls])
    error = 4.0 * factors.std() / np.sqrt(DRAWS)
    assert factors.mean() == pytest.approx(1.0, abs=error)
    fewer = np.exp([logsumexp(log_bayes_of_line(one, 0.9 * known, sizes, prior)) for one in pulls])
    assert fewer.mean() > 1.0 + 2.0 * error, "a tenth too little known would be seen"


def test_evidence_for_a_line_is_that_of_all_phases_and_amplitudes():
    """Against sums over phases and amplitudes by hand."""
    pulls = np.array([[40.0 * np.exp(0.3j)], [9.0 * np.exp(-2.0j)]])
    known, sizes = np.array([[400.0], [90.0]]), np.linspace(0.0, 0.3, len(QUANTILES))
    angles = np.linspace(-np.pi, np.pi, 4001)[:-1]
    total = 0.0
    for size, mass in zip(sizes, MASS, strict=True):
        each = [
            np.exp(size * np.imag(np.exp(1j * angles) * g) - 0.5 * size**2 * j).mean()
            for g, j in zip(pulls[:, 0], known[:, 0], strict=True)
        ]
        total += mass * np.prod(each)
    found = log_bayes_of_line(pulls, known, Sizes.of(sizes, known.sum(axis=0)), np.zeros(1))
    assert found[0] == pytest.approx(np.log(total), abs=1e-9)

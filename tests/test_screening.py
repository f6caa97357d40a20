"""Score tests of missing effects: nothing where nothing is, and the planted one by its strength."""

import jax.numpy as jnp
import numpy as np
import pytest
from rigs import BASE, SHEETS, converted, drive, effects, parameters, track

from rigid.discovery.candidates import batches, candidates
from rigid.discovery.screening import Screening, screen
from rigid.discovery.traces import Expansion, expansion, traces
from rigid.effects import CATALOGUE
from rigid.groups import SlowGroup
from rigid.likelihood import make_pieces
from rigid.priors import Lognormal
from rigid.problem import Problem
from rigid.search import search
from rigid.tracks import Series

LISTED = ("piston-leakage", "hose-pressure-drop", "clock-offset", "load-cell-drift")


def campaign(seed: int, **hidden: float) -> Problem:
    """A free run of the linear rig, in which a hidden effect of the given strength acts."""
    tracks = tuple(
        track(f"free-run-{i},A", "free-run", 500, drive=drive(500, (0.5, 3.0), (0, 1, 0)),
              stroke_high=0.1, switch_strokes=np.full(8, 0.05))
        for i in (1, 2)
    )  # fmt: skip
    flows = {"kappa[free-run-1,A]": 0.2, "kappa[free-run-2,A]": 0.05}
    listed = parameters(
        {"mu": Lognormal(1e6, 1.5), **{k: Lognormal(v, 1.2) for k, v in flows.items()}},
        quantities=("load,A", "stroke,A", "pressure,A"),
    )
    more = tuple(CATALOGUE[n] for n in LISTED)
    silent = {"C_leak": 0.0, "R_hose": 0.0, "pressure_delay": 0.0, "load_drift": 0.0}
    truth = listed.values(jnp.zeros((1, listed.size)))
    truth = truth | {"mu": jnp.asarray([1e6])}
    truth = truth | {k: jnp.asarray([v]) for k, v in (silent | hidden).items()}
    ideal = SlowGroup(tracks, effects(BASE) + more).predict(truth)
    rng = np.random.default_rng(seed)
    series = {}
    for i, one in enumerate(tracks):
        data = {q: converted(ideal[q][:, i, 0], SHEETS[q], rng) for q in ideal}
        series[one.label] = Series(data, {q: np.ones(one.samples) for q in data})
    groups = (SlowGroup(tracks, effects(BASE)),)
    return Problem(effects(BASE), listed, groups, make_pieces(groups, series, SHEETS))


@pytest.fixture(scope="module")
def listed():
    return candidates([CATALOGUE[n] for n in LISTED], 2)


def screened(problem: Problem, listed) -> Screening:
    found = search(problem, 1, 0)
    return screen(expansion(found), traces(found, listed))


def test_where_nothing_is_missing_strengths_are_standard_normal(listed):
    """Whitened by their correlation: the sum of squares is chi squared, 4 a campaign."""
    total = 0.0
    for seed in range(6):
        found = screened(campaign(200 + seed), listed)
        total += found.slope @ np.linalg.solve(found.information, found.slope)
    assert 9.9 < total < 45.6  # chi squared of 24 degrees of freedom, 99.5 % either way


def test_a_planted_effect_comes_out_by_its_strength(listed):
    names = [one.effect.name for one in listed]
    at = names.index("load-cell-drift")  # the records are linear in it
    quiet = screened(campaign(300), listed)
    drift = 8.0 / np.sqrt(quiet.information[at, at])
    found = screened(campaign(300, load_drift=drift), listed)
    # The same noise before the converter, other roundings after it: of n samples, each moved by
    # d = 8/sqrt(n) noise sds of a step of 2, a share d/2 changes its code, which scatters the
    # strength by sqrt(n d (2 - d) / n) = 0.66 at n = 1,000. Much stronger effects are counted as
    # correlated noise until they are in the model, and come out weaker than they are.
    assert found.strength[at] - quiet.strength[at] == pytest.approx(8.0, abs=3 * 0.66)
    assert int(np.argmax(np.abs(found.strength))) == at
    expected = quiet.strength + 8.0 * quiet.cosines[:, at]
    np.testing.assert_allclose(found.strength, expected, atol=3 * 0.66)


def test_projecting_out_is_refitting():
    """What the fit can absorb leaves no trace; what it cannot leaves all of it."""
    rng = np.random.default_rng(400)
    design, score = rng.standard_normal((300, 4)), rng.standard_normal(300)
    around = Expansion(score, np.ones(300), 1e6 * design, np.ones(300))
    free = rng.standard_normal(300)
    free -= design @ np.linalg.lstsq(design, free, rcond=None)[0]
    found = screen(around, np.stack([design @ [1.0, 2.0, 0.0, -1.0], free], axis=1))
    assert found.information[0, 0] < 1e-6
    assert found.information[1, 1] == pytest.approx(free @ free)


def test_candidates_that_share_a_name_or_a_pace_are_kept_apart():
    every = candidates([e for e in CATALOGUE.values() if e.name not in BASE], 3)
    lots = batches(every)
    assert sorted(id(one) for lot in lots for one in lot) == sorted(map(id, every))
    for lot in lots:
        owners = {}
        assert len({one.effect.steady for one in lot}) == 1
        for one in lot:
            for label in one.shape:
                assert owners.setdefault(label, one.effect.name) == one.effect.name
    for one in every:
        assert one.shape[one.amplitude] == one.absent

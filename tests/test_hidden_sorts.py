"""Straight hidden things, and constants that are none: their traces, and what they are believed."""

import numpy as np
import pytest
from rigs import parameter
from scipy.special import logsumexp

from rigid.discovery.unmodelled.base import Bumps, together
from rigid.discovery.unmodelled.inputs import Input
from rigid.discovery.unmodelled.sensors import SensorError
from rigid.discovery.unmodelled.shifts import constants, shifted
from rigid.discovery.unmodelled.straight import Straight, places, straight
from rigid.discovery.unmodelled.waves import Wave
from rigid.discovery.weighing.explain import bundles_of, shares
from rigid.effects import CATALOGUE
from rigid.likelihood.priors import Normal
from rigid.localfit.screening import Around, screen

PLACES = np.linspace(-2.0, 2.0, 9)
RNG = np.random.default_rng(0)
STATE = RNG.uniform(-2.0, 2.0, 400)
"""Of each sample; a bump's trace is its height there, times a gain that differs by sample."""
GAIN = RNG.uniform(0.5, 2.0, 400)
FORCE = Input("force", "speed")
TRACKS = ("free-run-1,A", "free-run-2,A")


def bumped(state: np.ndarray, target: Input | SensorError, gain: np.ndarray) -> Bumps:
    height = np.maximum(0.0, 1.0 - np.abs(state[:, None] - PLACES) / 0.5)
    return Bumps(gain[:, None] * height, (target,) * len(PLACES), PLACES)


def test_straight_things_have_the_traces_of_their_shapes():
    found = together(list(straight(bumped(STATE, FORCE, GAIN))))
    shapes = {t.form: found.columns[:, i] for i, t in enumerate(found.target)}
    assert set(shapes) == {"constant", "proportional", "sign"}
    np.testing.assert_allclose(shapes["constant"], GAIN)
    np.testing.assert_allclose(shapes["proportional"], GAIN * STATE)
    far = np.abs(STATE) > 0.5  # between the bumps at 0 and next to it the sign turns
    np.testing.assert_allclose(shapes["sign"][far], (GAIN * np.sign(STATE))[far])


def test_a_constant_is_there_once_and_only_what_turns_has_a_sign():
    over = [bumped(STATE, Input("force", v), GAIN) for v in ("pressure", "speed")]
    forms = [(t.about.over.name, t.form) for one in straight(together(over)) for t in one.target]
    assert forms == [
        ("pressure", "constant"),
        ("pressure", "proportional"),
        ("speed", "proportional"),
        ("speed", "sign"),
    ]


def test_a_line_runs_where_its_bumps_are_whatever_waves_there_are():
    """A wave goes by the stroke as well; the numbers of its sensors are no strokes."""
    over = Input("force", "stroke")
    wave = Bumps(np.zeros((400, 2)), (Wave(over, 5e-3),) * 2, np.array([7.0, 7.0]))
    curves = bumped(STATE, over, GAIN)
    hidden = together([curves, wave, *straight(curves)])
    np.testing.assert_array_equal(places(hidden, hidden.target[-1]), PLACES)


def test_a_drift_is_that_of_all_records_of_a_sensor_together():
    first = np.arange(400) < 150
    parts = [
        bumped(STATE, SensorError("load", "time", track), np.where(mine, 1.0, 0.0))
        for track, mine in zip(TRACKS, (first, ~first), strict=True)
    ]
    (found,) = straight(together([*parts, bumped(STATE, SensorError("load", "reading"), GAIN)]))
    (target,) = found.target
    assert target.of == SensorError("load", "time", None)
    np.testing.assert_allclose(found.columns[:, 0], STATE, atol=1e-12)


def found_in(design: np.ndarray, kinds: np.ndarray, labels: tuple[str, ...]) -> Bumps:
    law = Normal(1.0, 0.1)
    parameters = tuple(parameter(k, law, varies=k == "vary") for k in labels)
    rows = [kinds == kind for kind in dict.fromkeys(kinds)]
    effects = (CATALOGUE["oil-compressibility"],)
    return shifted(design, rows, constants(parameters, effects))


def test_constants_shift_between_the_kinds_in_which_they_act():
    labels = ("k_oil", "L_0", "k_frame", "kappa[free-run-1,A]", "vary", "mu_branch[1]")
    kinds = np.repeat(["frame", "release", "free-run"], 20)
    design = np.random.default_rng(1).standard_normal((60, len(labels)))
    design[20:, 2] = 0.0  # the frame's stiffness acts in its own tests alone
    design[20:40, 1] = 0.0
    found = found_in(design, kinds, labels)
    assert dict.fromkeys((t.kind, t.about.equation) for t in found.target) == dict.fromkeys(
        [("k_oil", "oil-balance"), ("L_0", "oil-balance"), ("mu_branch[1]", "plunger-momentum")]
    )
    assert all(t.about.over.name == "kind of record" and t.sort == "shift" for t in found.target)
    assert list(found.centre) == [0, 1, 2, 0, 2, 0, 1, 2]
    np.testing.assert_array_equal(found.columns[:, :3].sum(axis=1), design[:, 0])
    np.testing.assert_array_equal(found.columns[:20, 0], design[:20, 0])
    assert not found.columns[20:, 0].any()


def test_nothing_shifts_where_there_is_one_kind():
    found = found_in(np.ones((20, 1)), np.repeat("free-run", 20), ("k_oil",))
    assert found.columns.shape == (20, 0)


def everything() -> tuple[Bumps, np.ndarray]:
    """Hidden things over 300 samples of three kinds, and a fit's design."""
    rng = np.random.default_rng(2)
    kinds = np.repeat(["frame", "release", "free-run"], 100)
    design = rng.standard_normal((300, 6))
    labels = ("M_HC", "k_oil", "L_0", "k_frame", "M_Pl", "M_Fl")
    curves = together(
        [
            *[
                bumped(STATE[:300], Input("force", v), rng.standard_normal(300))
                for v in ("pressure", "stroke", "speed")
            ],
            *[
                bumped(STATE[:300], Input("force", "time", t), rng.standard_normal(300))
                for t in TRACKS * 10
            ],
        ]
    )
    return together([curves, *straight(curves), found_in(design, kinds, labels)]), design


def believed(
    hidden: Bumps, design: np.ndarray, change: np.ndarray, draws: int, careless: bool = False
) -> np.ndarray:
    """Log Bayes factor of something hidden (draws,), noise of sd 1 and constants of the prior.

    - `careless`: each hidden thing counts for all that one would bet on them together.
    """
    rng = np.random.default_rng(3)
    found = screen(Around(change, np.ones(len(design)), design, design.T @ change), hidden.columns)
    bundles = bundles_of(hidden.target, 0, found.information)
    more = rng.standard_normal((draws, len(design)))
    more = more + rng.standard_normal((draws, design.shape[1])) @ design.T
    known = np.eye(design.shape[1]) + design.T @ design
    left = more - more @ design @ np.linalg.solve(known, design.T)
    slope = found.slope + left @ hidden.columns
    logs = np.stack([b.log_bayes(slope) for _, b in bundles], axis=-1)
    bet = 0.0 if careless else shares(bundles)
    return np.asarray(logsumexp(logs + bet, axis=-1))


def test_sorts_are_bet_on_alike():
    hidden, design = everything()
    information = hidden.columns.T @ hidden.columns
    bundles = bundles_of(hidden.target, 0, information)
    sorts = np.array([t.prior_class for t, _ in bundles])
    bet = np.exp(shares(bundles))
    for sort in ("time", "curve", "straight", "shift"):
        assert bet[sorts == sort].sum() == pytest.approx(0.25)
    assert design.shape[0] == len(hidden.columns)


def test_odds_of_three_come_by_chance_in_fewer_than_one_campaign_of_three():
    """A Bayes factor is 1 in the mean where nothing is hidden: Markov's inequality."""
    hidden, design = everything()
    nothing = np.zeros(len(design))
    assert (believed(hidden, design, nothing, 2000) > np.log(3.0)).mean() < 1.0 / 3.0
    assert (believed(hidden, design, nothing, 2000, True) > np.log(3.0)).mean() > 0.5


def test_a_constant_that_shifts_is_seen_and_was_not_without():
    hidden, design = everything()
    at = [i for i, t in enumerate(hidden.target) if t.about.name == "k_oil"][1]
    change = hidden.columns[:, at] * 8.0 / np.linalg.norm(hidden.columns[:, at])
    with_them = believed(hidden, design, change, 200)
    others = np.array([t.sort != "shift" for t in hidden.target])
    rest = hidden.of(others)
    assert np.median(with_them) > 8.0
    assert np.median(believed(rest, design, change, 200)) < 2.0


def test_a_straight_thing_is_believed_more_than_the_curves_that_hold_it():
    hidden, design = everything()
    lines = [isinstance(t, Straight) for t in hidden.target]
    at = next(i for i, t in enumerate(hidden.target) if lines[i] and t.form == "proportional")
    change = hidden.columns[:, at] * 6.0 / np.linalg.norm(hidden.columns[:, at])
    rest = hidden.of(~np.array(lines))
    gained = believed(hidden, design, change, 200) - believed(rest, design, change, 200)
    assert np.median(gained) > 2.0

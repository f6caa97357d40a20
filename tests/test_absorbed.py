"""A cause of unknown law comes into the model as it is, and what has a name is found behind it."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from test_screening import CHOICE, campaign, fitted, found_in

from rigid.discovery.fitted import Fitted
from rigid.discovery.outcome import Outcome
from rigid.discovery.signatures import laid_out
from rigid.discovery.turn import Running, Turn
from rigid.io.cache import NOTHING_KEPT
from rigid.likelihood.problem import Problem
from rigid.localfit.expansion import Point, expanded
from rigid.localfit.hypothesis import Absorbed, widened
from rigid.localfit.reference_check import against_reference
from rigid.localfit.settled import labels_of
from rigid.report.discovery.lead import lead, ruling

SWING = 0.2
"""Hertz of a sensor error that no effect of the choice leaves."""


def swinging(problem: Problem, size: float) -> Problem:
    """The same records, the stroke sensor swinging by `size` [m] in the first of them."""
    pieces = []
    for piece in problem.pieces:
        if piece.quantity == "stroke":
            time = 0.01 * np.arange(piece.data.shape[0])
            error = np.zeros(piece.data.shape)
            error[:, 0] = size * np.sin(2.0 * np.pi * SWING * time)
            piece = eqx.tree_at(lambda p: p.data, piece, jnp.asarray(piece.data + error))
        pieces.append(piece)
    return Problem(problem.effects, problem.parameters, problem.groups, tuple(pieces))


@pytest.fixture(scope="module")
def both() -> Outcome:
    return found_in(swinging(campaign(302, R_hose=4e9), 5e-3))


@pytest.fixture(scope="module")
def quiet():
    return fitted(campaign(301))


def holding_absorbed(local, columns, numbers):
    """The fit with a cause absorbed whose numbers stand where they are told."""
    taken = Absorbed("swing", columns)
    more = dataclasses.replace(local.hypothesis, absorbed=(taken,))
    point = Point(more, local.layout, np.append(local.w, numbers), local.z_noise)
    return expanded(local.family, point)


@pytest.mark.slow
def test_readings_move_by_what_is_absorbed_and_by_nothing_else(quiet):
    local, _ = quiet
    columns = np.random.default_rng(1).standard_normal((len(local.residual), 2))
    numbers = np.array([0.3, -0.2])
    there = holding_absorbed(local, columns, numbers)
    np.testing.assert_allclose(local.residual - there.residual, columns @ numbers, atol=1e-12)
    np.testing.assert_array_equal(there.design[:, -2:], columns)
    np.testing.assert_allclose(there.design[:, :-2], local.design)
    assert labels_of(there.hypothesis)[-2:] == ["swing[0]", "swing[1]"]
    assert len(labels_of(there.hypothesis)) == there.hypothesis.size == len(there.w)
    np.testing.assert_array_equal(
        there.hypothesis.sensors(there.w), local.hypothesis.sensors(local.w)
    )


def off_by(local) -> float:
    """By how much the log-posterior at the best fit changes where diffrax solves it, loosely."""
    found = against_reference(local, 1, 1e-3)
    assert found is not None
    assert found.differences is not None
    return float(found.differences[0])


@pytest.mark.slow
def test_steps_are_judged_with_what_is_absorbed(quiet):
    """Records all moved alike, and that absorbed, say the same of the solver as before."""
    local, _ = quiet
    change = 20.0 * local.layout.floor * np.sin(np.arange(len(local.residual)) / 40.0)
    there = holding_absorbed(local, change[:, None], [1.0])
    problem = there.layout.problem
    pieces, at = [], 0
    for piece in problem.pieces:
        here = change[at : at + piece.data.size].reshape(piece.data.shape[::-1]).T
        pieces.append(eqx.tree_at(lambda p: p.data, piece, piece.data + here))
        at += piece.data.size
    moved = dataclasses.replace(problem, pieces=tuple(pieces))
    there = dataclasses.replace(there, layout=dataclasses.replace(there.layout, problem=moved))
    before, after = (off_by(one) for one in (local, there))
    assert abs(before) > 1e-3
    assert after == pytest.approx(before, rel=0.05)


@pytest.mark.slow
def test_an_effect_is_added_beside_what_is_absorbed(quiet):
    """Its numbers come before the gains, those of what is absorbed stay at the end."""
    local, _ = quiet
    there = holding_absorbed(local, np.ones((len(local.residual), 1)), [0.7])
    drift = CHOICE[-1]
    extended = there.hypothesis.plus(drift)
    w = widened(there.hypothesis, there.w, [0.4])
    assert len(w) == extended.size
    named = dict(zip(labels_of(extended), w, strict=True))
    assert named[drift.labels()[0]] == 0.4
    assert named["swing[0]"] == 0.7


@pytest.mark.slow
def test_what_is_absorbed_is_no_longer_weighed(both):
    fit = Fitted(both.base, both.programs)
    turn = Turn(fit, laid_out(fit, CHOICE, NOTHING_KEPT), Running(0))
    after = turn.absorbing(turn.absorption())
    absorbed = turn.hidden.hidden
    assert absorbed in turn.bench.bumps.target
    assert absorbed not in after.bench.bumps.target
    # What it left was told by its size alone: the records have nothing more to say of it.
    left = turn.found.bundle_of(absorbed)
    assert turn.found.unnamed > 100.0
    assert after.found.unnamed < 0.2 * turn.found.unnamed
    assert len(left.columns) == len(turn.bench.bumps.target) - len(after.bench.bumps.target)
    # Another of the same name comes in under labels of its own.
    again = after.absorbing(after.absorption()).fit.local.hypothesis
    assert len(again.absorbed) == 2
    assert len(set(labels_of(again))) == again.size


@pytest.mark.slow
def test_a_named_effect_is_found_behind_one_without_a_law(both):
    """The swing explains most and has no name; the drop in the hose came second."""
    assert both.verdict == "unnamed"
    first, second = both.steps[:2]
    assert first.chosen is None
    assert first.absorbed is not None
    assert first.hidden is first.absorbed.hidden
    assert first.hidden.hidden.kind == "stroke"
    assert first.judged.gap[1] < first.judged.gap[0]
    assert second.chosen == "hose-pressure-drop"
    assert second.probability["hose-pressure-drop"] > 0.5
    number = second.came_in.after.interval("R_hose")
    assert number["q05"] < 4e9 < number["q95"]
    assert both.before(1) is first.absorbed.after
    assert "Beside it hose-pressure-drop is probably missing." in ruling(both)
    answers = dict(lead(both, "extended.toml"))
    assert "What has no name is not in that model" in answers["What next?"][0]
    assert "What has no name came in as it is." in answers["What changed?"][0]

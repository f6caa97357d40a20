"""Whether the records want an effect in another form: not its own, and that of a planted other."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from test_screening import campaign, found_in

from rigid.discovery.form import CLEARLY, contributed, other_form
from rigid.effects import CATALOGUE
from rigid.likelihood.problem import Problem
from rigid.localfit.expansion import Point, expanded
from rigid.localfit.local import LocalFit
from rigid.localfit.samples import lay_out

HOSE = CATALOGUE["hose-pressure-drop"]


@pytest.fixture(scope="module")
def found() -> LocalFit:
    """A fit with the effect that is hidden."""
    return found_in(campaign(302, R_hose=4e9)).final


def moved(local: LocalFit, change: np.ndarray) -> LocalFit:
    """The same fit of records that read `change` (n,) more."""
    problem, at, pieces = local.layout.problem, 0, []
    for piece in problem.pieces:
        here = change[at : at + piece.data.size].reshape(piece.data.shape[::-1]).T
        at += piece.data.size
        pieces.append(eqx.tree_at(lambda p: p.data, piece, jnp.asarray(piece.data + here)))
    new = Problem(problem.effects, problem.parameters, problem.groups, tuple(pieces))
    layout = lay_out(new).weighed(local.layout.weight)
    return expanded(local.family, Point(local.hypothesis, layout, local.w, local.z_noise))


@pytest.mark.slow
def test_an_effect_of_the_right_law_is_wanted_in_no_other_form(found):
    form = other_form(found, HOSE)
    assert form is not None
    assert form.log_bayes < 0.0


@pytest.mark.slow
def test_a_contribution_that_is_stronger_here_and_weaker_there_is_seen(found):
    """Its contribution once more in the first half of each record, and taken off in the second."""
    time = found.layout.time
    half = np.where(time < 0.5 * time.max(), 1.0, -1.0)
    form = other_form(moved(found, half * contributed(found, HOSE)), HOSE)
    assert form is not None
    assert form.log_bayes > CLEARLY
    small = other_form(moved(found, 0.1 * half * contributed(found, HOSE)), HOSE)
    assert small is not None
    assert small.log_bayes < CLEARLY


@pytest.mark.slow
def test_what_contributes_nothing_has_no_form(found):
    assert other_form(found, CATALOGUE["piston-leakage"]) is None


@pytest.mark.slow
def test_the_contribution_is_what_the_gauge_reads_more_behind_the_hose(found):
    """The reading is proportional to the drop: with less of it, it moves by that share."""
    at = found.hypothesis.labels.index("R_hose")
    value, slope = found.hypothesis.values(found.w)["R_hose"]
    w = found.w.copy()
    w[at] -= 1e-3 * value / slope
    less = expanded(found.family, Point.beside(found, w))
    fell = less.residual - found.residual
    given = contributed(found, HOSE)
    # The next order of the amplitude's logarithm is 5e-4 of it where a step is 1e-3.
    np.testing.assert_allclose(fell, 1e-3 * given, atol=2e-6 * np.abs(given).max())

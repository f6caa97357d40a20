"""Where discovery begins: starts that agree, and numbers that stay where a rig can be."""

import numpy as np
import pytest
from second_simulator import campaign as simulated
from test_screening import CHOICE, campaign

import rigid
from rigid.discovery import base_fit
from rigid.discovery.base_fit import begun_at, best_base, led_on
from rigid.inference.few_starts import best_of_few
from rigid.localfit.ascent import refined
from rigid.localfit.families import families
from rigid.localfit.settled import state_of


@pytest.fixture(scope="module")
def clean():
    problem = campaign(400)
    return problem, families(problem, CHOICE)[0]


@pytest.mark.slow
def test_starts_that_louder_noise_leads_to_one_place_go_on_as_one(clean, monkeypatch):
    problem, program = clean
    said, led = [], []
    monkeypatch.setattr(base_fit, "led_on", lambda local: led.append(local) or led_on(local))
    best = best_base(problem, program, 6, 1, said.append)
    assert (best.agree, best.starts, said, len(led)) == (True, 2, [1, 2], 1)
    assert not best_base(problem, program, 1, 1, said.append).agree


@pytest.mark.slow
def test_of_a_right_model_it_is_the_fit_of_the_search(clean):
    """Its samples count in full but by chance, so both end in one place: within a posterior sd."""
    problem, program = clean
    best, search = best_base(problem, program, 6, 1, print), best_of_few(problem, 6, 1)
    ours = refined(begun_at(problem, program, (best.z, best.standard)))
    its = refined(begun_at(problem, program, (search.z, search.standard)))
    moved = ours.w - its.w
    assert moved @ its.information @ moved < 1.0
    assert state_of(led_on(its)).ok


@pytest.mark.slow
def test_a_model_that_lacks_much_ends_where_a_rig_can_be(tmp_path):
    """A piston that leaks through an orifice: white noise of the sheets drives L_0 48 prior sds."""
    problem = rigid.load(simulated("orifice", 910_000, tmp_path)).problem
    program = families(problem, ())[0]
    found = best_base(problem, program, 4, 1, print)
    assert found.agree
    assert state_of(led_on(begun_at(problem, program, (found.z, found.standard)))).ok
    white = best_of_few(problem, 1, 1)
    assert np.abs(white.z).max() > 20.0

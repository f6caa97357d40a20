"""Effects that set in at a pressure, and priors of what was added, in a spec."""

import tomllib

import numpy as np
import pytest

from rigid.discovery.refit import worth_refitting
from rigid.effects import CATALOGUE
from rigid.likelihood.priors import make_prior
from rigid.localfit.candidates import onsets, priors_of
from rigid.report.discovery.output import with_laws

STAGE = CATALOGUE["pump-stage-switch"]
TOP = 550e5


def of_one_width(found):
    return [one for one in found if one.shape["stage_width"] == found[0].shape["stage_width"]]


def test_every_pressure_is_tried_with_widths_of_the_whole_prior():
    found = onsets(STAGE, TOP)
    widths = np.unique([one.shape["stage_width"] for one in found])
    assert len(widths) == 3
    assert len(found) == 3 * len(of_one_width(found))
    # Thirds of the prior, whose median is the paper's 1/(0.05 per bar) and which is a factor wide.
    assert widths[1] == pytest.approx(20e5)
    assert widths[2] / widths[1] == pytest.approx(widths[1] / widths[0])
    assert 1.8 < widths[1] / widths[0] < 2.1
    sharp = make_prior("fixed", {"value": 5e5}, "here")
    assert {one.shape["stage_width"] for one in onsets(STAGE, TOP, {"stage_width": sharp})} == {5e5}


def test_rivals_of_the_best_are_fitted_before_what_is_worth_nothing_alone():
    names = ("event", "ripple", "plate", "spring", "stage", "x")
    evidence = dict(zip(names, (31.0, 30.5, 30.0, 29.0, 25.0, 9.0), strict=True))
    alone = dict(zip(names, (31.0, -2.6, -0.2, -1.0, 25.0, 9.0), strict=True))
    assert worth_refitting(evidence, alone) == ["event", "stage", "ripple", "plate", "spring"]
    great = {name: 100.0 * log for name, log in evidence.items()}
    assert worth_refitting(great, evidence)[:4] == ["event", "ripple", "plate", "spring"]
    few = {"event": 3100.0, "x": 900.0, "y": 800.0}
    assert worth_refitting(few, few) == ["event", "x"]
    assert worth_refitting(dict.fromkeys(evidence, -1.0), alone) == []


def test_what_goes_well_with_the_best_leaves_room_for_what_explains_half_as_much_by_itself():
    names = ("viscosity", "air", "stiffening", "slack", "friction", "lag")
    evidence = dict(zip(names, (870.0, 990.0, 950.0, 940.0, 900.0, 880.0), strict=True))
    alone = dict(zip(names, (870.0, 200.0, 90.0, 80.0, 440.0, 40.0), strict=True))
    assert worth_refitting(evidence, alone)[:4] == ["air", "viscosity", "stiffening", "friction"]


def test_pressures_stand_close_where_records_just_reach_them():
    found = of_one_width(onsets(STAGE, TOP))
    pressures = np.array([one.shape["p_stage"] for one in found])
    assert pressures[0] > TOP + 30e5, "there the trace of tanh(0.05 p/bar) is a twentieth"
    assert pressures[-1] < 200e5
    near = np.abs(pressures - TOP) < 30e5
    steps = -np.diff(pressures)
    assert steps[near[:-1]].max() < 10e5, "within a step the trace grows by no more than e"
    assert len(found) < 30
    # All are tried with the drop that pumps have, not with a slope at none.
    usual = float(priors_of(STAGE, {})["stage_drop"][1].from_standard(0.0))
    assert 0.9 < usual < 1.0
    assert [one.level for one in found] == pytest.approx([usual] * len(found))


def test_pressures_count_for_their_share_of_the_prior():
    found = of_one_width(onsets(STAGE, TOP))
    shares = np.exp([one.log_share for one in found])
    assert shares.mean() == pytest.approx(1.0)
    pressures = np.array([one.shape["p_stage"] for one in found])
    inner = slice(1, -1)
    widths = 0.5 * (pressures[:-2] - pressures[2:])
    assert shares[inner] / widths == pytest.approx(shares[1] / widths[0], rel=1e-3), "uniform"
    law = make_prior("uniform", {"low": 500e5, "high": 540e5}, "here")
    given = [one.shape["p_stage"] for one in onsets(STAGE, TOP, {"p_stage": law})]
    assert min(given) > 490e5
    assert max(given) < 550e5


@pytest.mark.parametrize(
    "text",
    [
        "[rig]\n",
        '[priors]\nk_LC = { fixed = 6e7 }\n\n[[records]]\nname = "x"\n',
        "[priors]  # from the sheet\nk_LC = { fixed = 6e7 }\n",
    ],
)
def test_priors_of_what_was_added_stand_in_the_extended_spec(text: str):
    law = make_prior("uniform", {"low": -1.25, "high": 5.0}, "here")
    found = tomllib.loads(with_laws(text, {"pump_angle[frame-1]": law}))
    assert found["priors"]["pump_angle[frame-1]"] == {"uniform": {"low": -1.25, "high": 5.0}}
    assert {k: v for k, v in found.items() if k != "priors"} == {
        k: v for k, v in tomllib.loads(text).items() if k != "priors"
    }
    assert found["priors"].get("k_LC") == tomllib.loads(text).get("priors", {}).get("k_LC")
    assert with_laws(text, {}) == text

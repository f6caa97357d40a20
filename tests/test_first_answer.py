"""What a fit says before its chain runs: whether the best fit explains the records at all."""

import cart
import numpy as np
import pytest

from rigid.inference.noise_levels import noise_gain
from rigid.inference.search import STANDS, search
from rigid.report.calibration.preliminary import doubt
from rigid.study.study import load


def push(folder, newtons, hertz):
    """Add a sine [N] to the force of the cart's record."""
    record = folder / "cart.csv"
    t, x, force = np.loadtxt(record, delimiter=",", skiprows=1, unpack=True)
    force = force + newtons * np.sin(2.0 * np.pi * hertz * t)
    rows = (f"{a:.4f},{b:.9f},{c:.4f}" for a, b, c in zip(t, x, force, strict=True))
    record.write_text("\n".join(["t,x,F", *rows]) + "\n", "utf-8")


@pytest.mark.parametrize("missing", [0.0, 30.0])
def test_a_model_that_does_not_explain_its_records_is_told_before_the_chain(tmp_path, missing):
    """A force of 30 N at five times the stroke's frequency is in no part of the model."""
    path = cart.write_cart(tmp_path, seconds=4.0)
    push(tmp_path, missing, 2.5)
    # With 2 N on the sheet the sound cart has a gap of 1.2; with 3 N it is far from the limit.
    path.write_text(path.read_text("utf-8").replace("noise = 2.0", "noise = 3.0"), "utf-8")
    study = load(path)
    said = doubt(study.spec, search(study.problem, 2, 1), 1)
    if missing:
        assert said is not None
        assert said.startswith("residuals: they are ")
        assert "`rigid discover cart.toml`" in said
    else:
        assert said is None


def test_a_number_that_no_rig_has_is_told_before_the_chain(tmp_path):
    """A cart of 40 kg that is said to have 80 kg: residuals are small, the mass is far off."""
    path = cart.write_cart(tmp_path, seconds=4.0)
    text = path.read_text("utf-8").replace("noise = 2.0", "noise = 9.0")
    weighed = "M_Pl = { lognormal = { median = 80.0, factor = 1.1 } }"
    path.write_text(text.replace("M_Pl = { lognormal = { median = 30.0, factor = 2.0 } }", weighed))
    study = load(path)
    said = doubt(study.spec, search(study.problem, 2, 1), 1)
    assert said is not None
    assert said.startswith("optimum: M_Pl is ")
    assert "The chain will not change that" in said


def test_an_optimum_stands_in_the_noise_levels_where_a_model_misses_much(tmp_path):
    """A slow force of 30 N: noise, its correlation and the numbers move each other. Two rounds of
    refinement left 12 nats, and the proposal beside the posterior."""
    path = cart.write_cart(tmp_path, seconds=4.0)
    push(tmp_path, 30.0, 0.1)
    found = search(load(path).problem, 2, 1)
    assert noise_gain(found.problem, found.optima[0].z) < STANDS

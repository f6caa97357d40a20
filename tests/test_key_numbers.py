"""The few numbers people come for."""

import numpy as np

from rigid.report.calibration.present import frictions
from rigid.report.paper_values import FRICTION


def test_friction_that_is_the_same_at_every_frequency_is_listed_once():
    found = {
        "abs_mu[0.01 Hz,release]": np.full((1, 3), 2e5),
        "abs_mu[80 Hz,release]": np.full((1, 3), 2e5),
        "abs_mu[100 Hz,release]": np.full((1, 3), 2e5),
        "abs_mu[0.01 Hz,frame]": np.full((1, 3), 9e5),
        "abs_mu[80 Hz,frame]": np.full((1, 3), 2e5),
        "abs_mu[100 Hz,frame]": np.full((1, 3), 1e5),
    }
    listed = frictions(found, FRICTION)
    assert [(n.label, n.symbol) for n in listed] == [
        ("friction, whatever the frequency (release)", r"\mu"),
        ("friction in steady running (frame)", r"\mu(0)"),
        ("friction at 100 Hz (frame)", r"|\mu(100\,\mathrm{Hz})|"),
    ]
    assert [n.median for n in listed] == [2e5, 9e5, 1e5]
    assert [len(n.published) for n in listed] == [3, 2, 1]

"""The few numbers people come for."""

import numpy as np

from rigid.report.calibration.output import At
from rigid.report.calibration.present import frictions
from rigid.report.paper_values import FRICTION


def test_friction_that_is_the_same_at_every_frequency_is_listed_once():
    found = {
        At("release", 0.01): np.full((1, 3), 2e5),
        At("release", 80.0): np.full((1, 3), 2e5),
        At("release", 100.0): np.full((1, 3), 2e5),
        At("frame", 0.01): np.full((1, 3), 9e5),
        At("frame", 80.0): np.full((1, 3), 2e5),
        At("frame", 100.0): np.full((1, 3), 1e5),
    }
    listed = frictions(found, FRICTION)
    assert [(n.label, n.symbol) for n in listed] == [
        ("friction, whatever the frequency (release)", r"\mu"),
        ("friction in steady running (frame)", r"\mu(0)"),
        ("friction at 100 Hz (frame)", r"|\mu(100\,\mathrm{Hz})|"),
    ]
    assert [n.median for n in listed] == [2e5, 9e5, 1e5]
    assert [len(n.published) for n in listed] == [3, 2, 1]

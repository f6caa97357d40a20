"""Sensors that answer to other quantities: their traces."""

import numpy as np
import pytest

from rigid.discovery.unmodelled.crosstalk import answering, quantities
from rigid.localfit.samples import ChannelKey

TIME = np.arange(200) * 0.01
LISTED = ("load", "stroke", "pressure")
CHANNELS = (
    *(ChannelKey("free-run-1,A", "free-run", q, f"{q},A", 0.01) for q in LISTED),
    *(ChannelKey("free-run-2,B", "free-run", q, f"{q},B", 0.01) for q in ("stroke", "pressure")),
    ChannelKey("release-1,A", "release", "acceleration", "acceleration,A", 0.001),
)
NUMBER = np.repeat(np.arange(len(CHANNELS)), len(TIME))
EVERY = np.tile(TIME, len(CHANNELS))
READING = np.concatenate(
    [5.0 + TIME, TIME**2, np.sin(TIME), 2.0 * TIME**2, np.cos(TIME), 9.0 * TIME]
)
FOUND = answering(CHANNELS, NUMBER, EVERY, READING)


def trace(kind: str, rates: bool, source: str) -> np.ndarray:
    at = [
        i
        for i, (t, c) in enumerate(zip(FOUND.target, FOUND.centre, strict=True))
        if (t.kind, t.rates) == (kind, rates) and t.sources[int(c)] == source
    ]
    return FOUND.columns[:, at[0]]


def test_a_record_with_one_quantity_has_no_crosstalk():
    assert quantities(CHANNELS) == LISTED
    assert not FOUND.columns[NUMBER == 5].any()
    assert {t.prior_class for t in FOUND.target} == {"straight"}


def test_every_quantity_answers_to_all_others_and_to_all_rates():
    listed = [(t.kind, t.rates) for t in FOUND.target]
    for kind in LISTED:
        assert listed.count((kind, False)) == 2
        assert listed.count((kind, True)) == 3


def test_a_gauge_before_a_hose_reads_the_speed_of_the_stroke():
    found = trace("pressure", True, "stroke")
    inside = slice(1, -1)  # at the ends a difference is one-sided
    np.testing.assert_allclose(found[NUMBER == 2][inside], 2.0 * TIME[inside], atol=1e-9)
    np.testing.assert_allclose(found[NUMBER == 4][inside], 4.0 * TIME[inside], atol=1e-9)
    assert not found[(NUMBER != 2) & (NUMBER != 4)].any()


def test_what_a_record_does_not_read_leaves_no_trace_there():
    found = trace("pressure", False, "load")
    np.testing.assert_allclose(found[NUMBER == 2], 5.0 + TIME)
    assert not found[NUMBER == 4].any()


def test_a_sensor_read_at_other_times_sees_what_is_between():
    later = EVERY + np.where(NUMBER == 1, 0.005, 0.0)
    found = answering(CHANNELS, NUMBER, later, READING)
    at = [t.kind == "stroke" and not t.rates for t in found.target].index(True)
    own = found.columns[NUMBER == 1, at]
    assert own[50] == pytest.approx(5.505)  # of the load, which grows by 1 a second

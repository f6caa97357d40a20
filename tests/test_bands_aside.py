"""Field readings that are no facts: single ones that all others contradict (simulated tests)."""

import dataclasses

import numpy as np
import pytest
from rigs import MEMORY, NOMINAL, effects

from rigid.generator.core import Rig
from rigid.generator.field import Drop, contact_loss
from rigid.generator.friction import Friction
from rigid.generator.sensors import Sensor
from rigid.smoothing import learning
from rigid.smoothing.aside import Expected, contradicted, doubtful, listed
from rigid.smoothing.field import Field, rig_setup
from rigid.smoothing.laws import RigModel, draws
from rigid.smoothing.learning import Sheet, learn

BRANCHES = ("mu", "mu_branch[1]", "tau_branch[1]", "mu_branch[2]", "tau_branch[2]")
SENSORS = {
    "load": Sensor(1.0, 0.0, 147.5, 295.0),
    "stroke": Sensor(1.0, 0.0, 0.055e-3, 0.22e-3),
    "pressure": Sensor(1.0, 0.0, 11491.0, 34473.786),
}
SHEET = Sheet(np.array([147.5, 0.055e-3, 11491.0]), np.array([295.0, 0.22e-3, 34473.786]))
SD = np.sqrt(SHEET.sigma**2 + SHEET.step**2 / 12.0)
LOAD, STROKE, PRESSURE = range(3)
SPIKES = ((80, LOAD, 2e4), (140, LOAD, -3e3), (203, STROKE, 5e-3), (330, PRESSURE, -4e5))
DROP = 2.5
"""Seconds after which the load falls by four tenths within 4 ms."""


@pytest.fixture(scope="module")
def pressed():
    """A test with a fall of the load: the record, and the load at its samples' steps."""
    rig = Rig(**{n: NOMINAL[n] for n in Rig.__dataclass_fields__})
    friction = Friction(*(NOMINAL[n] for n in BRANCHES))
    drop = Drop(DROP + 0.003, DROP + 0.007, 0.4)
    test = contact_loss(rig, friction, SENSORS, np.random.default_rng(31), drop)
    reading = np.column_stack([test.readings[q] for q in SENSORS])
    field = Field("press", "A", {}, 0.0, 0.01, reading, np.ones_like(reading), rig_setup("A"))
    steps = 0.0025 * np.arange(4 * (field.samples - 1))
    return field, np.interp(steps, test.time, test.load)


def rig_with(**wrong: float) -> RigModel:
    """The rig of the test, some of its numbers wrong."""
    sensors = {f"{what}[{q},A]": 0.0 for what in ("gain", "zero") for q in SENSORS}
    return RigModel(
        "x",
        1.0,
        effects(MEMORY),
        {k: np.array([v]) for k, v in (NOMINAL | wrong | sensors).items()},
    )


def spiked(field: Field, spikes=SPIKES) -> Field:
    reading = field.reading.copy()
    for sample, sensor, size in spikes:
        reading[sample, sensor] += size
    return dataclasses.replace(field, reading=reading)


def off_truth(found, load: np.ndarray) -> float:
    """How far the load is off at any step, those beside the fall left out [N]."""
    off = np.abs(found.mean[:, :, 0].ravel()[: len(load)] - load)
    beside = np.abs(0.0025 * np.arange(len(load)) - DROP) < 0.02
    return float(off[~beside].max())


@pytest.mark.slow
def test_spikes_of_every_sensor_are_set_aside_and_the_load_is_what_it_was(pressed, monkeypatch):
    field, load = pressed
    rig = draws(rig_with(), field)
    clean = learn(field, rig, SHEET)
    assert not clean.aside.any()
    found = learn(spiked(field), rig, SHEET)
    assert {(int(i), int(q)) for i, q in np.argwhere(found.aside)} == {s[:2] for s in SPIKES}
    assert off_truth(found, load) < 1.5 * off_truth(clean, load)
    assert found.gap.max() < 1.1
    nothing = np.zeros(field.known.shape, dtype=bool)
    monkeypatch.setattr(learning, "doubtful", lambda *_: nothing)
    followed = learn(spiked(field), rig, SHEET)
    assert off_truth(followed, load) > 10.0 * off_truth(clean, load)  # the rule is what does it


@pytest.mark.slow
@pytest.mark.parametrize(
    "wrong",
    [
        {"mu_branch[1]": NOMINAL["mu_branch[1]"] / 3.0},
        {"mu_branch[1]": NOMINAL["mu_branch[1]"] * 3.0},
        {"k_LC": 0.8 * NOMINAL["k_LC"]},
    ],
)
def test_a_fall_of_the_load_is_a_fact_for_a_wrong_rig_as_well(pressed, wrong):
    field, _ = pressed
    assert not learn(field, draws(rig_with(**wrong), field), SHEET).aside.any()


def ramp(samples: int = 60) -> Field:
    """Readings that rise by an sd a sample."""
    reading = np.arange(samples)[:, None] * SD
    return Field("press", "A", {}, 0.5, 0.01, reading, np.ones_like(reading), rig_setup("A"))


def test_what_several_sensors_or_samples_tell_is_not_doubted():
    far = 20.0 * SD
    alone = spiked(ramp(), [(30, LOAD, far[LOAD])])
    assert np.argwhere(doubtful(alone, SD)).tolist() == [[30, LOAD]]
    both = spiked(alone, [(30, PRESSURE, far[PRESSURE])])
    assert not doubtful(both, SD).any()
    twice = spiked(alone, [(31, LOAD, far[LOAD])])
    assert not doubtful(twice, SD).any()
    step = dataclasses.replace(ramp(), reading=ramp().reading + (np.arange(60) > 30)[:, None] * far)
    assert not doubtful(step, SD).any()
    small = spiked(ramp(), [(30, LOAD, 5.0 * SD[LOAD])])
    assert not doubtful(small, SD).any()
    unread = alone.without(np.arange(60)[:, None] == 30)
    assert not doubtful(unread, SD).any()


def test_a_doubted_reading_that_the_others_explain_is_a_fact():
    field = spiked(ramp(), [(30, LOAD, 20.0 * SD[LOAD])])
    read, told = ramp().reading, np.zeros_like(field.reading)
    assert np.argwhere(contradicted(field, Expected(read, told), SD)).tolist() == [[30, LOAD]]
    vague = told.copy()
    vague[30, LOAD] = (10.0 * SD[LOAD]) ** 2  # the others do not say what it was
    assert not contradicted(field, Expected(read, vague), SD).any()


def test_what_was_set_aside_is_told_with_its_instants():
    aside = np.zeros((60, 3), dtype=bool)
    aside[[3, 30], STROKE] = True
    (one,) = listed(ramp(), aside)
    assert one.values() == {
        "record": "press", "cylinder": "A", "channel": "stroke", "samples": 2,
        "time_s": [0.53, 0.8],
    }  # fmt: skip

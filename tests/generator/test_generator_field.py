"""Field tests of the generator: drops as told, readings whole steps, the truth in balance."""

import numpy as np
import pytest

from rigid.generator.draw import draw
from rigid.generator.field import (
    BACK,
    BEFORE,
    CONTACT_AREA,
    CYCLE,
    PRESSING,
    RETURNING,
    STRENGTH,
    Drop,
    contact_loss,
    field_test,
    press_by_press,
)


@pytest.fixture(scope="module")
def plant():
    truth = draw(7)
    sensors = {q: truth.sensors[f"{q},A"] for q in ("load", "stroke", "pressure")}
    return truth.rig, truth.friction, sensors


@pytest.fixture(scope="module")
def made(plant):
    return field_test(*plant, np.random.default_rng(11), duration=4.0)


def test_the_same_numbers_give_the_same_test(plant, made):
    again = field_test(*plant, np.random.default_rng(11), duration=4.0)
    np.testing.assert_array_equal(again.readings["load"], made.readings["load"])
    np.testing.assert_array_equal(again.displacement, made.displacement)


def test_drops_are_in_the_load(made):
    for drop in made.drops:
        before, after = made.run.ice_load(np.array([drop.begin, drop.end]))
        assert after == pytest.approx(before * (1.0 - drop.part), abs=1e-6)
        assert 1e-3 <= drop.end - drop.begin <= 0.15
    assert made.drops[-1].part == 1.0


def test_readings_are_whole_steps_at_a_fourth_of_the_truths_rate(plant, made):
    assert made.time.size == 4 * (made.readings["load"].size - 1) + 1
    for channel, sensor in plant[2].items():
        codes = made.readings[channel] / sensor.step
        np.testing.assert_allclose(codes, np.rint(codes), atol=1e-9)


def test_the_load_cell_reads_the_ice_where_it_is_calm(plant, made):
    sensor = plant[2]["load"]
    quiet = made.time[::4] < 0.3
    off = made.readings["load"][quiet] - sensor.zero
    assert np.abs(off).max() < 5.0 * (sensor.noise + sensor.step)


def test_fig_12_loses_its_part_of_the_contact(plant):
    drop = Drop(1.5, 1.505, 0.4)
    found = contact_loss(*plant, np.random.default_rng(1), drop, duration=2.0)
    full = 0.5 * STRENGTH * CONTACT_AREA
    assert found.load.max() == pytest.approx(full)
    assert found.load[-1] == pytest.approx(0.6 * full)
    assert found.run.kappa == 1.0


@pytest.mark.slow
def test_a_long_record_comes_back_to_where_it_began(plant):
    """Each press ends in failure and its flow goes back: a press's stroke, some 0.1 to 0.2 m, is
    undone to within a millimetre (the pump gives less against a load), and no oil is sucked in."""
    made = press_by_press(*plant, np.random.default_rng(2), 1)
    time = made.time[::4]
    assert time[-1] == pytest.approx(CYCLE)
    stroke, pressure = made.readings["stroke"], made.readings["pressure"]
    pressing = (time > BEFORE) & (time < BEFORE + PRESSING)
    assert stroke[pressing].max() > 0.05
    assert np.abs(stroke[time > BEFORE + BACK + RETURNING + 3.0]).max() < 2e-3
    assert pressure.min() > -6.0 * (plant[2]["pressure"].noise + plant[2]["pressure"].step)
    assert made.drops[-1].part == 1.0
    assert BEFORE < made.drops[0].begin < made.drops[-1].end < BEFORE + PRESSING

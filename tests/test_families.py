"""Programs of many effects at once, and the narrower ones in which fits are led."""

import jax.numpy as jnp
import numpy as np
import pytest
from rigs import BASE, drive, effects, parameters, track

from rigid.effects import CATALOGUE
from rigid.likelihood.groups import SlowGroup
from rigid.likelihood.problem import Problem
from rigid.localfit.families import LANES, WIDER, families, holding, narrow, read

LIGHT, LATE, GAUGE, AIR = (
    CATALOGUE[name]
    for name in ("piston-leakage", "stroke-sensor-lag", "pressure-gauge-lag", "entrained-air")
)


@pytest.fixture(scope="module")
def problem():
    """The model of a free run, of which nothing was read."""
    run = track("run-1,A", "free-run", 500, drive=drive(500, (0.5, 3.0), (0, 1, 0)))
    groups = (SlowGroup((run,), effects(BASE)),)
    return Problem(effects(BASE), parameters({}), groups, ())


@pytest.fixture(scope="module")
def programs(problem):
    return families(problem, (LIGHT, LATE, GAUGE, AIR))


def test_a_fit_is_led_in_the_program_with_least_beside_its_effects(problem, programs):
    def beside(*effects):
        return set(narrow(programs, problem, effects).effects) - set(programs[0].effects)

    assert narrow(programs, problem, (LIGHT,)) is programs[0]
    assert beside(LATE) == {LATE}
    assert beside(LIGHT, GAUGE) == {GAUGE}
    assert beside(LATE, GAUGE) == {LATE, GAUGE}
    assert set(narrow(programs, problem, (LATE, AIR)).effects) == {LATE, AIR}


def test_few_lanes_more_than_a_turn_has_take_one_turn_and_not_two(problem, programs):
    moving = narrow(programs, problem, (AIR,))
    assert [moving.side_by_side(n) for n in (1, LANES, LANES + 1, WIDER, WIDER + 1)] == [
        *(LANES, LANES, WIDER, WIDER, LANES)
    ]
    assert programs[0].side_by_side(WIDER) == LANES


@pytest.mark.slow
@pytest.mark.parametrize("effect", [LATE, AIR])
def test_a_narrow_program_reads_what_a_wide_one_does(problem, programs, effect):
    """To 1e-9 of the reading, rounding apart; the effect moves it, or nothing would be compared."""
    (amplitude,) = effect.labels()
    values = problem.parameters.values(jnp.zeros((1, problem.parameters.size)))
    values = values | {"kappa[run-1,A]": 0.2}
    lanes = {k: np.broadcast_to(np.asarray(v), LANES + 2) for k, v in values.items()}
    lanes[amplitude] = np.linspace(0.0, 0.02, LANES + 2)
    wide = read(holding(programs, (effect,)), lanes)
    tight = read(narrow(programs, problem, (effect,)), lanes)
    moved = 0.0
    for one, other in zip(wide, tight, strict=True):
        for quantity, series in one.items():
            moved = max(moved, np.ptp(series, axis=-1).max() / np.abs(series).max())
            np.testing.assert_allclose(
                other[quantity], series, rtol=0.0, atol=1e-9 * np.abs(series).max()
            )
    assert moved > 1e-4

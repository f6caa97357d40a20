"""Programs of many effects at once, and the narrower ones in which fits are led."""

import jax.numpy as jnp
import numpy as np
import pytest
from rigs import BASE, drive, effects, parameters, track

from rigid.effects import CATALOGUE
from rigid.effects.base import AbstractEffect, Distortion
from rigid.effects.placed import placed
from rigid.likelihood.groups import SlowGroup
from rigid.likelihood.problem import Problem
from rigid.localfit.families import LANES, WIDER, families, holding, narrow, read
from rigid.localfit.one_of import sharing

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
@pytest.mark.parametrize("effect", [LATE, GAUGE])
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


DRY = tuple(
    CATALOGUE[f"{law}-friction"] for law in ("coulomb", "stribeck", "lugre", "pressure-dependent")
)


class Squeaking(DRY[0]):
    """Friction that a load cell hears: more than a push."""

    def sense(self, seen):
        return Distortion(load=1e-3 * seen.state.slip)


def test_laws_of_dry_friction_take_turns_with_one_bristle_and_others_do_not():
    memory = CATALOGUE["frequency-dependent-friction"]
    there = placed(DRY[0], "boom")
    assert list(sharing((DRY[0], memory, *DRY[1:]))) == [DRY, (memory,)]
    assert list(sharing((DRY[0], there, Squeaking))) == [(DRY[0],), (there,), (Squeaking,)]
    assert Squeaking.sense is not AbstractEffect.sense


SIZED = {"F_C": 800.0, "c_seal": 1e-4, "v_stribeck": 3e-3, "z_bristle": 1e-3, "air_fraction": 1e-3}
"""Values in place of medians."""


def change(problem, family, effect):
    """What an effect changes in all readings, over the range of each."""
    values = problem.parameters.values(jnp.zeros((1, problem.parameters.size)))
    here = {k: np.repeat(np.asarray(v).reshape(-1)[:1], 2) for k, v in values.items()}
    here |= {k: np.full(2, SIZED.get(k, v)) for k, v in family.quiet.items()}
    here |= {"kappa[run-1,A]": np.full(2, 0.2)}
    (amplitude,) = (info for info in effect.parameters() if info.absent is not None)
    here[amplitude.name] = np.array([SIZED[amplitude.name], amplitude.absent])
    if effect in family.turns:
        here[family.turns[effect]] = np.ones(2)
    (group,) = read(family, here)
    return np.concatenate([(s[..., 0] - s[..., 1]).ravel() / np.ptp(s) for s in group.values()])


def off(one, other):
    return np.linalg.norm(one - other) / np.linalg.norm(other)


@pytest.mark.slow
def test_laws_that_take_turns_change_what_each_changes_alone(problem):
    """Within 2 % by their squares, in longer steps; a law in the wrong lane does not."""
    programs = families(problem, DRY)
    shared = holding(programs, DRY)
    assert set(shared.turns) == set(DRY)
    found = [change(problem, shared, law) for law in DRY]
    for number, law in enumerate(DRY):
        alone = change(problem, narrow(programs, problem, (law,)), law)
        each = [off(one, alone) for one in found]
        assert each[number] < 0.02, each
        assert all(other > 0.04 for i, other in enumerate(each) if i != number), each


@pytest.mark.slow
def test_longer_steps_change_little_of_what_an_effect_changes(problem, programs):
    """Within 3 %, where air hardly is compressed and what it changes is fast."""
    coarse = change(problem, holding(programs, (AIR,)), AIR)
    fine = change(problem, narrow(programs, problem, (AIR,)), AIR)
    assert 0.0 < off(coarse, fine) < 0.03

"""Laws that every member of the catalogue keeps, whatever it is."""

from collections.abc import Callable
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rigs import BASE, NOMINAL, prior_draws, rig_of

from rigid.effects import CATALOGUE, AbstractEffect
from rigid.effects.base import EQUATIONS
from rigid.likelihood.priors import LAWS, make_prior
from rigid.physics.rig import CORE_SCALES, Surroundings
from rigid.physics.sensors import Readings, readings
from rigid.physics.strap import edges

FRICTIONLESS = tuple(name for name in BASE if name != "viscous-friction")
OUTSIDE = Surroundings(1e7, -3e4, 0.4, 1.0)
STATES = np.random.default_rng(5).standard_normal((6, len(CORE_SCALES))) * CORE_SCALES
ROUNDED = 1e-12
"""Of one rig's numbers from two programs: a sum rounds at 2e-16 of its largest term."""
# Energy in the effect's own states, so that what it gives back later is not taken for a source.
STORED: dict[str, Callable] = {
    "frequency-dependent-friction": lambda effect, own: sum(
        force**2 * effect.branch_time[i] / (2 * effect.branch_friction[i])
        for i, force in enumerate(own)
    )
}


def with_it(name: str) -> tuple[str, ...]:
    return (*[n for n in FRICTIONLESS if n != name], name)


def without(name: str) -> tuple[str, ...]:
    return tuple(n for n in FRICTIONLESS if n != name)


def flat_states(effect: type[AbstractEffect], own: float = 1.0) -> list[jnp.ndarray]:
    """States of a rig in which the effect is the last."""
    rng = np.random.default_rng(6)
    scales = np.array(effect.scales)
    return [
        jnp.asarray(np.concatenate([s, own * rng.standard_normal(len(scales)) * scales]))
        for s in STATES
    ]


def typical(effect: type[AbstractEffect]) -> dict[str, float]:
    """What is nominal for the rig, and values from the effect's priors for the rest."""
    own = {
        label: float(make_prior(prior.law, prior.arguments, label).from_standard(0.7))
        for info in effect.parameters()
        for label, prior in zip(info.labels, info.priors, strict=True)
    }
    return own | NOMINAL


def rates(values, names, flat) -> jnp.ndarray:
    return jnp.stack(rig_of(values, names).motion(flat, OUTSIDE).rates)


def told(values, names, flat, outside=OUTSIDE) -> jnp.ndarray:
    """All that a rig does and shows: rates, readings, delays, how far readings are means, lines
    that sensors pick up, and when straps have let go; last axes as those of `flat`."""
    rig = rig_of(values, names)
    share, width = rig.averaging() or (0.0, 0.0)
    lines = [effect.lines() for effect in rig.effects]
    strap = rig.strap()
    gone = 0.0 if strap is None else edges(*(jnp.asarray(one)[None] for one in strap))[-2, 0]
    parts = (
        *rig.motion(flat, outside).rates,
        *readings(rig, flat, outside),
        *(rig.delays().get(quantity, 0.0) for quantity in ("load", "pressure", "force")),
        share * width,
        gone,
        *(
            sum((a * jnp.sin(f) for a, f in (one.get(q, (0.0, 0.0)) for one in lines)), start=0.0)
            for q in Readings._fields
        ),
    )
    return jnp.stack([jnp.broadcast_to(part, flat.shape[1:]) for part in parts])


def probes(values, effect: type[AbstractEffect]) -> tuple[jnp.ndarray, Surroundings]:
    """States (n, probes), also where the pump switches and where the plunger creeps, times of an
    event, and the valve open and shut."""
    begin = values.get("event_start", 1.0)
    moving = begin + 0.5 * values.get("event_edge", 1.0)
    times = (1.0, begin, moving, begin + values.get("event_duration", 1.0))
    stage = values.get("p_stage")  # in the middle of a switch its width does not show
    pressures = (None, values["p_max"], stage, stage and stage + values["stage_width"])
    creep = values.get("v_stribeck", 1e-3)
    flats = [
        flat if pressure is None else flat.at[4].set(pressure)
        for one in flat_states(effect)[:2]
        for flat in (one, one.at[1].set(one[3] - creep))
        for pressure in pressures
    ]
    stacked = jnp.stack(flats * len(times) * 2, axis=1)
    when = jnp.tile(jnp.repeat(jnp.asarray(times), len(flats)), 2)
    passing = jnp.repeat(jnp.asarray([OUTSIDE.flow_fraction, 0.0]), len(flats) * len(times))
    return stacked, OUTSIDE._replace(time=when, flow_fraction=passing)


@pytest.mark.parametrize("name", ["pump-stage-switch", "pump-slip", "pump-ripple"])
def test_what_flows_to_the_tank_passes_no_pump(name: str):
    values = typical(CATALOGUE[name]) | {"p_stage": 0.0}
    for share, felt in ((0.4, True), (0.0, False), (-0.4, False)):
        outside = OUTSIDE._replace(flow_fraction=share)
        for flat in flat_states(CATALOGUE[name])[:2]:
            got = told(values, with_it(name), flat, outside)
            expected = told(values, without(name), flat, outside)
            assert np.any(np.abs(got - expected) > 1e-6 * np.abs(expected)) == felt


def changes_nothing_where_absent(effect: type[AbstractEffect]):
    absent = {
        label: info.absent
        for info in effect.parameters()
        for label in info.labels
        if info.absent is not None
    }
    if not absent:
        assert not effect.scales  # a spring, the oil, the pump: there is no rig without them
        return
    n, values = len(CORE_SCALES), typical(effect) | absent
    for flat in flat_states(effect, own=0.0):
        core = flat[:n]
        got = told(values, with_it(effect.name), flat)
        expected = told(values, without(effect.name), core)
        # two programs: a compiler may fuse a product and a sum in one of them and not in the other
        np.testing.assert_allclose(np.delete(got, np.s_[n : len(flat)]), expected, ROUNDED)
        if np.any(got[n : len(flat)]):  # states that move on by themselves must not be felt
            moved = told(values, with_it(effect.name), flat.at[n:].set(jnp.asarray(effect.scales)))
            np.testing.assert_allclose(np.delete(moved, np.s_[n : len(flat)]), expected, ROUNDED)


def is_finite_and_differentiable_over_its_prior(effect: type[AbstractEffect]):
    names = with_it(effect.name)
    labels = [label for info in effect.parameters() for label in info.labels]

    @jax.jit
    def slopes(values, flat, outside):
        def scaled(logs):
            new = values | {k: values[k] * jnp.exp(logs[i]) for i, k in enumerate(labels)}
            return told(new, names, flat, outside)

        return scaled(jnp.zeros(len(labels))), jax.jacfwd(scaled)(jnp.zeros(len(labels)))

    for values in prior_draws(names, 5, 7):
        shown, by_values = slopes(values, *probes(values, effect))
        assert np.all(np.isfinite(shown))
        assert np.all(np.isfinite(by_values))
        # Something on record depends on each of its numbers (a switch at 700 bar may saturate in
        # double precision, so probes stand near what switches).
        assert np.all(np.any(by_values, axis=(0, 1)))
        for flat in flat_states(effect)[:2]:
            assert np.all(np.isfinite(jax.jacfwd(lambda y, v=values: rates(v, names, y))(flat)))


def adds_no_energy_by_friction(effect: type[AbstractEffect]):
    omega = jnp.logspace(-3, 5, 50)
    for values in prior_draws(with_it(effect.name), 5, 8):
        # Where the sign is free, the positive one is friction.
        values |= {label: abs(values[label]) for i in effect.parameters() for label in i.labels}
        made = effect.build(values)
        assert np.all(np.real(made.friction(omega)) >= 0.0)
        if not np.any(made.friction(omega)):
            continue
        rig = rig_of(values, with_it(effect.name))
        for flat in flat_states(effect):
            state, own = rig.state(flat), tuple(flat[len(CORE_SCALES) :])
            action = made(state, own)
            stored = STORED.get(effect.name, lambda *_: 0.0)
            growth = jax.jvp(partial(stored, made), (own,), (action.rates,))[1]
            power = action.between * state.slip + growth
            assert power <= 1e-12 * abs(action.between * state.slip)


def pushes_the_bodies_equally_and_oppositely(effect: type[AbstractEffect]):
    for values in prior_draws(with_it(effect.name), 3, 9):
        rig = rig_of(values, with_it(effect.name))
        for flat in flat_states(effect):
            moved = rig.motion(flat, OUTSIDE)
            acted = rig.actions(flat, rig.state(flat, outside=OUTSIDE))[-1]
            inner = rig.cylinder_mass * moved.rates[1] + rig.plunger_mass * moved.rates[3]
            outer = moved.load + OUTSIDE.force - OUTSIDE.contact_stiffness * flat[2]
            outer = outer + acted.on_plunger
            size = abs(rig.cylinder_mass * moved.rates[1]) + abs(moved.load) + abs(acted.between)
            size += abs(acted.on_plunger)
            # Differences of forces of this size, a few roundings each.
            assert inner == pytest.approx(outer, abs=20 * np.finfo(float).eps * float(size))


def has_tangents_that_are_differences(effect: type[AbstractEffect]):
    names = with_it(effect.name)
    scales = jnp.asarray(CORE_SCALES + effect.scales)
    for values in prior_draws(names, 2, 10):
        flat = flat_states(effect)[0]
        for i in range(len(scales)):
            along = jnp.zeros_like(flat).at[i].set(scales[i])

            def at(step, along=along, flat=flat, values=values):
                return rates(values, names, flat + step * along)

            tangent = jax.jvp(at, (0.0,), (1.0,))[1]
            h = 1e-5
            difference = (at(h) - at(-h)) / (2 * h)
            # Truncation h^2 of functions of order 1 and rounding eps/h of the rates.
            size = jnp.abs(tangent) + jnp.abs(at(0.0)) * 1e-2
            np.testing.assert_allclose(difference / size, tangent / size, atol=1e-6)


def is_described(effect: type[AbstractEffect]):
    assert CATALOGUE[effect.name] is effect
    assert effect.equation in EQUATIONS
    assert effect.source
    assert effect.__doc__
    assert effect.parameters()
    for info in effect.parameters():
        assert info.symbol
        assert info.unit
        assert info.priors
        assert all(prior.law in LAWS for prior in info.priors)
    if effect.name not in BASE:
        assert any(info.absent is not None for info in effect.parameters())


LAW_TABLE = (
    changes_nothing_where_absent,
    is_finite_and_differentiable_over_its_prior,
    adds_no_energy_by_friction,
    pushes_the_bodies_equally_and_oppositely,
    has_tangents_that_are_differences,
    is_described,
)


@pytest.mark.parametrize("law", LAW_TABLE, ids=lambda law: law.__name__)
@pytest.mark.parametrize("name", CATALOGUE)
def test_effect(name: str, law: Callable):
    law(CATALOGUE[name])


@pytest.mark.parametrize("pressure", [0.0, 136e5, 700e5, 750e5])
def test_pump_is_equation_22_in_bar_and_litres(pressure: float):
    flow = rig_of(NOMINAL).effects[3](rig_of(NOMINAL).state(jnp.array([0, 0, 0, 0, pressure])), ())
    litres = 6.645 - 4.965 * np.tanh(0.05 * (pressure / 1e5 - 700.0))
    assert float(flow.inflow) * 60e3 == pytest.approx(litres, rel=1e-12)

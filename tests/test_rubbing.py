"""What bristles do in a step: the slip at which rig and bristles agree, and the means in it."""

from decimal import Decimal, getcontext

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rigs import BASE, NOMINAL, rig_of
from scipy.optimize import brentq
from test_staggered import DRY

from rigid.physics import staggered
from rigid.physics.rubbing import Rubbing
from rigid.physics.step_matrices import growths

STEP = 4e-4
"""Length of a step [s]."""


def rubbing_of(name: str, share: float) -> Rubbing:
    """The bristles of a law, at rest, carrying a share."""
    rig = rig_of(NOMINAL | DRY[name], (*BASE, name))
    state = rig.state(jnp.zeros(6).at[4].set(1e6))
    bristles = staggered.Parted.of(rig).bristles
    return Rubbing(bristles, (jnp.asarray(share),), state, STEP)


def test_growths_are_those_of_many_digits():
    """Both means beside forty digits, where series and exponential meet and far from there."""
    getcontext().prec = 40
    for x in (-700.0, -3.0, -0.1001, -0.0999, -1e-3, -1e-9, 1e-6, 0.0999, 0.1001, 2.0):
        exact, wide = Decimal(x), Decimal(x).exp()
        first = (wide - 1) / exact
        second = (first - 1) / exact
        got = [float(one) for one in growths(jnp.asarray(x))]
        assert got == pytest.approx([float(first), float(second)], rel=3e-13), x
    assert [float(one) for one in growths(jnp.asarray(0.0))] == [1.0, 0.5]


@pytest.mark.parametrize("name", list(DRY))
def test_slip_and_force_agree(name):
    """The force is that at the slip which it leaves, as bisection finds it."""
    among = eqx.filter_jit(lambda one, free, by_force: one.among(free, by_force))
    at = eqx.filter_jit(lambda one, slip: one.at(slip))
    for share in (-0.9, 0.0, 0.5):
        one = rubbing_of(name, share)
        for free in (-0.3, -2e-4, 1e-9, 5e-6, 2e-2):
            for by_force in (1e-9, 1e-6, 1e-4):

                def excess(slip: float, one=one, free=free, by_force=by_force) -> float:
                    return slip - free - by_force * float(at(one, jnp.asarray(slip)).force)

                slip = brentq(excess, -10.0, 10.0, xtol=1e-17, rtol=1e-14)
                want = at(one, jnp.asarray(slip))
                got = among(one, jnp.asarray(free), jnp.asarray(by_force))
                assert free + by_force * float(got.force) == pytest.approx(
                    slip, rel=1e-6, abs=1e-13
                )
                assert float(got.shares[0]) == pytest.approx(float(want.shares[0]), abs=1e-6)


def test_slopes_of_the_force_are_those_of_the_equation():
    """By the free slip, what a newton makes of it and the share carried, both ways of JAX."""
    with_share = rubbing_of("coulomb-friction", 0.2)

    def force(free, by_force, share):
        return with_share._replace(shares=(share,)).among(free, by_force).force

    for free in (-1e-3, 3e-6, 2e-2):
        at = tuple(jnp.asarray(x) for x in (free, 1e-6, 0.2))
        backward = jax.jit(jax.grad(force, (0, 1, 2)))(*at)
        for i, (here, slope) in enumerate(zip(at, backward, strict=True)):
            along = tuple(jnp.asarray(float(i == j)) for j in range(3))
            assert float(jax.jvp(force, at, along)[1]) == pytest.approx(float(slope), rel=1e-12)
            h = 1e-5 * abs(float(here))
            ends = [force(*at[:i], here + d, *at[i + 1 :]) for d in (-h, h)]
            difference = float(ends[1] - ends[0]) / (2 * h)
            assert float(slope) == pytest.approx(difference, rel=1e-4, abs=1e-3)


def test_a_search_cut_short_is_seen(monkeypatch):
    """With two turns in place of all that it takes, force and slip do not agree."""
    monkeypatch.setattr("rigid.physics.rubbing.MOST_TURNS", 2)
    one = rubbing_of("coulomb-friction", -0.9)
    free, by_force = jnp.asarray(2e-4), jnp.asarray(1e-6)
    got = one.among(free, by_force)
    left = free + by_force * got.force
    assert not np.isclose(float(one.at(left).force), float(got.force), rtol=1e-6)

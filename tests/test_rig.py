"""The equations of motion against the paper's, written out once more in NumPy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rigs import BASE, MEMORY, NOMINAL, prior_draws, rig_of

from rigid.physics.characteristic import TwoMassRig, dimensionless, roots
from rigid.physics.rig import CORE_SCALES, Surroundings
from rigid.physics.sensors import readings

OWN = (1e3, -2e3)
RNG = np.random.default_rng(11)
STATES = RNG.standard_normal((8, 5)) * CORE_SCALES
OUTSIDE = Surroundings(2e7, -4e4, 0.3)


def equations(v: dict, flat: np.ndarray, outside: Surroundings) -> np.ndarray:
    """Equations (2)-(9) and (22) with the errata's signs and factors, and the Maxwell branches."""
    x_hc, v_hc, x_pl, v_pl, p, *branches = flat
    v_ss, x_ss = v_pl - v_hc, x_pl - x_hc  # (6)
    f_f = -v["mu"] * v_ss - sum(branches)  # (8)
    f_lc = -v["k_LC"] * x_hc  # (8)
    f_oil = v["S_Pl"] * p  # (8)
    f_ice = outside.force - outside.contact_stiffness * x_pl
    q = (6.645 - 4.965 * np.tanh(0.05 * (p / 1e5 - v["p_max"] / 1e5))) / 60e3  # (22)
    volume = v["S_Pl"] * (v["L_0"] + x_ss)  # (5)
    return np.array(
        [
            v_hc,
            (f_lc - f_oil - f_f) / (v["M_HC"] - v["M_Pl"]),  # (2)
            v_pl,
            (f_oil + f_f + f_ice) / (v["M_Pl"] + v["M_Fl"] / 2),  # (3)
            v["k_oil"] * (outside.flow_fraction * q - v["S_Pl"] * v_ss) / volume,  # (4), (9)
            *(
                (v[f"mu_branch[{i}]"] * v_ss - force) / v[f"tau_branch[{i}]"]
                for i, force in enumerate(branches, start=1)
            ),
        ]
    )


@pytest.mark.parametrize("values", [NOMINAL, *prior_draws(MEMORY, 3, 12)])
def test_motion_is_the_papers(values: dict):
    rig = rig_of(values)
    for core in STATES:
        flat = np.concatenate([core, OWN])
        got = np.array(rig.motion(jnp.asarray(flat), OUTSIDE).rates)
        expected = equations(values, flat, OUTSIDE)
        # The momentum equations subtract forces much larger than their sum: 1e-12 of those.
        size = np.abs(expected)
        forces = values["mu"] * abs(core[3] - core[1]) + values["k_LC"] * abs(core[0]) + 1e4
        size[[1, 3]] += forces / 50.0
        assert np.all(np.abs(got - expected) <= 1e-12 * size)


def test_momentum_changes_by_outer_forces_alone():
    rig = rig_of(NOMINAL)
    for core in STATES:
        flat = jnp.asarray(np.concatenate([core, OWN]))
        moved = rig.motion(flat, OUTSIDE)
        total = rig.cylinder_mass * moved.rates[1] + rig.plunger_mass * moved.rates[3]
        outer = moved.load + OUTSIDE.force - OUTSIDE.contact_stiffness * flat[2]
        assert float(total) == pytest.approx(float(outer), rel=1e-10, abs=1e-6)


@pytest.mark.parametrize("mu", [0.0, 3.7e3, 2e4, 1.35e6, 4.46e6])
def test_jacobian_at_rest_has_the_characteristic_roots(mu: float):
    values = NOMINAL | {"mu": mu}
    rig = rig_of(values, BASE)
    scales = jnp.asarray(rig.scales)

    def scaled(y):
        return jnp.stack(rig.motion(y * scales, Surroundings(), rig.column).rates) / scales

    rates = np.linalg.eigvals(np.asarray(jax.jacfwd(scaled)(jnp.zeros(5))))
    oil = values["k_oil"] * values["S_Pl"] / values["L_0"]
    two = TwoMassRig(50.0, 110.0, oil, values["k_LC"])
    epsilon, a1, a2, omega_0 = dimensionless(two, mu)
    expected = 1j * omega_0 * roots(epsilon, a1, a2)
    distance = np.abs(expected[:, None] - rates[None, :]).min(axis=1)
    assert distance.max() < 1e-9 * np.abs(rates).max()
    # The fifth is the neutral one: the rig may rest at any stroke.
    assert np.abs(rates).min() < 1e-9 * np.abs(rates).max()


def test_sensors_read_what_the_paper_says():
    rig, flat = rig_of(NOMINAL), jnp.asarray(np.concatenate([STATES[0], OWN]))
    read = readings(rig, flat, OUTSIDE)
    assert float(read.load) == pytest.approx(-NOMINAL["k_LC"] * float(flat[0]))
    assert float(read.stroke) == float(flat[2] - flat[0])
    assert float(read.pressure) == float(flat[4])
    assert float(read.acceleration) == float(rig.motion(flat, OUTSIDE).rates[3])


def test_only_oil_stiffness_over_column_enters():
    """k_oil and the column cannot be told apart: the same motion from the same ratio."""
    one = rig_of(NOMINAL)
    two = rig_of(NOMINAL | {"k_oil": 2 * NOMINAL["k_oil"], "L_0": 2 * NOMINAL["L_0"]})
    flat = jnp.asarray(np.concatenate([STATES[1], OWN]))
    a = one.motion(flat, OUTSIDE, jnp.asarray(0.21))
    b = two.motion(flat, OUTSIDE, jnp.asarray(0.42))
    np.testing.assert_allclose(a.rates, b.rates, rtol=1e-14)


def test_friction_of_the_rig_is_the_sum_over_its_effects():
    omega = jnp.asarray([0.0, 1.0, 500.0])
    got = rig_of(NOMINAL).friction(omega)
    expected = 1e5 + 5e5 / (1 + 0.2j * omega) + 1e5 / (1 + 8e-3j * omega)
    np.testing.assert_allclose(got, expected, rtol=1e-14)
    np.testing.assert_array_equal(rig_of(NOMINAL, ("load-cell-spring",)).friction(omega), 0.0)

"""The closed forms of rigid.physics.characteristic against an eigenvalue solver and each other."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid.physics.characteristic import (
    PUBLISHED_RIG,
    TwoMassRig,
    critical_epsilon,
    dimensionless,
    frictionless_roots,
    load_cell_stiffness,
    locked_root,
    modes,
    polynomial,
    roots,
)

FRICTIONS = st.floats(-3.0, 3.0).map(lambda e: 10.0**e)
RATIOS = st.floats(-1.0, 1.0).map(lambda e: 10.0**e)


def state_matrix(rig: TwoMassRig, friction: float) -> np.ndarray:
    """d/dt of (x_HC, x_Pl, v_HC, v_Pl), from equations (10)-(13) with the pressure eliminated."""
    oil = rig.oil_stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]])
    drag = friction * np.array([[1.0, -1.0], [-1.0, 1.0]])
    spring = np.diag([rig.load_cell_stiffness, 0.0])
    mass = np.array([[rig.cylinder_mass], [rig.plunger_mass]])
    return np.block([[np.zeros((2, 2)), np.eye(2)], [-(oil + spring) / mass, -drag / mass]])


@pytest.mark.parametrize("friction", [0.0, 3.7e3, 2e4, 9e4, 1.35e6, 4.46e6])
def test_roots_are_the_eigenvalues_of_the_two_masses(friction: float):
    epsilon, a1, a2, omega_0 = dimensionless(PUBLISHED_RIG, friction)
    scale = np.diag([omega_0, omega_0, 1.0, 1.0])  # positions as speeds, so that all are alike
    matrix = scale @ state_matrix(PUBLISHED_RIG, friction) @ np.linalg.inv(scale)
    rates = 1j * omega_0 * roots(epsilon, a1, a2)
    expected = np.linalg.eigvals(matrix)
    distance = np.abs(rates[:, None] - expected[None, :]).min(axis=1)
    # Both solvers are backward stable: errors of a few eps times the norm, against a root.
    assert distance.max() < 1e3 * np.finfo(float).eps * np.abs(expected).max()


@settings(deadline=None)  # a loaded machine is no fault
@given(FRICTIONS, RATIOS, RATIOS)
def test_roots_solve_the_equation_and_decay(epsilon: float, a1: float, a2: float):
    coefficients, found = polynomial(epsilon, a1, a2), roots(epsilon, a1, a2)
    size = np.polyval(np.abs(coefficients), np.abs(found))
    assert np.all(np.abs(np.polyval(coefficients, found)) < 1e-10 * size)
    assert np.all(found.imag > 0)


@settings(deadline=None)  # a loaded machine is no fault
@given(FRICTIONS, RATIOS, RATIOS)
def test_roots_come_in_mirror_images(epsilon: float, a1: float, a2: float):
    found = roots(epsilon, a1, a2)
    np.testing.assert_array_equal(np.sort_complex(-found.conj()), found)


@settings(deadline=None)  # a loaded machine is no fault
@given(RATIOS, RATIOS)
def test_limits(a1: float, a2: float):
    slow, fast = frictionless_roots(a1, a2)
    np.testing.assert_allclose(roots(0.0, a1, a2).real, [-fast, -slow, slow, fast], rtol=1e-7)
    swinging = roots(1e6, a1, a2)[-1]
    # The next term of the expansion in 1/epsilon is imaginary: the real part is right to 1/eps^2.
    assert swinging.real == pytest.approx(locked_root(a1, a2), rel=1e-6)


@settings(deadline=None)  # a loaded machine is no fault
@given(RATIOS, RATIOS)
def test_critical_epsilon_parts_four_swinging_roots_from_two(a1: float, a2: float):
    edge = critical_epsilon(a1, a2)
    assert np.count_nonzero(roots(edge * (1 - 1e-9), a1, a2).real) == 4
    assert np.count_nonzero(roots(edge, a1, a2).real) == 2


def test_modes_without_friction_last_for_ever():
    found = modes(PUBLISHED_RIG, 0.0)
    assert found.period.shape == (2,)
    assert np.all(np.isinf(found.e_folding))


def test_modes_above_the_critical_friction_are_one_swing_and_two_decays():
    found = modes(PUBLISHED_RIG, 1.35e6)
    np.testing.assert_array_equal(np.isinf(found.period), [False, True, True])


def test_stiffness_refuses_a_frame_that_explains_all():
    with pytest.raises(ValueError, match="leaves nothing for the load cell"):
        load_cell_stiffness(250e3, 5e-3, 1e7)

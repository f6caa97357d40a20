"""The simulated plant against closed forms that share no code with it."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.linalg import expm

from rigid.generator.constants import AREA
from rigid.generator.core import Action, Motion, Piece, Rig, Seen
from rigid.generator.friction import Friction
from rigid.generator.pieces import Frame, Ice, Pump, pump_flow
from rigid.generator.plant import Plant, readings, trajectory

RIG = Rig(k_LC=6e7, k_oil=2e9, L_0=0.2, M_HC=60.0, M_Pl=10.0, M_Fl=200.0, k_frame=2.857e8)
FRICTION = Friction(mu_inf=8e4, mu_1=9e5, tau_1=0.2, mu_2=1.2e5, tau_2=8e-3)
STEADY = FRICTION.mu_inf + FRICTION.mu_1 + FRICTION.mu_2


def linear_system(frame: float, flow: float) -> np.ndarray:
    """Force form of the friction, column held at L_0; the last state is the constant one.

    States: x_HC, v_HC, x_Pl, v_Pl, p, branch forces R_1 and R_2 with tau R' = mu v - R.
    """
    m1, m2 = 60.0 - 10.0, 10.0 + 200.0 / 2
    area, oil, spring = 44.2e-4, 2e9 / 0.2, 6e7
    a = np.zeros((8, 8))
    a[0, 1] = a[2, 3] = 1.0
    a[1, :7] = [-spring, -8e4, 0, 8e4, -area, 1, 1]
    a[3, :7] = [0, 8e4, -frame, -8e4, area, -1, -1]
    a[1] /= m1
    a[3] /= m2
    a[4, [1, 3, 7]] = oil, -oil, oil * flow / area
    for row, (mu, tau) in ((5, (9e5, 0.2)), (6, (1.2e5, 8e-3))):
        a[row, [1, 3, row]] = -mu / tau, mu / tau, -1 / tau
    return a


def exponential(system: np.ndarray, start: np.ndarray, times: np.ndarray) -> np.ndarray:
    # The states are scaled to be of one size, or the exponential loses its digits.
    scale = np.array([1e-6, 1e-3, 1e-6, 1e-3, 1e4, 1e2, 1e2, 1.0])
    scaled = system * scale / scale[:, None]
    return np.stack([scale * (expm(scaled * t) @ (start / scale)) for t in times], axis=1)


# The column changes by a part in 1e5 and the solver is given 1e-6 of these motions: 5e-5 is above
# both, and far below the effect of any wrong sign or factor.
SMALL = 5e-5


def test_small_release_is_the_matrix_exponential():
    preload = 60.0
    start = np.zeros(8)
    start[[0, 2, 4, 7]] = -preload / 6e7, -preload / 6e7, preload / 44.2e-4, 1.0
    times = np.arange(0, 0.25, 1 / 1600)
    expected = exponential(linear_system(0.0, 0.0), start, times)
    plant = Plant(RIG, (FRICTION, Pump((1.0,), (0.0,))))
    motion = trajectory(plant, plant.at_rest(-preload / RIG.k_LC, preload / AREA), times)
    for state in range(5):
        scale = np.abs(expected[state]).max()
        np.testing.assert_allclose(motion.states[state], expected[state], atol=SMALL * scale)
    acceleration = (linear_system(0.0, 0.0) @ expected)[3]
    assert acceleration[0] == pytest.approx(preload / 110.0)
    np.testing.assert_allclose(motion.acceleration, acceleration, atol=SMALL * preload / 110.0)


def test_small_push_on_the_frame_is_the_matrix_exponential():
    kappa = 1e-4
    start = np.zeros(8)
    start[7] = 1.0
    times = np.arange(0, 1.0, 0.01)
    flow = kappa * 11.61e-3 / 60  # the pump's fast stage, l/min at no pressure
    expected = exponential(linear_system(RIG.k_frame, flow), start, times)
    plant = Plant(RIG, (FRICTION, Pump((9.0,), (kappa,)), Frame(RIG.k_frame)))
    motion = trajectory(plant, plant.at_rest(), times)
    for state in (0, 2, 4):
        scale = np.abs(expected[state]).max()
        np.testing.assert_allclose(motion.states[state], expected[state], atol=SMALL * scale)


def test_free_running_balances_pressure_and_friction():
    kappa = 0.12
    plant = Plant(RIG, (FRICTION, Pump((9.0,), (kappa,))))
    motion = trajectory(plant, plant.at_rest(), np.array([0.0, 8.0]))
    _, v_hc, _, v_pl, p, *_ = motion.states[:, -1]
    # The oil keeps its density once the pressure is steady, so the flow sets the speed.
    assert v_pl - v_hc == pytest.approx(kappa * pump_flow(p) / AREA, rel=1e-6)
    assert AREA * p == pytest.approx(STEADY * (v_pl - v_hc), rel=1e-6)


def test_a_shut_valve_on_the_frame_comes_to_a_static_balance():
    valve = Pump((2.6, 60.0), (0.09, 0.0))
    plant = Plant(RIG, (FRICTION, valve, Frame(RIG.k_frame)))
    times = np.array([0.0, 2.6, 30.0, 60.0])
    motion = trajectory(plant, plant.at_rest(), times)
    x_hc, _, x_pl, _, p = motion.states[:5, -1]
    load = -RIG.k_LC * x_hc
    assert 200e3 < load < 260e3
    assert load == pytest.approx(AREA * p, rel=1e-6)
    assert load == pytest.approx(RIG.k_frame * x_pl, rel=1e-6)
    assert readings(plant, motion, times)["load"][-1] == load
    # Eq. (16) gives the stiffness back from load and stroke.
    stroke = x_pl - x_hc
    assert RIG.k_frame * load / (RIG.k_frame * stroke - load) == pytest.approx(6e7, rel=1e-6)


def test_oil_is_neither_made_nor_lost_behind_a_shut_valve():
    valve = Pump((2.605, 9.0), (0.09, 0.0))  # a switch between two samples
    plant = Plant(RIG, (FRICTION, valve, Frame(RIG.k_frame)))
    motion = trajectory(plant, plant.at_rest(), np.arange(0, 7.0, 0.01))
    x_hc, _, x_pl, _, p = motion.states[:5]
    mass = np.exp(p / RIG.k_oil) * (RIG.L_0 + x_pl - x_hc)  # over density and area
    np.testing.assert_allclose(mass[261:], mass[-1], rtol=1e-8)
    assert mass[260] < mass[261] * (1 - 1e-6)


def energy(state: np.ndarray) -> np.ndarray:
    """Kinetic energy, springs, and the work the oil can still do until its pressure is gone."""
    x_hc, v_hc, x_pl, v_pl, p, z_1, z_2 = state
    column = RIG.L_0 + x_pl - x_hc
    slack = column * np.exp(p / RIG.k_oil)  # the column at which the pressure is gone
    oil = AREA * RIG.k_oil * (slack - column - column * np.log(slack / column))
    stroke = x_pl - x_hc
    branches = 9e5 / 0.2 * (stroke - z_1) ** 2 + 1.2e5 / 8e-3 * (stroke - z_2) ** 2
    return (50 * v_hc**2 + 110 * v_pl**2 + 6e7 * x_hc**2 + branches) / 2 + oil


def test_energy_falls_after_a_release():
    plant = Plant(RIG, (FRICTION, Pump((1.0,), (0.0,))))
    rest = plant.at_rest(-6000.0 / RIG.k_LC, 6000.0 / AREA)
    motion = trajectory(plant, rest, np.arange(0, 0.25, 1e-4))
    values = energy(motion.states)
    assert np.diff(values).max() < 1e-7 * values[0]
    assert values[-1] < 0.1 * values[0]


def test_a_friction_of_the_wrong_sign_gains_energy():
    pushed = replace(FRICTION, mu_inf=-3e4, mu_1=1.0, mu_2=1.0)
    plant = Plant(RIG, (pushed, Pump((1.0,), (0.0,))))
    rest = plant.at_rest(-6000.0 / RIG.k_LC, 6000.0 / AREA)
    motion = trajectory(plant, rest, np.arange(0, 0.005, 1e-4))
    assert np.diff(energy(motion.states)).max() > 0


@pytest.mark.parametrize("frequency", [0.01, 1.0, 30.0, 80.0, 1000.0])
def test_displacement_form_gives_the_coefficient(frequency: float):
    rate = 2j * np.pi * frequency  # of a stroke exp(rate t), taken at t = 0
    state = np.array([1.0, rate, 1 / (1 + rate * 0.2), 1 / (1 + rate * 8e-3)])
    actions = [  # the piece is linear: real and imaginary part apart
        FRICTION.act(0.0, Motion(0.0, 0.0, stroke, speed, 0.0), own)
        for stroke, speed, *own in (state.real.tolist(), state.imag.tolist())
    ]
    in_phase, out_of_phase = (np.array([*a.rates, a.on_plunger, a.on_cylinder]) for a in actions)
    force = FRICTION.coefficient(frequency) * rate
    expected = [*(rate * state[2:]), -force, force]
    scale = np.abs(expected)
    np.testing.assert_allclose((in_phase + 1j * out_of_phase) / scale, expected / scale, atol=1e-9)


def test_coefficient_falls_from_steady_running_to_ringing():
    assert FRICTION.coefficient(0.0) == pytest.approx(STEADY)
    falling = [abs(FRICTION.coefficient(f)) for f in (0.0, 0.3, 3.0, 30.0)]
    assert all(a > b for a, b in pairwise(falling))
    assert abs(FRICTION.coefficient(80.0)) == pytest.approx(1e5, rel=0.1)


def test_pump_flow_has_its_two_stages():
    assert pump_flow(0.0) * 6e4 == pytest.approx(6.645 + 4.965)
    assert pump_flow(700e5) * 6e4 == pytest.approx(6.645)
    assert pump_flow(900e5) * 6e4 == pytest.approx(6.645 - 4.965, rel=1e-6)


def test_ice_pushes_back_and_the_load_cell_reads_it():
    ice = Ice((0.0, 2.0, 9.0), (0.0, 0.0, 7e4))
    plant = Plant(RIG, (FRICTION, Pump((9.0,), (0.2,)), ice))
    times = np.array([0.0, 5.0, 8.0])
    load = readings(plant, trajectory(plant, plant.at_rest(), times), times)["load"]
    np.testing.assert_allclose(load[1:], [3e4, 6e4], rtol=1e-4)


@pytest.mark.parametrize("first", [0.0, 2e4])
def test_under_ice_the_rig_rests_where_its_first_load_has_it(first: float):
    """Found by balance, as with a hidden piece in the rig, before the load is cut to stretches."""
    plant = Plant(RIG, (FRICTION, Ice((0.0, 2.0, 9.0), (first, first, 7e4))))
    rest = plant.balanced()
    np.testing.assert_allclose(rest[0], -first / RIG.k_LC, atol=1e-12)
    np.testing.assert_allclose(rest[4], first / AREA, atol=1e-3)


@dataclass(frozen=True)
class Leak(Piece):
    conductance: float

    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        return Action(loss=self.conductance * motion.p)


@dataclass(frozen=True)
class Air(Piece):
    """Entrained air: a volume that gives way besides the oil's."""

    compliance: float

    def act(self, t: float, motion: Motion, own: list[float]) -> Action:  # noqa: ARG002
        return Action(compliance=self.compliance)


@dataclass(frozen=True)
class LateStroke(Piece):
    """The stroke is read late."""

    delay: float

    def read(self, seen: Seen, readings: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        late = np.interp(seen.times - self.delay, seen.times, readings["stroke"])
        return readings | {"stroke": late}


def frame_readings(*hidden: Piece) -> dict[str, np.ndarray]:
    valve = Pump((2.0, 4.0), (0.09, 0.0))
    plant = Plant(RIG, (*hidden, FRICTION, valve, Frame(RIG.k_frame)))
    times = np.arange(0, 4.0, 0.1)
    return readings(plant, trajectory(plant, plant.at_rest(), times), times)


def test_another_effect_is_one_more_piece():
    plain, leaking = frame_readings(), frame_readings(Leak(1e-13))
    airy, late = frame_readings(Air(1e-13)), frame_readings(LateStroke(0.1))
    assert leaking["pressure"][-1] < 0.95 * plain["pressure"][-1]
    assert airy["pressure"][-1] < 0.95 * plain["pressure"][-1]
    np.testing.assert_array_equal(late["load"], plain["load"])
    np.testing.assert_allclose(late["stroke"][1:], plain["stroke"][:-1], rtol=1e-9)
    nothing = frame_readings(Piece())
    np.testing.assert_array_equal(nothing["pressure"], plain["pressure"])

"""Each equation of the paper at one state of the rig, beside what this package computes there.

The state is one at which no term vanishes, so that a wrong sign or factor shows. What the package
gives is taken from its rig (`rigid.physics.rig`), its sensors and its closed forms; what the paper
gives is written out here as printed.
"""

from collections.abc import Callable
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.effects import CATALOGUE
from rigid.physics import characteristic as ch
from rigid.physics.rig import FREE, Rig, Surroundings, build_rig
from rigid.physics.sensors import readings
from rigid.physics.step_matrices import jacobian
from rigid.published.walk.claims import free_run
from rigid.published.walk.constants import Constants, Values, nominal, section, two_masses
from rigid.published.walk.items import Explanation, Item
from rigid.published.walk.numbers import Numbers

BASE = ("load-cell-spring", "oil-compressibility", "viscous-friction", "pump-curve")

STATE = (-1.3e-3, 0.021, 0.047, 0.013, 5.2e6)
"""x_HC [m], v_HC [m/s], x_Pl [m], v_Pl [m/s], p [Pa] at which the equations are compared."""

FORCE, FRACTION = -2.1e4, 0.2
"""F_Ice [N] and kappa [1] there."""


def base_rig(values: Values, friction: Array | float) -> Rig:
    """The rig of the paper with a constant friction coefficient [N s/m]."""
    effects = tuple(CATALOGUE[name] for name in BASE)
    return build_rig(effects, {**values, "mu": friction})


@dataclass(frozen=True)
class Place:
    """The state at which the equations are compared, and what is known of it.

    - `numbers`, `values`: of the paper. - `rates`: of the package's rig under force and flow.
    - `free`: the same, out of force and flow with the oil column frozen at L_0.
    """

    numbers: Numbers
    values: Constants
    rig: Rig
    rates: tuple[float, ...]
    free: tuple[float, ...]
    load: float

    def __getitem__(self, name: str) -> float:
        return self.values[name]

    @property
    def masses(self) -> tuple[float, float]:
        """M_HC - M_Pl and M_Pl + M_Fl/2 [kg]."""
        return self["M_HC"] - self["M_Pl"], self["M_Pl"] + self["M_Fl"] / 2

    @property
    def mu(self) -> float:
        """Friction coefficient of (17) [N s/m]."""
        return self.numbers["mu_release"].si

    @property
    def slip(self) -> float:
        """v_SS [m/s]."""
        return STATE[3] - STATE[1]

    @property
    def column(self) -> float:
        """V_oil/S_Pl [m]."""
        return self["L_0"] + STATE[2] - STATE[0]

    @property
    def forces(self) -> tuple[float, float, float]:
        """F_p, F_f, F_LC of (8) [N]."""
        return self["S_Pl"] * STATE[4], -self.mu * self.slip, -self["k_LC"] * STATE[0]

    def flow(self, pressure: float) -> float:
        """q of (22) [m^3/s], as printed: pressures in bar."""
        n = {name: self.numbers[f"pump_{name}"] for name in ("flow_mean", "flow_half_range")}
        slope, most = (self.numbers[f"pump_{name}"].si for name in ("slope", "pressure"))
        curve = n["flow_mean"].si - n["flow_half_range"].si * np.tanh(slope * (pressure - most))
        return float(self.numbers["pump_flow_unit"].si * curve)


def place(numbers: Numbers) -> Place:
    """The state with the package's answers."""
    values = nominal(numbers)
    rig = base_rig(values, numbers["mu_release"].si)
    flat = jnp.asarray(STATE)
    pushed = rig.motion(flat, Surroundings(force=FORCE, flow_fraction=FRACTION))
    free = rig.motion(flat, FREE, rig.column)
    return Place(
        numbers, values, rig, tuple(map(float, pushed.rates)), tuple(map(float, free.rates)),
        float(pushed.load),
    )  # fmt: skip


@dataclass(frozen=True)
class Equation:
    """An equation: its left-hand side by the package, its right-hand side as printed.

    - `number`: of the paper. - `what`: is compared. - `unit`: of it. - `ours`, `printed`.
    - `corrected`: right-hand side after the erratum `erratum`; None where the print is right.
    """

    number: int
    what: str
    unit: str
    ours: Callable[[Place], float]
    printed: Callable[[Place], float]
    corrected: Callable[[Place], float] | None = None
    erratum: str = ""
    says: str = ""


def _volume_rate(p: Place) -> float:
    """dV_oil/dt by differentiating the package's oil column along its own motion."""

    def column(flat: jax.Array) -> jax.Array:
        return p.rig.state(flat).column

    _, rate = jax.jvp(column, (jnp.asarray(STATE),), (jnp.asarray(p.rates),))
    return float(rate) * p["S_Pl"]


def _mass_rate(p: Place) -> float:
    """d(rho V)/dt of (4) along the package's motion, with (9) for the density [kg/s]."""
    density = p.numbers["oil_density"].si
    volume = p["S_Pl"] * p.column
    return density * (_volume_rate(p) + volume * p.rates[4] / p["k_oil"])


def _pressure_rate(p: Place) -> float:
    """(9) with the density's rate that (4) and (5) leave."""
    density = p.numbers["oil_density"].si
    volume = p["S_Pl"] * p.column
    mass_flow = density * FRACTION * p.flow(STATE[4])
    rate = (mass_flow - density * p["S_Pl"] * p.slip) / volume
    return p["k_oil"] / density * rate


def _eigenvalues(p: Place) -> float:
    """Least residual of (14) over the swinging eigenvalues of the package's rig."""
    scales = np.array(p.rig.scales)
    matrix = np.asarray(jacobian(p.rig, FREE, p.rig.column)) * scales / scales[:, None]
    rates = np.linalg.eigvals(matrix)
    omega_0 = ch.dimensionless(two_masses(p.values), p.mu).omega_0
    y = -1j * rates / omega_0
    return float(np.sort(np.abs(y[np.abs(y) > 1e-3]))[0])


def _printed_root(p: Place) -> float:
    scaled = ch.dimensionless(two_masses(p.values), p.mu)
    return float(np.sort(np.abs(ch.roots(scaled.epsilon, scaled.a1, scaled.a2)))[0])


def _frame(p: Place) -> float:
    """Displacement of the plunger in the frame by (15) [m]."""
    n = p.numbers
    return n["frame_load"].si * n["frame_length"].si / (2 * n["young_modulus"].si * section(n))


def _k_lc(p: Place) -> float:
    """(16) as printed."""
    n = p.numbers
    twice, load = 2 * n["young_modulus"].si * section(n), n["frame_load"].si
    return twice * load / (twice * n["frame_stroke"].si - n["frame_length"].si * load)


def _oil_in(column: Callable[[Place], float], modulus: str) -> Callable[[Place], float]:
    """Right-hand side of (21) with a length of the oil and what stands for its modulus."""

    def side(p: Place) -> float:
        front = p.numbers[modulus].si / (p["S_Pl"] * column(p))
        return front * (FRACTION * p.flow(STATE[4]) - p["S_Pl"] * p.slip)

    return side


def _stroke(_: Place) -> float:
    return STATE[2] - STATE[0]


def _plunger(sign: float) -> Callable[[Place], float]:
    """Right-hand side of (20) with a sign of friction."""
    return lambda p: p.forces[0] + sign * p.mu * p.slip + FORCE


def _cylinder(stretch: Callable[[Place], float]) -> Callable[[Place], float]:
    """Right-hand side of (19) with what the spring acts on."""
    return lambda p: -p["k_LC"] * stretch(p) - p.forces[0] + p.mu * p.slip


EQUATIONS: tuple[Equation, ...] = (
    Equation(2, "momentum of the cylinder", "N", lambda p: p.masses[0] * p.rates[1],
             lambda p: p.forces[2] - p.forces[0] - p.forces[1]),
    Equation(3, "momentum of plunger and plate", "N", lambda p: p.masses[1] * p.rates[3],
             lambda p: p.forces[0] + p.forces[1] + FORCE),
    Equation(4, "mass of the oil", "kg/s", _mass_rate,
             lambda p: FRACTION * p.numbers["oil_density"].si * p.flow(STATE[4])),
    Equation(5, "volume of the oil", "m^3/s", _volume_rate, lambda p: p["S_Pl"] * p.slip),
    Equation(6, "stroke that the sensor reads", "m",
             lambda p: float(readings(p.rig, jnp.asarray(STATE), FREE).stroke), _stroke),
    Equation(7, "velocity of the plunger", "m/s", lambda p: p.rates[2], lambda _: STATE[3]),
    Equation(8, "force in the load-cell end", "N", lambda p: p.load, lambda p: p.forces[2]),
    Equation(9, "rate of the oil pressure", "Pa/s", lambda p: p.rates[4], _pressure_rate),
    Equation(10, "momentum of the cylinder, no flow", "N", lambda p: p.masses[0] * p.free[1],
             _cylinder(lambda _: STATE[0])),
    Equation(11, "momentum of plunger and plate, no flow", "N",
             lambda p: p.masses[1] * p.free[3], lambda p: p.forces[0] - p.mu * p.slip),
    Equation(12, "rate of the oil pressure, no flow", "Pa/s", lambda p: p.free[4],
             lambda p: -p["k_oil"] / p["L_0"] * p.slip),
    Equation(13, "velocity of plunger against cylinder", "m/s",
             lambda p: p.free[2] - p.free[0], lambda p: p.slip),
    Equation(14, "modulus of the slow root at the μ of (17)", "1", _eigenvalues, _printed_root),
    Equation(15, "displacement of the plunger at 250 kN", "m",
             lambda p: p.numbers["frame_load"].si / p["k_frame"], _frame),
    Equation(16, "stiffness of the load-cell end", "N/m",
             lambda p: ch.load_cell_stiffness(
                 p.numbers["frame_load"].si, p.numbers["frame_stroke"].si, p["k_frame"]), _k_lc),
    Equation(17, "friction in the release", "N s/m",
             lambda p: ch.friction_from_decay(
                 p.masses[1], ch.dimensionless(two_masses(p.values), 0.0).omega_0,
                 p.numbers["release_divisor"].si / (2 * np.pi)),
             lambda p: p.masses[1] * np.sqrt(p["k_oil"] * p["S_Pl"] / (p["L_0"] * p.masses[1]))
             / p.numbers["release_divisor"].si),
    Equation(18, "oil pressure of A in free running at κ = 0.2 of the field test", "Pa",
             lambda p: free_run(p.numbers)["A"][1],
             lambda p: p.numbers["mu_A"].si * p.numbers["kappa_A"].si * p.flow(0.0)
             / p["S_Pl"] ** 2),
    Equation(19, "momentum of the cylinder", "N", lambda p: p.masses[0] * p.rates[1],
             _cylinder(lambda p: STATE[0] - _stroke(p)), _cylinder(lambda _: STATE[0]),
             "spring", "The spring acts on x_HC = x_Pl − x_SS, not on x_HC − x_SS."),
    Equation(20, "momentum of plunger and plate", "N", lambda p: p.masses[1] * p.rates[3],
             _plunger(1.0), _plunger(-1.0), "friction-sign",
             "Friction on the plunger has the opposite sign of that on the cylinder."),
    Equation(21, "rate of the oil pressure", "Pa/s", lambda p: p.rates[4],
             _oil_in(_stroke, "oil_density"),
             _oil_in(lambda p: p.column, "oil_bulk_modulus"), "modulus",
             "The factor is k_oil over the volume of the oil, not ρ_oil over S_Pl times the "
             "stroke."),
    Equation(22, "flow of the pump at 690 bar", "m^3/s", lambda p: _pump(p, 690e5),
             lambda p: p.flow(690e5)),
    Equation(23, "stiffness of the oil at the start", "N/m",
             lambda p: p["k_oil"] * p["S_Pl"] / p["L_0"],
             lambda p: p["k_oil"] * p["S_Pl"] / p.numbers["initial_stroke"].si,
             lambda p: two_masses(p.values).oil_stiffness, "column",
             "An oil column of 0.2 mm is 1000 times too stiff; most likely the 20 cm after "
             "(14) are meant."),
)  # fmt: skip


def _pump(p: Place, pressure: float) -> float:
    """Flow of the package's pump at full opening [m^3/s]."""
    flat = jnp.asarray((*STATE[:4], pressure))
    state = p.rig.state(flat)
    return float(sum(a.inflow for a in p.rig.actions(flat, state)))


def items(numbers: Numbers) -> list[Item]:
    """An item for each equation: `printed` is its right-hand side as printed."""
    here = place(numbers)
    return [_item(one, here) for one in EQUATIONS]


def _item(one: Equation, here: Place) -> Item:
    printed, ours = float(one.printed(here)), float(one.ours(here))
    explanation = None
    if one.corrected is not None:
        right = float(one.corrected(here))
        explanation = Explanation(one.erratum, one.says, printed, right, 1e-9 * abs(right))
    return Item(
        f"equation-{one.number}", f"eq. ({one.number})", one.what, one.unit, printed, ours,
        half_width=1e-12 * abs(printed), explanation=explanation,
        note="both sides at one state of the rig" if one.number < 14 else "",
    )  # fmt: skip

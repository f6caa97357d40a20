"""Figures 6, 8, 9, 10, 11 and 12 of the paper, simulated from the printed numbers.

The records behind them are not public. What the paper prints of a record (a load, a time, a flow
fraction) is taken from `data/paper/published.toml`; what it does not print and a simulation needs
is a choice, stands here as a constant, and is told on the page.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from rigid.effects import CATALOGUE
from rigid.effects.base import AbstractEffect
from rigid.physics.release import ring
from rigid.published.catalogue import TRANSFER
from rigid.published.walk.constants import Constants, nominal
from rigid.published.walk.equations import BASE, base_rig
from rigid.published.walk.numbers import Numbers
from rigid.published.walk.solving import History, Stretch, Trajectory, run

SOLVED = 12
"""Draws of the constants for which a figure is solved, beside the printed ones."""

FRAME_FLOWS = (0.02, 0.03, 0.045)
FRAME_SLACKS = (0.8e-3, 1.0e-3, 1.2e-3)
"""Flow fractions [1] and slack before full contact [m] of the three frame tests: ours. The paper
prints three tests and an offset of 1 mm."""

SHARES = {"A": 0.6, "B": 0.4}
"""Of the ice load by cylinder: ours. The paper prints that B has less."""

REOPENED = 30.0
"""s at which the valve of B is opened again: ours. The paper prints that it was shut at 25 s."""

ENDS = 60.0
"""s at which the simulated test ends: ours."""

FAILURE = 0.01
"""s in which the beam fails: ours, a sample of the logger."""

DROP_AT, DROP_IN, BACK_IN, DROP_ENDS = 1.0, 0.01, 0.5, 2.5
"""s: when the contact area drops, how fast, how fast it is back, end of the run: ours. The formula
of S_Ice(t) is missing in the text at hand."""


@dataclass(frozen=True, eq=False)
class Simulated:
    """All that the figures need of simulations.

    - `frame`: the three tests of Fig. 6. - `release`: (times [s], acceleration (draws, times)) by
      the label of its friction, Fig. 8. - `running`: Fig. 9, by cylinder.
    - `recorded`, `simulated`: Figs. 10 and 11, by cylinder: with the valve moved by hand, and as
      the paper simulates it. - `ice`: load [N] on the plate at `recorded` times, by cylinder.
    - `drops`: Fig. 12 by alpha. - `step`: largest |F_LC - F_Ice| [N] after one converter step.
    """

    frame: tuple[Trajectory, ...]
    release: dict[str, tuple[np.ndarray, np.ndarray]]
    running: dict[str, Trajectory]
    recorded: dict[str, Trajectory]
    simulated: dict[str, Trajectory]
    ice: dict[str, np.ndarray]
    drops: dict[float, Trajectory]
    drop_loads: dict[float, np.ndarray]
    step: float


Progress = Callable[[str], None]


def simulate(numbers: Numbers, drawn: Sequence[Constants], progress: Progress) -> Simulated:
    """Run all simulations.

    - `drawn`: draws of the constants; the first `SOLVED` are used.
    """
    few = [nominal(numbers), *drawn[:SOLVED]]
    progress("Fig. 6: three frame tests")
    frame = frame_tests(numbers, few)
    progress("Fig. 8: two releases")
    swung = releases(numbers, few)
    progress("Fig. 9: free running")
    running = {name: free_running(numbers, few, name) for name in SHARES}
    recorded, simulated, ice = {}, {}, {}
    for name in SHARES:
        progress(f"Figs. 10 and 11: field test, cylinder {name}")
        recorded[name], simulated[name], ice[name] = field_test(numbers, few, name)
    progress("Fig. 12: drops of the ice load")
    alphas = (0.0, *(numbers[f"drop_{i}"].si for i in (1, 2, 3)))
    fallen = {alpha: drop(numbers, few, alpha) for alpha in alphas}
    return Simulated(
        frame, swung, running, recorded, simulated, ice,
        {a: run for a, (run, _) in fallen.items()}, {a: load for a, (_, load) in fallen.items()},
        step_of_the_load(numbers),
    )  # fmt: skip


def _with(drawn: Sequence[Constants], **more: float) -> list[dict[str, float]]:
    return [{**one, **more} for one in drawn]


def _effects(*more: type[AbstractEffect]) -> tuple[type[AbstractEffect], ...]:
    return (*(CATALOGUE[name] for name in BASE), *more)


def frame_tests(numbers: Numbers, few: Sequence[Constants]) -> tuple[Trajectory, ...]:
    """Load against stroke in the frame, with slack before full contact."""
    out = []
    full = numbers["frame_load"].si
    for flow, slack in zip(FRAME_FLOWS, FRAME_SLACKS, strict=True):
        values = _with(few, mu=numbers["mu_A"].si, slack=slack)
        speed = flow * _full_flow(numbers) / numbers["pushing_area"].si
        one = few[0]
        travel = slack + full * (1 / one["k_LC"] + 1 / one["k_frame"])
        travel += full / (one["k_oil"] * one["S_Pl"] / one["L_0"])
        end = 1.02 * travel / speed
        times = np.linspace(0.0, end, 240)
        effects = _effects(CATALOGUE["seating-slack"])
        out.append(run(effects, values, [Stretch(end, flow, in_frame=True)], times))
    return tuple(out)


def _full_flow(numbers: Numbers) -> float:
    """q of (22) at low pressure [m^3/s]."""
    names = ("pump_flow_mean", "pump_flow_half_range")
    return sum(numbers[name].si for name in names) * numbers["pump_flow_unit"].si


def releases(
    numbers: Numbers, few: Sequence[Constants]
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Acceleration of the plate [m/s^2] at the accelerometer's rate, by friction."""
    interval = 1.0 / numbers["accelerometer_rate"].si
    samples = int(0.06 / interval) + 1
    time = interval * np.arange(samples)
    values = {name: jnp.asarray([one[name] for one in few]) for name in few[0]}
    out = {}
    for label, name in (("(17)", "mu_release"), ("(18), A", "mu_A")):
        rig = base_rig(values, jnp.full(len(few), numbers[name].si))
        swung = ring(rig, values["preload"][None], jnp.zeros((1, len(few))), interval, samples)
        out[label] = (time, np.asarray(swung)[:, 0].T)
    return out


def free_running(numbers: Numbers, few: Sequence[Constants], cylinder: str) -> Trajectory:
    """Stroke and pressure out of load at the friction of (18); the flow is borrowed."""
    kappa, friction = numbers[f"kappa_{cylinder}"].si, numbers[f"mu_{cylinder}"].si
    normal = np.random.default_rng(ord(cylinder)).standard_normal(len(few))
    factors = TRANSFER["catalogue"] ** np.where(np.arange(len(few)) == 0, 0.0, normal)
    values = [
        {**one, "mu": friction, "kappa_factor": float(factor)}
        for one, factor in zip(few, factors, strict=True)
    ]
    times = np.linspace(0.0, 10.0, 201)
    return run(_effects(), values, [Stretch(10.0, kappa)], times)


def ice_load(numbers: Numbers, cylinder: str) -> History:
    """Ice load [N] on one cylinder: up from 25 s to 50 s, then the beam fails."""
    begins, fails = numbers["contact_from"].si, numbers["contact_until"].si
    peak = SHARES[cylinder] * numbers["ice_strength"].si * numbers["contact_area"].si
    times = np.array([0.0, begins, fails, fails + FAILURE, ENDS])
    return times, np.array([0.0, 0.0, peak, 0.0, 0.0])


def field_test(
    numbers: Numbers, few: Sequence[Constants], cylinder: str
) -> tuple[Trajectory, Trajectory, np.ndarray]:
    """What the logger would have recorded, what the paper simulates, and the ice load [N]."""
    history = ice_load(numbers, cylinder)
    kappa, opens = numbers[f"kappa_{cylinder}"].si, numbers["valve_shut"].si
    fails = numbers["contact_until"].si
    times = np.unique([*np.linspace(0.0, ENDS, 301), fails, fails + FAILURE])
    effects = _effects()
    rng = np.random.default_rng([30, ord(cylinder)])
    low, high = numbers["mu_release"].si, numbers[f"mu_{cylinder}"].si
    frictions = np.exp(rng.uniform(np.log(low), np.log(high), len(few)))
    frictions[0] = low
    values = [{**one, "mu": float(mu)} for one, mu in zip(few, frictions, strict=True)]
    ends = (fails, fails + FAILURE, ENDS)
    constant = [Stretch(opens, kappa), *(Stretch(end, kappa) for end in ends)]
    by_hand = [Stretch(opens, kappa), Stretch(REOPENED, 0.0), *(Stretch(e, kappa) for e in ends)]
    simulated = run(effects, values, constant, times, history)
    moved = by_hand if cylinder == "B" else constant
    recorded = run(effects, values[:1], moved, times, history)
    return recorded, simulated, np.interp(times, *history)


def drop(numbers: Numbers, few: Sequence[Constants], alpha: float) -> tuple[Trajectory, np.ndarray]:
    """The rig under the whole ice load when a share `alpha` of the contact area is lost."""
    whole = numbers["ice_strength"].si * numbers["contact_area"].si
    knots = np.array([0.0, DROP_AT, DROP_AT + DROP_IN, DROP_AT + DROP_IN + BACK_IN, DROP_ENDS])
    loads = whole * np.array([1.0, 1.0, 1.0 - alpha, 1.0, 1.0])
    times = np.unique([*np.linspace(0.0, DROP_ENDS, 251), *knots])
    values = _with(few, mu=numbers["mu_release"].si)
    stretches = [Stretch(end, numbers["kappa_drop"].si) for end in knots[1:]]
    found = run(_effects(), values, stretches, times, (knots, loads))
    return found, np.interp(times, knots, loads)


def step_of_the_load(numbers: Numbers) -> float:
    """Largest |F_LC - F_Ice| [N] when the recorded load rises by one step within one sample."""
    sample, step = 1.0 / numbers["logger_rate"].si, numbers["load_step"].si
    knots = np.array([0.0, sample, 3 * sample])
    loads = np.array([0.0, step, step])
    times = np.linspace(0.0, 3 * sample, 601)
    values = _with([nominal(numbers)], mu=numbers["mu_release"].si)
    stretches = [Stretch(sample), Stretch(3 * sample)]
    found = run(_effects(), values, stretches, times, (knots, loads))
    return float(np.abs(found.load[0] - np.interp(times, knots, loads)).max())

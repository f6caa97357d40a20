"""Five machines simulated by SciPy, each from its own equations: nothing of the package is used.

Each function writes a table of what the sensors read into a file and returns the true numbers, by
the labels that the spec of the same name gives them.
"""

import itertools
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

LITRE_PER_MINUTE = 1e-3 / 60.0


def pump(pressure):
    """Flow of the pump of eq. (22) [m^3/s]."""
    return (6.645 - 4.965 * np.tanh(0.05e-5 * (pressure - 700e5))) * LITRE_PER_MINUTE


def solved(
    rates: Callable, start: np.ndarray, times: np.ndarray, kinks: tuple[float, ...] = (), oil=0
) -> np.ndarray:
    """States (times, n); no step passes over a kink. The last `oil` states are pressures [Pa]."""
    bounds = [times[0], *(k for k in kinks if times[0] < k < times[-1]), times[-1]]
    state, rows = np.asarray(start, float), [np.asarray(start, float)]
    sizes = np.array([1e-12] * (len(start) - oil) + [1e-1] * oil)
    for begin, end in itertools.pairwise(bounds):
        inside = times[(times > begin) & (times <= end)]
        asked = np.union1d(inside, [end])
        found = solve_ivp(
            rates, (begin, end), state, "Radau", asked, rtol=1e-9, atol=sizes, max_step=0.02
        )
        assert found.success, found.message
        rows += [found.y[:, i] for i, t in enumerate(asked) if t in inside]
        state = found.y[:, -1]
    return np.array(rows)


def written(path: Path, seed: int, columns: dict[str, tuple[np.ndarray, float]]) -> None:
    """Write columns, each with white noise of its own sd."""
    rng = np.random.default_rng(seed)
    rows = [values + sd * rng.standard_normal(len(values)) for values, sd in columns.values()]
    header = ",".join(columns)
    np.savetxt(path, np.column_stack(rows), "%.9g", ",", header=header, comments="")


def press(path: Path, seed: int = 1) -> dict[str, float]:
    """A press with one cylinder, whose rod side is full of oil and shut in."""
    mass, stiffness, friction, bulk, kappa = 180.0, 3.0e7, 4.0e4, 1.6e9, 0.22
    head, rod, opened, shut = 5e-3, 3e-3, 0.2, 1.7

    def rates(t, y):
        x, v, p, r = y
        inflow = kappa * pump(p) if opened <= t < shut else 0.0
        return (
            v,
            (head * p - rod * r - stiffness * x - friction * v) / mass,
            bulk * (inflow - head * v) / (head * (0.15 + x)),
            bulk * rod * v / (rod * (0.25 - x)),
        )

    t = 0.01 * np.arange(300)
    x, _, p, r = solved(rates, np.zeros(4), t, (opened, shut), 2).T
    written(path, seed, {
        "t": (t, 0.0), "x": (1e3 * x, 2e-3), "p_head": (1e-5 * p, 0.1), "p_rod": (1e-5 * r, 0.1),
        "F": (1e-3 * stiffness * x, 0.05),
    })  # fmt: skip
    return {
        "k_spring[workpiece]": stiffness,
        "mu[head]": friction,
        "k_oil": bulk,
        "kappa[squeeze,head]": kappa,
    }


CORNERS = ((0.4, 0.3), (-0.4, 0.3), (-0.4, -0.3), (0.4, -0.3))


def table(path: Path, seed: int = 1) -> dict[str, float]:
    """Four cylinders under one plate, which tilts: a specimen off its middle resists."""
    mass, jx, jy, friction, bulk, area = 420.0, 28.0, 36.0, 6.0e4, 1.7e9, 2e-3
    stiffness, place = 1.2e7, (0.12, -0.07)
    kappas = np.array([0.100, 0.103, 0.098, 0.102])
    opened, shut = 0.15, 1.2
    at = np.array(CORNERS)

    def rates(t, y):
        z, a, b = y[:3]  # heave, tilt about x, tilt about y
        ends = z + a * at[:, 1] - b * at[:, 0]
        speeds = y[3] + y[4] * at[:, 1] - y[5] * at[:, 0]
        pressures = y[6:]
        push = area * pressures - friction * speeds
        resist = stiffness * (z + a * place[1] - b * place[0])
        inflow = kappas * pump(pressures) if opened <= t < shut else 0.0
        return np.concatenate((
            y[3:6],
            [
                (push.sum() - resist) / mass,
                ((push * at[:, 1]).sum() - resist * place[1]) / jx,
                (-(push * at[:, 0]).sum() + resist * place[0]) / jy,
            ],
            bulk * (inflow - area * speeds) / (area * (0.12 + ends)),
        ))  # fmt: skip

    t = 0.01 * np.arange(240)
    y = solved(rates, np.zeros(10), t, (opened, shut), 4)
    ends = y[:, :1] + y[:, 1:2] * at[:, 1] - y[:, 2:3] * at[:, 0]
    columns = {"t": (t, 0.0)}
    for i in range(4):
        columns[f"x{i + 1}"] = (1e3 * ends[:, i], 2e-3)
        columns[f"p{i + 1}"] = (1e-5 * y[:, 6 + i], 0.05)
    written(path, seed, columns)
    numbers = {f"kappa[lift,c{i + 1}]": float(k) for i, k in enumerate(kappas)}
    return numbers | {"mu": friction, "k_oil": bulk, "k_spring[specimen]": stiffness}


SUPPLY = 210e5
"""Of the shaker [Pa]; at rest both chambers are at half of it."""


def shaker(path: Path, seed: int = 1) -> dict[str, float]:
    """A servo-hydraulic shaker: two chambers, a valve whose command was recorded."""
    mass, friction, bulk, area, gain = 85.0, 9.0e3, 1.3e9, 1.5e-3, 2.4e-7
    t = 1e-3 * np.arange(1500)
    sweep = 3.0 * t + 0.5 * (25.0 - 3.0) / t[-1] * t**2
    command = 0.25 * np.sin(2 * np.pi * sweep)

    def orifice(u, p):
        """Flow into a chamber that stands p over its rest."""
        return gain * u * np.sqrt(0.5 * SUPPLY - p if u > 0.0 else 0.5 * SUPPLY + p)

    def rates(now, y):
        x, v, p, r = y
        u = np.interp(now, t, command)
        return (
            v,
            (area * (p - r) - friction * v) / mass,
            bulk * (orifice(u, p) - area * v) / (area * (0.05 + x)),
            bulk * (orifice(-u, r) + area * v) / (area * (0.05 - x)),
        )

    y = solved(rates, np.zeros(4), t, oil=2)
    moved = np.array([rates(a, b)[1] for a, b in zip(t, y, strict=True)])
    written(path, seed, {
        "t": (t, 0.0), "u": (command, 0.0), "minus_u": (-command, 0.0), "x": (1e3 * y[:, 0], 0.02),
        "a": (moved, 0.2), "p": (1e-5 * y[:, 2], 0.1), "r": (1e-5 * y[:, 3], 0.1),
    })  # fmt: skip
    return {"K_valve": gain, "k_oil": bulk, "mu[head]": friction}


def swing(
    path: Path,
    seed: int = 1,
    dry: float = 0.0,
    extra: Callable[[float, float], float] = lambda x, v: 0.0,  # noqa: ARG005
) -> dict[str, float]:
    """One body on a spring, let go and left to itself: its position is all that is read.

    - `dry` [N]: of its friction that does not go with speed, of bristles that bend by 20 um (Dahl).
    - `extra`: one more force [N] on the body, of its place [m] and speed [m/s].
    """
    mass, stiffness, friction, begun = 1.2, 900.0, 0.7, (0.031, -0.2)

    bent = 20e-6

    def rates(_, y):
        push = stiffness * y[0] + friction * y[1] + dry * y[2] / bent
        return y[1], (extra(y[0], y[1]) - push) / mass, y[1] - abs(y[1]) * y[2] / bent

    t = 0.01 * np.arange(600)
    y = solved(rates, np.array([*begun, 0.0]), t)
    written(path, seed, {"t": (t, 0.0), "x": (1e3 * y[:, 0], 0.05)})
    return {
        "k_spring[spring]": stiffness,
        "mu[spring]": friction,
        "x_start[decay,body]": begun[0],
        "v_start[decay,body]": begun[1],
    }


def hanging(path: Path, seed: int = 1) -> dict[str, float]:
    """A rig on a rope, its root free, is struck: force and accelerations are read."""
    root, barrel, plate, rope = 170.0, 52.0, 110.0, 2.5e5
    stiffness, bulk, area, column, friction = 6.2e7, 1.9e9, 44.2e-4, 0.2, 3.0e4
    t = 5e-4 * np.arange(800)
    blow = 4.0e3 * np.exp(-(((t - 0.02) / 0.003) ** 2))
    blow[0] = 0.0

    def rates(now, y):
        x, b, q = y[:3]
        force = np.interp(now, t, blow)
        cell, oil = stiffness * (b - x), area * y[6] - friction * (y[5] - y[4])
        return (
            *y[3:6],
            (cell - rope * x) / root,
            (-cell - oil) / barrel,
            (oil + force) / plate,
            -bulk * (y[5] - y[4]) / (column + q - b),
        )

    y = solved(rates, np.zeros(7), t, oil=1)
    moved = np.array([rates(a, b)[3:6] for a, b in zip(t, y, strict=True)])
    written(path, seed, {
        "t": (t, 0.0), "blow": (blow, 0.0), "a_plate": (moved[:, 2], 0.3),
        "a_root": (moved[:, 0], 0.3), "F": (1e-3 * stiffness * (y[:, 0] - y[:, 1]), 0.02),
    })  # fmt: skip
    return {
        "k_spring[cell]": stiffness,
        "k_oil[ram]": bulk,
        "mu[ram]": friction,
        "k_spring[rope]": rope,
    }


MACHINES = {one.__name__: one for one in (press, table, shaker, swing, hanging)}

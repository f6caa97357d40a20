"""Tests of the five machines under loads that their specs do not know, simulated by SciPy.

As in `simulated`, each function writes what the sensors read into a file, from equations of its
own; it returns the load at the file's instants, compression positive.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from machines.simulated import CORNERS, SUPPLY, pump, solved, written

FALLS_IN = 4e-3
"""Seconds in which a specimen gives way."""


def left(t: float, breaks: float, lost: float) -> float:
    """The share of its stiffness that a specimen has: `lost` of it goes from `breaks` on."""
    return 1.0 - lost * min(max((t - breaks) / FALLS_IN, 0.0), 1.0)


def press(path: Path, seed: int = 1) -> np.ndarray:
    """The press on a specimen that loses four tenths of its stiffness; no load cell reads it."""
    mass, stiffness, friction, bulk, kappa = 180.0, 3.0e7, 4.0e4, 1.6e9, 0.3
    head, rod, opened, shut, breaks = 5e-3, 3e-3, 0.2, 1.9, 1.403

    def load(t, x):
        return stiffness * x * left(t, breaks, 0.4)

    def rates(t, y):
        x, v, p, r = y
        inflow = kappa * pump(p) if opened <= t < shut else 0.0
        return (
            v,
            (head * p - rod * r - load(t, x) - friction * v) / mass,
            bulk * (inflow - head * v) / (head * (0.15 + x)),
            bulk * rod * v / (rod * (0.25 - x)),
        )

    t = 0.01 * np.arange(300)
    x, _, p, r = solved(rates, np.zeros(4), t, (opened, breaks, breaks + FALLS_IN, shut), 2).T
    written(path, seed, {
        "t": (t, 0.0), "x": (1e3 * x, 2e-3), "p_head": (1e-5 * p, 0.1), "p_rod": (1e-5 * r, 0.1),
    })  # fmt: skip
    return np.array([load(*at) for at in zip(t, x, strict=True)])


def table(path: Path, seed: int = 1) -> np.ndarray:
    """Four cylinders under one plate that tilts; a specimen off its middle breaks in part."""
    mass, jx, jy, friction, bulk, area = 420.0, 28.0, 36.0, 6.0e4, 1.7e9, 2e-3
    stiffness, place = 1.2e7, (0.12, -0.07)
    kappas = np.array([0.14, 0.15, 0.13, 0.14])
    opened, shut, breaks = 0.15, 1.6, 1.107
    at = np.array(CORNERS)

    def load(t, y):
        return stiffness * (y[0] + y[1] * place[1] - y[2] * place[0]) * left(t, breaks, 0.3)

    def rates(t, y):
        ends = y[0] + y[1] * at[:, 1] - y[2] * at[:, 0]
        speeds = y[3] + y[4] * at[:, 1] - y[5] * at[:, 0]
        push, resist = area * y[6:] - friction * speeds, load(t, y)
        inflow = kappas * pump(y[6:]) if opened <= t < shut else 0.0
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
    y = solved(rates, np.zeros(10), t, (opened, breaks, breaks + FALLS_IN, shut), 4)
    ends = y[:, :1] + y[:, 1:2] * at[:, 1] - y[:, 2:3] * at[:, 0]
    columns = {"t": (t, 0.0)}
    for i in range(4):
        columns[f"x{i + 1}"] = (1e3 * ends[:, i], 2e-3)
        columns[f"p{i + 1}"] = (1e-5 * y[:, 6 + i], 0.05)
    written(path, seed, columns)
    return np.array([load(*one) for one in zip(t, y, strict=True)])


def shaker(path: Path, seed: int = 1) -> np.ndarray:
    """The shaker against a specimen with dry friction and a spring, its command recorded."""
    mass, friction, bulk, area, gain = 85.0, 9.0e3, 1.3e9, 1.5e-3, 2.4e-7
    stiffness, slides, bent = 2.0e5, 800.0, 2e-4
    t = 1e-3 * np.arange(1500)
    sweep = 3.0 * t + 0.5 * (25.0 - 3.0) / t[-1] * t**2
    command = 0.25 * np.sin(2 * np.pi * sweep)

    def orifice(u, p):
        return gain * u * np.sqrt(0.5 * SUPPLY - p if u > 0.0 else 0.5 * SUPPLY + p)

    def rates(now, y):
        x, v, p, r, z = y
        u = np.interp(now, t, command)
        return (
            v,
            (area * (p - r) - friction * v - stiffness * x - slides * z / bent) / mass,
            bulk * (orifice(u, p) - area * v) / (area * (0.05 + x)),
            bulk * (orifice(-u, r) + area * v) / (area * (0.05 - x)),
            v - abs(v) * z / bent,
        )

    # The last state is how far a bristle bends; the pressures stand before it.
    y = solved(rates, np.zeros(5), t, oil=0)
    moved = np.array([rates(a, b)[1] for a, b in zip(t, y, strict=True)])
    written(path, seed, {
        "t": (t, 0.0), "u": (command, 0.0), "minus_u": (-command, 0.0), "x": (1e3 * y[:, 0], 0.02),
        "a": (moved, 0.2), "p": (1e-5 * y[:, 2], 0.1), "r": (1e-5 * y[:, 3], 0.1),
    })  # fmt: skip
    return stiffness * y[:, 0] + slides * y[:, 4] / bent


def swing(path: Path, seed: int = 1) -> np.ndarray:
    """The body on a spring, at rest until something leans on it and lets go at once."""
    mass, stiffness, friction = 1.2, 900.0, 0.7
    leans, lets_go = 0.5, 2.0

    def load(t):
        return 20.0 * min(max((t - leans) / 1.0, 0.0), 1.0) if t < lets_go else 0.0

    def rates(t, y):
        return y[1], (-load(t) - stiffness * y[0] - friction * y[1]) / mass

    t = 0.01 * np.arange(500)
    y = solved(rates, np.zeros(2), t, (leans, leans + 1.0, lets_go))
    written(path, seed, {"t": (t, 0.0), "x": (1e3 * y[:, 0], 0.05)})
    return np.array([load(one) for one in t])


def hanging(path: Path, seed: int = 1) -> np.ndarray:
    """The rig on a rope is struck, and nothing reads the blow."""
    root, barrel, plate, rope = 170.0, 52.0, 110.0, 2.5e5
    stiffness, bulk, area, column, friction = 6.2e7, 1.9e9, 44.2e-4, 0.2, 3.0e4
    t = 5e-4 * np.arange(800)

    def load(now):
        return -4.0e3 * np.exp(-(((now - 0.05) / 0.003) ** 2))

    def rates(now, y):
        x, b, q = y[:3]
        cell, oil = stiffness * (b - x), area * y[6] - friction * (y[5] - y[4])
        return (
            *y[3:6],
            (cell - rope * x) / root,
            (-cell - oil) / barrel,
            (oil - load(now)) / plate,
            -bulk * (y[5] - y[4]) / (column + q - b),
        )

    y = solved(rates, np.zeros(7), t, oil=1)
    moved = np.array([rates(a, b)[3:6] for a, b in zip(t, y, strict=True)])
    written(path, seed, {
        "t": (t, 0.0), "a_plate": (moved[:, 2], 0.3),
        "a_root": (moved[:, 0], 0.3), "F": (1e-3 * stiffness * (y[:, 0] - y[:, 1]), 0.02),
    })  # fmt: skip
    return np.array([load(one) for one in t])


LOADS: dict[str, Callable[[Path, int], np.ndarray]] = {
    one.__name__: one for one in (press, table, shaker, swing, hanging)
}

"""What is missing from the model of a measured motion, found on simulated oscillators.

A mass on a spring is driven by a force of many frequencies; SciPy integrates it, and force and
position have white noise. What is hidden: a cubic spring, a force that is late, or nothing.
"""

import json
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rigid.discovery.unmodelled.base import Bumps
from rigid.discovery.unmodelled.inputs import Input
from rigid.discovery.unmodelled.sensors import SensorError, bent
from rigid.localfit.motions import courses, followed, held_against
from rigid.study.study import Study, load

MASS, DRAG, STIFFNESS, CUBIC, LATE = 10.0, 20.0, 9e3, 4e6, 6e-3
RATE, LASTS = 400.0, 20.0
SPEC = """
title = "Oscillator"
simulated = true

[model]
body = "mass"
effects = ["viscous-friction", "joint-spring"]
{candidates}

[priors]
M_Pl = {{ lognormal = {{ median = 10.0, factor = 1.5 }} }}
mu = {{ lognormal = {{ median = 20.0, factor = 10.0 }} }}
k_spring = {{ lognormal = {{ median = 9e3, factor = 3.0 }} }}

[sensors]
force = {{ noise = 0.12, gain_sd = 0.01, zero_sd = 0.5 }}

[[records]]
name = "shaken"
kind = "motion"
file = "shaken.csv"
corner = 20.0
[records.channels]
time = {{ column = "t", unit = "s" }}
position = {{ column = "x", unit = "m" }}
force = {{ column = "F", unit = "N" }}
"""


@lru_cache
def driven(cubic: float) -> np.ndarray:
    """Time, position and force (3, samples), without noise."""
    rng = np.random.default_rng(5)
    t = np.arange(0.0, LASTS, 1.0 / RATE)
    f = np.arange(0.5, 12.0, 0.2)
    angle = rng.uniform(0.0, 2.0 * np.pi, len(f))

    def force(time):
        return 9.0 * np.sum(np.sin(2.0 * np.pi * f * np.asarray(time)[..., None] + angle), axis=-1)

    def rates(time, y):
        spring = STIFFNESS * y[0] + cubic * y[0] ** 3
        return [y[1], (force(time) - DRAG * y[1] - spring) / MASS]

    found = solve_ivp(rates, (0.0, t[-1]), [0.0, 0.0], t_eval=t, rtol=1e-9, atol=1e-11)
    return np.stack([t, found.y[0], force(t)])


def oscillator(
    folder: Path, *, cubic: float = 0.0, late: float = 0.0, candidates: str = ""
) -> Study:
    rng = np.random.default_rng(6)
    t, x, force = driven(cubic)
    x = x + 2e-6 * rng.standard_normal(len(t))
    force = np.interp(t - late, t, force) + 0.3 * rng.standard_normal(len(t))
    rows = [f"{a:.4f},{b:.9f},{c:.5f}" for a, b, c in zip(t, x, force, strict=True)]
    (folder / "shaken.csv").write_text("\n".join(["t,x,F", *rows]) + "\n", "utf-8")
    (folder / "shaken.toml").write_text(SPEC.format(candidates=candidates), "utf-8")
    return load(folder / "shaken.toml")


def told(study: Study, folder: Path) -> dict:
    found = study.discover(folder / "out", quiet=True)
    assert found.outcome.verdict
    return json.loads((folder / "out" / "discovery.json").read_text("utf-8"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hidden", "name", "label", "true"),
    [
        ({"cubic": CUBIC}, "spring-hardening", "k_cubic", CUBIC),
        ({"late": LATE}, "force-clock-offset", "force_delay", LATE),
    ],
)
def test_what_is_missing_is_named_and_has_its_size(tmp_path, hidden, name, label, true):
    found = told(oscillator(tmp_path, **hidden), tmp_path)
    assert found["verdict"] == "named"
    step = found["steps"][0]
    assert step["effect"] == name
    assert step["probability"] > 0.8
    assert step["parameters"][label]["median"] == pytest.approx(true, rel=0.03)
    assert step["gap"]["after"] < 0.2 * step["gap"]["before"]
    assert {"M_Pl", "mu", "k_spring"} <= set(step["moved"])


@pytest.mark.slow
def test_nothing_is_missing_from_a_weakly_damped_swing(tmp_path):
    """Its expected force carries the noise of an acceleration, which no sensor's error explains."""
    found = told(oscillator(tmp_path), tmp_path)
    assert found["verdict"] == "nothing-missing"
    assert found["gap"]["initial"] < 1.5


@pytest.mark.slow
def test_what_no_candidate_is_comes_out_as_a_force_over_position(tmp_path):
    study = oscillator(tmp_path, cubic=CUBIC, candidates='candidates = ["coulomb-friction"]')
    found = study.discover(tmp_path / "out", quiet=True).outcome
    assert found.verdict == "unnamed"
    step = found.steps[0]
    assert step.equation == "plunger-momentum"  # told as mass-momentum
    assert step.hidden is not None
    hidden = step.hidden.hidden
    assert isinstance(hidden, Input)
    assert (hidden.kind, hidden.variable) == ("force", "stroke")
    shown = hidden.shown(step.hidden)
    # Up to a line, which the spring that is there takes up, it is the force of the cubic spring.
    missing = -CUBIC * shown.place**3
    line = np.polyfit(shown.place, shown.mean - missing, 1)
    left = shown.mean - missing - np.polyval(line, shown.place)
    assert np.std(left) < 0.1 * np.std(missing)


def test_a_motion_is_followed_by_what_was_measured_of_it(tmp_path):
    problem = oscillator(tmp_path).problem
    (course,) = courses(problem)
    t, x, _ = driven(0.0)
    at = np.linspace(2.0, 18.0, 100)
    found = followed(course, at)
    assert set(found) == {"position", "speed"}  # no pressure was read
    np.testing.assert_allclose(found["position"], np.interp(at, t, x), atol=2e-4)
    np.testing.assert_allclose(
        found["speed"], np.interp(at, t, np.gradient(x, t)), atol=0.02 * np.ptp(found["speed"])
    )


def test_a_gain_is_no_distortion():
    """A straight part of a distortion would be the gain, with which mass and springs grow."""
    rng = np.random.default_rng(3)
    values = rng.standard_normal(400)
    centres = np.linspace(values.min(), values.max(), 6)
    width = centres[1] - centres[0]
    columns = np.maximum(0.0, 1.0 - np.abs(values[:, None] - centres) / width)
    rows = np.arange(400) < 300
    target = (SensorError("force", "reading"),) * 6
    found = bent(Bumps(columns, target, centres), values, rows).columns
    np.testing.assert_allclose(found[rows].T @ values[rows], 0.0, atol=1e-9)
    np.testing.assert_allclose(found[rows].sum(axis=0), 0.0, atol=1e-9)
    np.testing.assert_array_equal(found[~rows], columns[~rows])
    # What bends stays: a saturation is hardly shortened.
    heights = np.clip(centres, -0.5, 0.5)
    assert np.linalg.norm(found[rows] @ heights) > 0.1 * np.linalg.norm(columns[rows] @ heights)


@pytest.mark.slow
def test_a_sensor_of_a_motion_errs_over_what_it_read(tmp_path):
    study = oscillator(tmp_path)
    found = study.discover(tmp_path / "out", quiet=True).outcome
    local = found.base
    read = held_against(local)
    np.testing.assert_allclose(read, local.reading + local.residual)
    assert not np.allclose(read, local.reading)

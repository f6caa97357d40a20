"""Measured motions: filters, the force along them, and a simulated machine found again."""

import dataclasses
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import rigid
from rigid.effects import CATALOGUE
from rigid.friction.models import place_of
from rigid.inference.derived import values_of
from rigid.inference.posterior import load_posterior
from rigid.inference.search import search
from rigid.io.errors import InputError
from rigid.likelihood.assemble import assemble
from rigid.likelihood.groups import MotionGroup
from rigid.likelihood.motion import NODES, SMOOTHER, STRIDE, TAPS, lay
from rigid.likelihood.sizes import usual_of
from rigid.likelihood.tracks import make_track
from rigid.physics import inverse
from rigid.physics.rig import acting
from rigid.records.read import read_records
from rigid.records.record import Channel, Record
from rigid.spec import find_spec, load_spec
from rigid.spec.machine import UsualSpec
from rigid.study.study import load

ROOT = Path(rigid.__file__).parents[1]
PUSHING = {
    "viscous-friction",
    "coulomb-friction",
    "stribeck-friction",
    "lugre-friction",
    "frequency-dependent-friction",
    "pressure-dependent-friction",
    "constant-force",
    "direction-dependent-viscosity",
}
CORNER = 10.0


def record(time: np.ndarray, corner: float = CORNER, **series: np.ndarray) -> Record:
    given = {"force": np.zeros(len(time))} | series
    channels = {q: Channel(q, v, np.isfinite(v), q, "SI") for q, v in given.items()}
    steps = np.diff(time)
    uniform = bool(np.ptp(steps) < 1e-9)
    return Record(
        "one", "motion", "A", Path("one.csv"), "0", time, channels, (), None, None,
        float(np.median(steps)), uniform, corner=corner,
    )  # fmt: skip


def alone(along: inverse.Along) -> inverse.Along:
    return inverse.together([along])


def by_hand(time: np.ndarray, position: np.ndarray, **more: np.ndarray) -> inverse.Along:
    """Nodes of a motion whose derivatives are known; the low-pass lets everything pass."""
    given = {"velocity": 0.0, "acceleration": 0.0, "pressure": 0.0} | more
    columns = {k: np.broadcast_to(v, position.shape) for k, v in given.items()}
    return inverse.Along(
        position=position, **columns, first=time[0], kernel=np.ones(1),
        interval=float(time[1] - time[0]), stride=1,
    )  # fmt: skip


def built(*names: str, **values: float):
    wide = {
        k.replace("_1", "[1]").replace("_2", "[2]"): jnp.asarray([v]) for k, v in values.items()
    }
    return tuple(CATALOGUE[name].build(wide) for name in names)


def force(effects, along, mass: float = 0.0, area: float = 0.0) -> np.ndarray:
    body = inverse.Body(*(jnp.asarray([x]) for x in (mass, area)), effects)
    return np.asarray(inverse.force(body, alone(along)))[:, 0, 0]


def test_only_what_pushes_the_body_acts_in_a_motion():
    found = acting(tuple(CATALOGUE.values()), "motion")
    assert {e.name for e in found} >= PUSHING
    assert {e.name for e in found if e.equation != "plunger-momentum"} == {"force-clock-offset"}
    assert "return-spring" not in {e.name for e in found}  # acts on the rig alone
    for kind in ("frame", "free-run", "field", "release"):
        named = {kind} if kind == "release" else {kind, "slow"}
        allowed = {e.name for e in CATALOGUE.values() if e.kinds is None or named & set(e.kinds)}
        assert {e.name for e in acting(tuple(CATALOGUE.values()), kind)} == allowed


# Filters


def test_a_slow_motion_comes_out_with_its_derivatives():
    """At a tenth of the corner the filter lets 1/(1 + (f/2c)^4) pass: 6.25e-6 are lost."""
    time, frequency = 3.0 + 5e-3 * np.arange(2000), 0.1 * CORNER
    omega = 2 * np.pi * frequency
    lost = (frequency / (SMOOTHER * CORNER)) ** 4
    laid = lay(record(time, position=np.sin(omega * (time - 3.0))))
    along = laid.along
    at = along.interval * np.arange(len(along.position))
    inside = slice(120, -120)  # a second: beyond, the filter has forgotten the ends
    for got, expected, scale in (
        (along.position, np.sin(omega * at), 1.0),
        (along.velocity, omega * np.cos(omega * at), omega),
        (along.acceleration, -(omega**2) * np.sin(omega * at), omega**2),
    ):
        error = np.abs(np.asarray(got) - expected)[inside].max() / scale
        assert 0.5 * lost < error < 1.5 * lost
    assert laid.interval == pytest.approx(STRIDE / (NODES * CORNER))
    assert laid.first == pytest.approx(3.0 + TAPS // 2 * along.interval)
    assert len(laid.force) == 1 + (len(along.position) - TAPS) // STRIDE
    assert np.all(laid.weight == 1.0)


@pytest.mark.slow
def test_force_and_what_the_model_says_of_it_go_through_the_same_low_pass():
    """A force above the corner is gone, one below it stays; the model's side does the same."""
    time = 5e-3 * np.arange(2000)
    slow, fast = (np.sin(2 * np.pi * f * time) for f in (0.3 * CORNER, 1.6 * CORNER))
    laid = lay(record(time, position=slow, force=slow + fast))
    at = laid.first + laid.interval * np.arange(len(laid.force))
    inside = slice(20, -20)
    left = laid.force - np.sin(2 * np.pi * 0.3 * CORNER * at)
    # Stop band of a Hamming window: 0.0022; the Butterworth filter takes 5e-4 of the slow part.
    assert np.abs(left)[inside].max() < 4e-3
    again = inverse.filtered(jnp.asarray(laid.along.position), laid.along.kernel, STRIDE)
    # The low-pass once more on what was slow already, by the same weights.
    np.testing.assert_allclose(np.asarray(again)[inside], (laid.force)[inside], atol=4e-3)


def test_uneven_samples_are_interpolated():
    """A linear chord is off by (omega dt)^2/8 at most; the filter averages that."""
    rng = np.random.default_rng(1)
    time = np.cumsum(np.where(rng.random(4000) < 0.1, 8e-3, 5e-3))
    omega = 2 * np.pi
    laid = lay(record(time, position=np.sin(omega * time)))
    at = time[0] + laid.along.interval * np.arange(len(laid.along.position))
    error = np.abs(np.asarray(laid.along.position) - np.sin(omega * at))[120:-120].max()
    assert error < (omega * 8e-3) ** 2 / 8 + (0.05) ** 4


def test_samples_whose_filter_reaches_into_a_gap_have_no_weight():
    time = 5e-3 * np.arange(4000)
    kept = (time < 9.0) | (time > 9.3)
    laid = lay(record(time[kept], position=np.sin(time[kept])))
    at = laid.first + laid.interval * np.arange(len(laid.force))
    half = TAPS // 2 / (NODES * CORNER)
    inside = (at > 9.0 - half - 5e-3) & (at < 9.3 + half + 5e-3)
    assert np.all(laid.weight[~inside] == 1.0)
    assert np.all(laid.weight[(at > 9.0 - half + 5e-3) & (at < 9.3 + half - 5e-3)] == 0.0)


def test_a_missing_force_counts_as_a_gap():
    time = 5e-3 * np.arange(4000)
    read = np.where((time > 9.0) & (time < 9.3), np.nan, 1.0)
    laid = lay(record(time, position=np.sin(time), force=read))
    at = laid.first + laid.interval * np.arange(len(laid.force))
    assert laid.weight[np.argmin(abs(at - 9.15))] == 0.0
    assert np.all(np.isfinite(laid.force))


def test_a_corner_too_high_and_a_record_too_short_are_refused():
    time = 5e-3 * np.arange(2000)
    with pytest.raises(InputError, match=r"corner is 41 Hz; samples 0.005 s apart allow 40 Hz"):
        lay(record(time, corner=41.0, position=time))
    least = (TAPS + STRIDE * 20) / (NODES * CORNER)
    short = time[time < least - 0.1]
    with pytest.raises(InputError, match="needed: record for longer, or raise the corner"):
        lay(record(short, position=short))


# The force


def test_the_balance_of_forces_is_that_of_the_document():
    time = 0.01 * np.arange(300)
    x, v, a = np.sin(2 * time), 2 * np.cos(2 * time), -4 * np.sin(2 * time)
    p = 1e5 * (1.0 + 0.1 * np.cos(time))
    along = by_hand(time, x, velocity=v, acceleration=a, pressure=p)
    effects = built("viscous-friction", "constant-force", mu=7.0, F_constant=3.0)
    got = force(effects, along, mass=5.0, area=1e-3)
    np.testing.assert_allclose(got, 5.0 * a + 7.0 * v - 1e-3 * p - 3.0, rtol=1e-12)
    np.testing.assert_allclose(force((), along, mass=5.0), 5.0 * a, rtol=1e-12)


def test_a_bristle_bends_and_slides_as_its_closed_form():
    """Along a way d one way, 1 - s falls by exp(-d/z), whatever the steps; |v| is rounded by
    1e-7 m/s against 5e-3 m/s."""
    time = 1e-3 * np.arange(41)
    x = 5e-3 * np.where(time < 0.02, time, 0.04 - time)
    got = force(built("coulomb-friction", F_C=20.0, presliding=PRESLIDING), by_hand(time, x))
    there = 20.0 * (1.0 - np.exp(-x[:21] / PRESLIDING))
    np.testing.assert_allclose(got[:21], there, rtol=1e-4, atol=1e-12)
    back = -20.0 + (there[-1] + 20.0) * np.exp(-(x[20] - x[20:]) / PRESLIDING)
    np.testing.assert_allclose(got[20:], back, rtol=1e-4, atol=1e-3)


def test_friction_of_a_seal_grows_with_pressure():
    time = 1e-3 * np.arange(400)
    pressure = np.linspace(1e5, 7e5, 400)
    along = by_hand(time, 0.02 * time, velocity=0.02, pressure=pressure)
    got = force(built("pressure-dependent-friction", c_seal=5e-6, presliding_seal=2e-5), along)
    # Below 1e4 Pa the seal sets in; above, log(1 + exp(-p/1e4)) < 5e-5 and log 2 are what is less.
    np.testing.assert_allclose(got[20:], 5e-6 * (pressure[20:] - 1e4 * np.log(2)), rtol=2e-5)


def test_without_pressure_a_seal_leaves_no_trace_at_all():
    """Not even a rounded one, which a score test would take for a huge coefficient."""
    time = 1e-3 * np.arange(400)
    along = by_hand(time, 0.02 * np.sin(20 * time))
    np.testing.assert_array_equal(
        force(built("pressure-dependent-friction", c_seal=1.0, presliding_seal=2e-5), along), 0.0
    )


def test_branches_with_memory_load_as_their_closed_form():
    time = 0.02 * np.arange(100)
    names = {"mu_branch_1": 300.0, "mu_branch_2": 50.0, "tau_branch_1": 0.2, "tau_branch_2": 0.01}
    got = force(built("frequency-dependent-friction", **names), by_hand(time, 0.1 * time))
    expected = 30.0 * (1 - np.exp(-time / 0.2)) + 5.0 * (1 - np.exp(-time / 0.01))
    np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("lag", [0.3, -0.3, 2.0, 7.6, -1.4, 0.0])
def test_a_force_that_is_late_is_that_of_before(lag):
    """At nine nodes a period, the fastest that the low-pass lets through, to 1 %."""
    t, omega = np.arange(200.0), 2.0 * np.pi / 9.0
    series = jnp.asarray(np.cos(omega * t) + 0.5 * np.sin(0.2 * t))[:, None, None]
    true = np.cos(omega * (t - lag)) + 0.5 * np.sin(0.2 * (t - lag))
    slope = omega * np.sin(omega * (t - lag)) - 0.1 * np.cos(0.2 * (t - lag))
    found, by_lag = jax.jvp(
        lambda one: inverse.delayed(series, one), (jnp.asarray([lag]),), (jnp.ones(1),)
    )
    inner = slice(12, -12)
    np.testing.assert_allclose(found[inner, 0, 0], true[inner], atol=0.01)
    np.testing.assert_allclose(by_lag[inner, 0, 0], slope[inner], atol=0.05)


def test_the_force_alone_is_late():
    t = 0.01 * np.arange(400)
    along = by_hand(t, np.sin(2.0 * t), acceleration=-4.0 * np.sin(2.0 * t))
    late = force(built("force-clock-offset", force_delay=0.025), along, mass=3.0)
    np.testing.assert_allclose(
        late[10:-10], -12.0 * np.sin(2.0 * (t[10:-10] - 0.025)), rtol=0.0, atol=1e-6
    )


@pytest.mark.slow
def test_a_motion_is_the_same_beside_a_longer_one():
    time = 5e-3 * np.arange(4000)
    long, short = (
        dataclasses.replace(record(time[:n], position=0.1 * np.sin(3 * time[:n])), name=name)
        for n, name in ((4000, "long"), (2000, "short"))
    )
    values = {"M_Pl": 5.0, "S_Pl": 0.0, "presliding": 1e-5, "F_C": 2.0}
    values = {k: jnp.asarray([v, 1.5 * v]) for k, v in values.items()}
    tracks = [make_track(r)[0] for r in (long, short)]
    effects = (CATALOGUE["coulomb-friction"],)
    both = MotionGroup(tuple(tracks), effects).predict(values)["force"]
    one = MotionGroup((tracks[1],), effects).predict(values)["force"]
    assert both.shape == (tracks[0].samples, 2, 2)
    np.testing.assert_allclose(both[: tracks[1].samples, 1], one[:, 0], rtol=1e-12)


# A machine, simulated

PRESLIDING = 2e-5
"""Bending [m] of the bristles that are simulated here."""

TRUTH = {"M_Pl": 12.0, "S_Pl": 5e-4, "mu": 80.0, "F_C": 6.0, "presliding": PRESLIDING}
FACTORS = {"M_Pl": 2.0, "mu": 5.0, "F_C": 4.0}  # of their priors, below
NOISE = 2.0
SPEC = """title = "A cart, simulated"
simulated = true
[rig]
S_Pl = {{ value = 5e-4, sd = 5e-6 }}
[model]
body = "cart"
effects = {effects}
candidates = ["coulomb-friction"]
[priors]
M_Pl = {{ lognormal = {{ median = 10.0, factor = 2.0 }} }}
mu = {{ lognormal = {{ median = 100.0, factor = 5.0 }} }}
F_C = {{ lognormal = {{ median = 10.0, factor = 4.0 }} }}
[sensors]
force = {{ noise = 0.6, gain_sd = 0.0, zero_sd = 0.5 }}
[sampler]
starts = 4
[[records]]
name = "to-and-fro"
kind = "motion"
file = "cart.csv"
[records.channels]
time = {{ column = 1, unit = "ms" }}
position = {{ column = 2, unit = "counts", scale = -1e-3 }}
force = {{ column = 4, unit = "counts", scale = 2.0 }}
pressure = {{ column = 3, unit = "bar" }}
"""


def bristle(x: np.ndarray) -> np.ndarray:
    """Share of its sliding force that a bristle carries: Dahl's law integrated over the way."""
    share = np.zeros(len(x))
    for k, way in enumerate(np.diff(x)):
        share[k + 1] = np.sign(way) + (share[k] - np.sign(way)) * np.exp(-abs(way) / PRESLIDING)
    return share


def cart(folder: Path, effects: str) -> Path:
    """A spec of a simulated cart and its file, without a header; returns the spec's path."""
    rng, time = np.random.default_rng(7), 2e-3 * np.arange(15000)
    rates = 2 * np.pi * np.array([0.3, 0.71, 1.9])
    sizes, phases = np.array([0.1, 0.04, 0.01]), np.array([0.0, 1.0, 2.0])
    angle = rates * time[:, None] + phases
    x, v = np.sin(angle) @ sizes, np.cos(angle) @ (sizes * rates)
    a = -np.sin(angle) @ (sizes * rates**2)
    p = 2e5 + 1e5 * np.sin(0.9 * time)
    dry = TRUTH["F_C"] * bristle(x)
    f = TRUTH["M_Pl"] * a + TRUTH["mu"] * v + dry - TRUTH["S_Pl"] * p
    read = f + NOISE * rng.standard_normal(len(time))
    table = np.stack(
        [1e3 * time, -1e3 * (x + 2e-6 * rng.standard_normal(len(x))), p / 1e5, read / 2]
    )
    lines = ["\t".join(f"{c:.6f}" for c in row) for row in table.T]
    (folder / "cart.csv").write_text("\n".join(lines) + "\n", "utf-8")
    path = folder / "cart.toml"
    path.write_text(SPEC.format(effects=effects), "utf-8")
    return path


def best_fit(path: Path):
    """The search's outcome, the values at the best fit, and how far each is from the truth [sd]."""
    spec = load_spec(path)
    found = search(assemble(spec, read_records(spec)), 2, 1)
    best = found.optima[0]
    values = {k: float(v[0]) for k, v in values_of(found.problem, best.z[None]).items()}
    sd = dict(zip(found.problem.parameters.labels, np.sqrt(np.diag(best.covariance)), strict=True))
    off = {
        label: np.log(values[label] / TRUTH[label]) / np.log(factor) / sd[label]
        for label, factor in FACTORS.items()
        if label in sd
    }
    return found, values, off


def test_a_simulated_machine_is_found_again(tmp_path):
    found, values, off = best_fit(cart(tmp_path, '["viscous-friction", "coulomb-friction"]'))
    assert found.problem.parameters.labels == (
        "M_Pl", "S_Pl", "mu", "F_C", "presliding", "noise[force,A]",
    )  # fmt: skip
    assert not found.problem.of_the_rig
    assert set(off) == set(FACTORS)
    assert max(map(abs, off.values())) < 4.0, off
    # What the low-pass leaves of white noise: a tenth, the corner over half the sampling frequency,
    # less some 5 % for the slope of its edge; the 1500 samples that are left tell it to 2 % (1 sd).
    left = NOISE * np.sqrt(0.1 * 0.95)
    assert values["noise[force,A]"] == pytest.approx(left, rel=0.1)


@pytest.mark.slow
def test_without_its_dry_friction_the_coefficient_is_wrong(tmp_path):
    _, values, off = best_fit(cart(tmp_path, '["viscous-friction"]'))
    assert off["mu"] > 4.0
    assert values["mu"] > 1.1 * TRUTH["mu"]


def test_a_step_longer_than_half_a_period_of_the_corner_is_a_gap(tmp_path):
    """Sampled at 500 Hz the corner is 25 Hz: steps below 20 ms are bridged, as of 18 ms here."""
    path = cart(tmp_path, '["viscous-friction"]')
    lines = (tmp_path / "cart.csv").read_text("utf-8").splitlines()
    bridged = "\n".join(lines[:1000] + lines[1008:])
    (tmp_path / "cart.csv").write_text(bridged, "utf-8")
    (record,) = read_records(load_spec(path))
    assert record.corner == pytest.approx(25.0)
    assert np.all(make_track(record)[1].weight["force"] == 1.0)
    (tmp_path / "cart.csv").write_text("\n".join(lines[:1000] + lines[1012:]), "utf-8")
    with pytest.raises(InputError, match=r"line 1001: samples are missing, .* accept = \["):
        read_records(load_spec(path))
    text = path.read_text("utf-8").replace(
        "[records.channels]", 'accept = ["gap"]\n[records.channels]'
    )
    path.write_text(text, "utf-8")
    (record,) = read_records(load_spec(path))
    weight = make_track(record)[1].weight["force"]
    # The filter's 121 nodes reach 0.2 s to either side of the gap of 24 ms: some 21 samples.
    assert 19 <= np.sum(weight == 0.0) <= 23


@pytest.mark.parametrize("missing", ["load-cell-spring", "hose-pressure-drop", "return-spring"])
def test_an_effect_of_the_rig_is_refused(tmp_path, missing):
    spec = load_spec(cart(tmp_path, f'["{missing}"]'))
    with pytest.raises(InputError, match=f"'{missing}' is of the rig, all records are motions"):
        assemble(spec, read_records(spec))


def test_a_prior_may_be_that_of_a_candidate_and_of_nothing_else(tmp_path):
    path = cart(tmp_path, '["viscous-friction"]')
    spec = load_spec(path)
    assert "F_C" not in assemble(spec, read_records(spec)).parameters.labels
    path.write_text(path.read_text("utf-8").replace("candidates", "vary = {}\n#"), "utf-8")
    spec = load_spec(path)
    with pytest.raises(InputError, match=r"\[priors\]: 'F_C' is a number of coulomb-friction or "):
        assemble(spec, read_records(spec))
    path.write_text(path.read_text("utf-8").replace("F_C", "F_D"), "utf-8")
    spec = load_spec(path)
    with pytest.raises(InputError, match=r"\[priors\]: unknown name 'F_D'"):
        assemble(spec, read_records(spec))


@pytest.mark.parametrize(
    ("candidates", "message"),
    [
        ('["clock-offset"]', "candidates: 'clock-offset' is of the rig, all records are motions"),
        ('["own:Blind"]', r"candidates: 'blind' has sense\(\), which nothing asks for along a"),
        ('["own:Late"]', r"candidates: 'late' has delays\(\) of \"position\", which nothing asks"),
    ],
)  # fmt: skip
def test_what_a_motion_cannot_show_is_refused(tmp_path, candidates, message):
    """An effect that nothing asks would be weighed, do nothing, and be told as absent."""
    path = cart(tmp_path, '["viscous-friction", "coulomb-friction"]')
    (tmp_path / "own.py").write_text(OWN, "utf-8")
    text = path.read_text("utf-8")
    assert text.count("candidates") == 1
    path.write_text(re.sub("candidates = .*", f"candidates = {candidates}", text), "utf-8")
    with pytest.raises(InputError, match=message):
        _ = load(path).question


def test_priors_of_the_catalogue_go_with_what_the_records_hold(tmp_path):
    """So that a cart of 10 kg needs no prior of its own for what may be missing from it."""
    path = cart(tmp_path, '["viscous-friction", "spring-hardening"]')
    cubic = prior_of(path, "k_cubic")
    table = np.loadtxt(tmp_path / "cart.csv")
    force, stroke = 2.0 * np.sqrt(np.mean(table[:, 3] ** 2)), 0.5e-3 * np.ptp(table[:, 1])
    assert cubic == pytest.approx(1e9 * (force / 6e4) * (0.2 / stroke) ** 3, rel=0.2)  # two digits
    text = path.read_text("utf-8")
    usual = "usual = { force = 120.0, stroke = 0.4, speed = 0.1 }"
    path.write_text(text.replace('body = "cart"', f'body = "cart"\n{usual}'), "utf-8")
    assert prior_of(path, "k_cubic") == pytest.approx(1e9 * (120.0 / 6e4) / 8.0)


def prior_of(path: Path, label: str) -> float:
    """The usual size in the prior of a number."""
    spec = load_spec(path)
    listed = assemble(spec, read_records(spec)).parameters.sampled
    return float(next(p.prior for p in listed if p.label == label).usual)


def test_friction_models_have_priors_of_the_same_sizes(tmp_path):
    """One law sized for the body, beside one sized for the rig, would be no comparison."""
    spec = load_spec(cart(tmp_path, '["viscous-friction"]'))
    problem = assemble(spec, read_records(spec))
    place = dataclasses.replace(place_of(spec, None), usual=usual_of(spec, problem))
    assert place.effect("viscous-friction") in problem.effects
    assert place_of(spec, None).effect("viscous-friction") not in problem.effects


def test_what_is_usual_is_asked_of_motions_alone(tmp_path):
    spec = load_spec(find_spec("calibration"))
    stated = UsualSpec(force=1.0, stroke=1.0, speed=1.0)
    spec = spec.model_copy(update={"model": spec.model.model_copy(update={"usual": stated})})
    with pytest.raises(InputError, match=r"\[model\] usual: it is for motions of a body"):
        assemble(spec, read_records(spec))


OWN = """
from typing import ClassVar
from rigid.effects.base import Distortion
from rigid.effects.force_clock_offset import ForceClockOffset


class Late(ForceClockOffset):
    name: ClassVar[str] = "late"

    def delays(self):
        return {"position": self.delay}


class Blind(ForceClockOffset):
    name: ClassVar[str] = "blind"

    def sense(self, seen):
        return Distortion(load=self.delay)
"""


@pytest.mark.slow
def test_the_command_fits_a_machine_that_is_no_rig(tmp_path):
    """Every file of the contract, and nothing in them of what only the rig has."""
    path = cart(tmp_path, '["viscous-friction", "coulomb-friction"]')
    done = subprocess.run(
        [sys.executable, "-m", "rigid.fit", str(path), "--out", "out", "--quiet"],
        capture_output=True, text=True, cwd=tmp_path, check=False, timeout=900,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "out" / "result.json").read_text("utf-8"))
    assert set(result["parameters"]) == {*TRUTH, "noise[force,A]"}
    for label, truth in TRUTH.items():
        row = result["parameters"][label]
        assert row["published"] is None
        assert abs(row["median"] - truth) < 4.0 * row["sd"], label
    posterior = load_posterior(tmp_path / "out" / "posterior.nc")
    assert {"M_Pl", "mu", "F_C", "noise", "gain", "zero"} <= set(
        posterior["posterior"].to_dataset()
    )
    assert not {"mu_omega", "k_LC"} & set(posterior["posterior"].to_dataset())
    assert not posterior["constant_data"].to_dataset()
    page = (tmp_path / "out" / "index.html").read_text("utf-8")
    for there in ("mass of the cart", "simulated", "Record to-and-fro"):
        assert there in page
    for absent in ("Friction over frequency", "equation (14)", "k_oil", "valve open"):
        assert absent not in page

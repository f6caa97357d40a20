"""Machines that a spec puts together, held against simulators that share no code with it."""

import re
import shutil
import tomllib
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from machines import simulated
from machines.loading import SPECS, noiseless, written

import rigid
from rigid.effects import CATALOGUE
from rigid.effects.placed import Scales, placed
from rigid.inference.search import search
from rigid.inference.stages import eased
from rigid.io.errors import InputError
from rigid.physics.drive import Drive, side_by_side
from rigid.physics.machine import Joint, Machine
from rigid.physics.machine_run import Drives, march, reference
from rigid.physics.rig import build_rig
from rigid.physics.rosenbrock import inverse, step
from rigid.physics.slow import march as slow_march
from rigid.records.read import read_records
from rigid.report.discovery.output import at_joint

WITHIN = 0.05
"""Noise sds by which readings may differ from those of the other simulator; its own tolerance is
1e-9, that of the march 2e-5 of a swing, and swings are some thousand noise sds wide."""


def by_steps(spec: str) -> str:
    """Solve by steps without asking diffrax first, as a part of one's own would have it."""
    return f'{spec}\n[solve]\nmethod = "steps"\n'


def worst(study, values) -> float:
    """Greatest difference between simulated and recorded readings, in noise sds of the sensor."""
    made, out = study.simulate(values), 0.0
    for record in read_records(study.spec):
        for quantity, channel in record.channels.items():
            if quantity in ("command", "force"):
                continue
            series = np.asarray(made[f"{record.name},{record.cylinder}"][quantity])
            apart = np.abs(series[: len(channel.values)] - channel.values).max()
            out = max(out, apart / study.spec.sensors[quantity].noise)
    return out


@pytest.mark.slow
@pytest.mark.parametrize("name", simulated.MACHINES)
def test_a_machine_moves_as_its_own_equations_say(name, tmp_path, monkeypatch):
    path = written(name, tmp_path, by_steps)
    truth = noiseless(monkeypatch, name, tmp_path / f"{name}.csv")
    study = rigid.load(path)
    assert truth.keys() <= set(study.names) | {"kappa[lift,c1]"}
    assert worst(study, truth) < WITHIN


def test_what_is_left_out_of_a_machine_is_seen(tmp_path, monkeypatch):
    """The same comparison, without the oil on the rod side."""

    gone = {
        'effects = ["oil-compressibility"]': "effects = []",
        "area = 3e-3\ncolumn = { value = 0.25, sd = 0.005 }\n": "",
        'pressure = { column = "p_rod", unit = "bar" }': 'load = { column = "F", unit = "kN" }',
    }

    def without_rod(spec: str) -> str:
        for old, new in gone.items():
            assert old in spec
            spec = spec.replace(old, new)
        return spec

    path = written("press", tmp_path, without_rod)
    truth = noiseless(monkeypatch, "press", tmp_path / "press.csv")
    assert worst(rigid.load(path), truth) > 100.0 * WITHIN


def paper_rig() -> tuple[dict[str, float], tuple]:
    values = {
        "M_HC": 60.0, "M_Pl": 10.0, "M_Fl": 200.0, "S_Pl": 44.2e-4, "L_0": 0.2, "k_LC": 6e7,
        "k_oil": 2e9, "mu": 2e6, "p_max": 700e5,
    }  # fmt: skip
    names = "load-cell-spring", "oil-compressibility", "viscous-friction", "pump-curve"
    return values, tuple(CATALOGUE[name] for name in names)


@pytest.mark.slow
def test_the_papers_rig_is_one_joint():
    """Eqs. (19)-(22) as a machine: readings are those of the rig's own solver."""
    values, effects = paper_rig()
    wide = {name: jnp.asarray([value]) for name, value in values.items()}
    shared = frozenset(values)
    here = tuple(placed(e, "A", shared).build(wide) for e in effects)
    joint = Joint((1.0, 0.0), (0.0, 1.0), wide["S_Pl"], wide["L_0"], here)
    masses = wide["M_HC"] - wide["M_Pl"], wide["M_Pl"] + 0.5 * wide["M_Fl"]
    machine = Machine(masses, (joint,), (False, False))
    count, steps, opened = 127, 8, 63
    passed = np.zeros((count, steps, 2, 1, 1))
    passed[:opened, :, 1] = 1.0
    none = jnp.zeros((count, steps, 1, 1))
    first = jnp.asarray(passed)
    drives = Drives(first=first, last=first, begin=none, end=none, interval=0.01)
    fractions = jnp.asarray([0.0, 0.2]).reshape(2, 1, 1, 1)
    ours = march(machine, jnp.zeros((5, 1, 1)), fractions, drives)
    drive = Drive(0.0, 0.01, count + 1, (0.01 * opened,), (1, 0), count + 1)
    theirs = slow_march(
        build_rig(effects, wide), jnp.zeros(1), fractions[:, 0], side_by_side([drive], 1)
    )
    steps_of = {"load": 295.0, "stroke": 0.22e-3, "pressure": 34474.0}
    for quantity, size in steps_of.items():
        apart = np.abs(np.asarray(getattr(ours, quantity)[:, 0] - theirs[quantity]))
        assert apart.max() < 0.03 * size, quantity


def test_a_march_agrees_with_diffrax_where_bristles_slide():
    """Dry friction that turns over, a spring, a force that goes to and fro."""
    values = {"k_spring[s]": 4e4, "F_C[s]": 30.0, "presliding[s]": 2e-5, "mu[s]": 20.0}
    wide = {name: jnp.asarray([value, 1.3 * value]) for name, value in values.items()}
    names = "joint-spring", "coulomb-friction", "viscous-friction"
    here = tuple(placed(CATALOGUE[name], "s").build(wide) for name in names)
    machine = Machine((jnp.asarray(2.0),), (Joint((0.0,), (1.0,), None, None, here),), (False,))
    force = 60.0 * np.sin(2 * np.pi * 3.0 * np.arange(101) * 0.005)
    ramps = np.linspace(force[:-1], force[1:], 9, axis=1)
    open_ = jnp.zeros((100, 8, 1, 1, 1))
    drives = Drives(
        first=open_, last=open_, begin=jnp.asarray(ramps[:, :-1, None, None]),
        end=jnp.asarray(ramps[:, 1:, None, None]), interval=0.005,
    )  # fmt: skip
    start, passed = jnp.zeros((3, 1, 2)), jnp.zeros((1, 1, 1, 2))
    ours = march(machine, start, passed, drives)
    theirs = reference(machine, start, passed, drives, 1e-8)
    span = float(np.ptp(np.asarray(theirs.position)))
    assert span > 1e-3
    assert np.abs(np.asarray(ours.position - theirs.position)).max() < 2e-3 * span


def test_runs_are_fitted_from_their_beginnings_on(tmp_path):
    """Each stage has the samples of the one before and more; the last is the problem itself."""
    simulated.swing(tmp_path / "swing.csv")
    problem = rigid.load(written("swing", tmp_path)).problem
    stages = eased(problem)
    assert stages[-1] is problem
    (piece,) = problem.pieces
    counts = [int(np.count_nonzero(np.asarray(p.weight))) for s in stages for p in s.pieces]
    samples = int(np.count_nonzero(np.asarray(piece.weight)))
    assert counts == [
        np.ceil(samples * share) for share in (1 / 16, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 1)
    ]
    loud, quiet = (float(np.asarray(stage.pieces[0].weight)[0, 0]) for stage in stages[:2])
    assert quiet == pytest.approx(900.0 * loud)


def test_of_a_run_that_is_fitted_from_its_beginning_the_rest_is_not_marched(tmp_path):
    """What is asked for comes out as it does of the whole, its derivatives too; then all stands."""
    simulated.swing(tmp_path / "swing.csv")
    problem = rigid.load(written("swing", tmp_path)).problem
    values = problem.parameters.values(jnp.zeros((1, problem.parameters.size)))
    (group,) = problem.groups
    asked = int(np.ceil(group.samples / 8))
    begun_at = next(label for label in values if label.startswith("x_start"))

    def position(group, more):
        moved = values | {begun_at: 0.02 + values[begun_at] + more}
        return group.predict(moved)["position"][:, 0, 0]

    one, zero = jnp.asarray(1.0), jnp.asarray(0.0)
    whole = jax.jvp(lambda more: position(group, more), (zero,), (one,))
    begun = jax.jvp(lambda more: position(group.beginning(1 / 8), more), (zero,), (one,))
    for full, short in zip(whole, begun, strict=True):
        np.testing.assert_allclose(short[:asked], full[:asked], rtol=1e-12, atol=1e-15)
        assert np.ptp(np.asarray(short[asked:])) == 0.0
        assert np.ptp(np.asarray(full[asked:])) > 0.0


@pytest.mark.slow
def test_a_struck_rig_on_a_rope_is_found_from_the_prior(tmp_path):
    """Its load cell rings through many periods; from the whole record no start gets there."""
    truth = simulated.hanging(tmp_path / "hanging.csv")
    problem = rigid.load(written("hanging", tmp_path)).problem
    found = search(problem, 4, 2)
    assert found.optima[0].reached >= 2
    values = problem.parameters.values(jnp.asarray(found.optima[0].z[None]))
    for label, value in truth.items():
        assert float(values[label][0]) == pytest.approx(value, rel=0.1), label


@pytest.mark.slow
def test_derivatives_of_a_march_are_those_of_differences():
    def read(stiffness):
        effect = placed(CATALOGUE["joint-spring"], "s").build({"k_spring[s]": stiffness[None]})
        joint = Joint((0.0,), (1.0,), None, None, (effect,))
        machine = Machine((jnp.asarray(1.2),), (joint,), (False,))
        open_, none = jnp.zeros((50, 1, 1, 1, 1)), jnp.zeros((50, 1, 1, 1))
        drives = Drives(first=open_, last=open_, begin=none, end=none, interval=0.01)
        start = jnp.asarray([0.03, 0.0]).reshape(2, 1, 1)
        return march(machine, start, jnp.zeros((1, 1, 1, 1)), drives).position[:, 0, 0, 0]

    at = jnp.asarray(900.0)
    slope = jax.jvp(read, (at,), (jnp.asarray(1.0),))[1]
    apart = (read(at + 0.05) - read(at - 0.05)) / 0.1
    np.testing.assert_allclose(slope, apart, atol=1e-6 * float(jnp.abs(slope).max()))


def test_rosenbrock_steps_are_of_order_four():
    def rates(y, t):
        return jnp.stack([y[1] + 0.0 * t, 2.0 * (1.0 - y[0] ** 2) * y[1] - y[0] + t * y[0]])

    def ended(count: int) -> np.ndarray:
        length = 1.0 / count

        def one(y, i):
            return step(rates, y, length * i, length * (i + 1.0), length), None

        steps = jnp.arange(1.0 * count)
        return np.asarray(jax.lax.scan(one, jnp.asarray([1.0, 0.5]), steps)[0])

    finest = ended(160)
    errors = [np.abs(ended(count) - finest).max() for count in (10, 20, 40)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (orders > 3.5).all(), orders


def test_matrices_are_inverted_side_by_side():
    rng = np.random.default_rng(3)
    matrices = rng.standard_normal((6, 6, 4)) + 6.0 * np.eye(6)[:, :, None]
    expected = np.stack([np.linalg.inv(matrices[:, :, i]) for i in range(4)], axis=-1)
    np.testing.assert_allclose(inverse(jnp.asarray(matrices)), expected, atol=1e-14)


REFUSED = {
    "a body that is not there": (
        ('between = ["ground", "ram"]\narea', 'between = ["ground", "arm"]\narea'),
        "did you mean 'ram'?",
    ),
    "oil without a column": (
        ("column = { value = 0.25, sd = 0.005 }\n", ""), "area stands without",
    ),
    "a pump without oil": (
        ('effects = ["joint-spring"]', 'effects = ["joint-spring", "pump-curve"]'),
        "is of the pump, and there is no oil",
    ),
    "oil that does not give way": (
        ('effects = ["oil-compressibility"]', "effects = []"), "nothing says how it gives way",
    ),
    "a part of the rig": (
        ('effects = ["joint-spring"]', 'effects = ["joint-spring", "seating-slack"]'),
        "acts in records of kind frame alone",
    ),
    "a joint that is not there": (('cylinder = "rod"', 'cylinder = "road"'), "did you mean 'rod'?"),
    "a pressure without oil": (
        ('cylinder = "rod"', 'cylinder = "workpiece"'), "there is no oil at this joint",
    ),
    "a record of the rig": (
        ('kind = "run"\ncylinder = "rod"', 'kind = "frame"\ncylinder = "rod"'),
        "records of a [machine] are runs",
    ),
    "effects in two places": (
        ("[priors]", '[model]\neffects = ["joint-spring"]\n[priors]'), "each joint of a [machine]",
    ),
    "a number that varies": (
        ("[priors]", '[model]\nvary = { mu = "cylinder" }\n[priors]'), "only and vary are",
    ),
    "a number that nothing has": (('["k_oil"]', '["k_oi"]'), "no effect here has a number 'k_oi'"),
    "ground as a body": (("[machine.bodies.ram]", "[machine.bodies.ground]"), "does not move"),
}  # fmt: skip


@pytest.fixture(scope="module")
def simulated_press(tmp_path_factory) -> Path:
    """The record of a press, simulated once."""
    path = tmp_path_factory.mktemp("press") / "press.csv"
    simulated.press(path)
    return path


@pytest.mark.parametrize("case", REFUSED)
def test_a_machine_that_cannot_be_is_refused_in_a_sentence(case, simulated_press, tmp_path):
    (old, new), says = REFUSED[case]
    path = written("press", tmp_path, lambda spec: spec.replace(old, new))
    assert new in path.read_text("utf-8")
    shutil.copy(simulated_press, tmp_path)
    with pytest.raises(InputError, match=re.escape(says)):
        _ = rigid.load(path).problem


def test_a_run_needs_its_machine(tmp_path):
    path = written(
        "press",
        tmp_path,
        lambda spec: spec[: spec.index("[machine]")] + spec[spec.index("[priors]") :],
    )
    with pytest.raises(InputError, match=re.escape("no machine is stated")):
        rigid.load(path)


@pytest.mark.slow
def test_what_may_be_missing_is_looked_for_where_it_can_be_told(tmp_path):
    """Frictions at one of three joints between the same bodies, leaks wherever there is oil."""
    path = written("press", tmp_path)
    simulated.press(tmp_path / "press.csv")
    study = rigid.load(path)
    names = {effect.name for effect in study.question.effects}
    places = {"head", "rod", "workpiece"}

    def where(effect: str) -> set[str]:
        return {place for place in places if f"{effect} at {place}" in names}

    assert where("coulomb-friction") == {"head"}
    assert where("spring-hardening") == {"head"}
    assert where("piston-leakage") == {"head", "rod"}
    assert where("pressure-dependent-friction") == places
    assert where("viscous-friction") == set()  # one of three, and the head has it
    assert where("seating-slack") == where("clock-offset") == where("free-root-plate") == set()
    text = path.read_text("utf-8")
    model = "[model]\n" if "[model]\n" in text else ""
    named = '[model]\ncandidates = ["piston-leakage"]\n'
    text = text.replace(model, named) if model else f"{text}\n{named}"
    path.write_text(text, "utf-8")
    found = {effect.name for effect in rigid.load(path).question.effects}
    assert found == {"piston-leakage at head", "piston-leakage at rod"}


def test_a_spec_with_what_was_found_has_it_at_its_joint():
    text = (SPECS / "press.toml").read_text("utf-8")
    for joint in ("head", "rod", "workpiece"):
        joints = tomllib.loads(at_joint(text, joint, "piston-leakage"))["machine"]["joints"]
        before = tomllib.loads(text)["machine"]["joints"]
        before[joint]["effects"].append("piston-leakage")
        assert joints == before


def test_priors_go_with_what_is_usual():
    usual = Scales(force=6.0, stroke=0.02, speed=2.5, pressure=136e5)
    made = placed(CATALOGUE["viscous-friction"], "s", frozenset(), usual)
    prior = made.parameters()[0].priors[0]
    assert prior.arguments["median"] == pytest.approx(1e5 * 1e-4 / 100.0)
    assert prior.arguments["factor"] == 10.0
    force, bending = placed(CATALOGUE["coulomb-friction"], "s", frozenset(), usual).parameters()
    (rig,), (here,) = CATALOGUE["coulomb-friction"].parameters()[0].priors, force.priors
    assert here.arguments["median"] == pytest.approx(1e-4 * rig.arguments["median"])
    # How far a contact bends before it slides is no matter of the machine's size.
    assert bending.priors == CATALOGUE["coulomb-friction"].parameters()[1].priors
    oil = placed(CATALOGUE["oil-compressibility"], "s", frozenset(), usual).parameters()[0]
    assert oil.priors == CATALOGUE["oil-compressibility"].parameters()[0].priors


@pytest.mark.slow
@pytest.mark.parametrize("name", simulated.MACHINES)
def test_a_fit_finds_what_a_machine_was_made_with(name, tmp_path):
    """Every number within 4 posterior sds of the truth: of some 25 one in 16,000 is farther."""
    truth = simulated.MACHINES[name](tmp_path / f"{name}.csv")
    fit = rigid.load(written(name, tmp_path)).fit(quiet=True)
    assert all(check.ok for check in fit.checks), fit.checks
    for label, value in truth.items():
        drawn = fit.calibrated.values[label]
        assert abs(value - drawn.mean()) < 4.0 * drawn.std(), label

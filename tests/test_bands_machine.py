"""Loads on machines of a spec's own: the rig as one of them, and tests of five against SciPy."""

import dataclasses
import re
import shutil
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from machines.loads import LOADS
from machines.pressing import JOINTS, SOUGHT, simulated_test, true_law, with_test
from machines.simulated import MACHINES
from rigs import NOMINAL, effects

import rigid
from rigid.effects.placed import placed
from rigid.io.errors import InputError
from rigid.likelihood.machine import Coordinate, Layout, Place
from rigid.physics.rig import build_rig
from rigid.smoothing.field import QUANTITIES, Channel, Setup, rig_setup
from rigid.smoothing.inputs import Inputs
from rigid.smoothing.machine_plant import numbers, plants
from rigid.smoothing.model import Calibration, nodes, scales, shown
from rigid.smoothing.plant import RigPlant, Rough
from rigid.smoothing.reading import read_fields
from rigid.smoothing.run import bands, learned, ways
from rigid.spec import load_spec

# The rig as a machine


@pytest.mark.slow
def test_the_rig_as_a_machine_takes_the_rigs_own_steps():
    """Two bodies, one joint with oil, a load between plunger and ground: eqs. (19)-(22)."""
    joint, ice = (
        Place("A", (1.0, 0.0), (0.0, 1.0), True),
        Place("ice", (0.0, 1.0), (0.0, 0.0), False),
    )
    layout = Layout((Coordinate("barrel"), Coordinate("plunger")), (joint, ice))
    shared = frozenset(info.name for e in effects() for info in e.parameters())
    here = tuple(placed(e, "A", shared) for e in effects())
    values = dict(NOMINAL) | {
        "mass[barrel]": NOMINAL["M_HC"] - NOMINAL["M_Pl"],
        "mass[plunger]": NOMINAL["M_Pl"] + 0.5 * NOMINAL["M_Fl"],
        "area[A]": NOMINAL["S_Pl"], "column[A]": NOMINAL["L_0"],
    }  # fmt: skip
    wide = {n: jnp.asarray([values[n]]) for n in numbers(here, layout)}
    channels = tuple(Channel(q, "A") for q in QUANTITIES)
    setup = Setup(channels, Inputs(("ice",), ("A",)), ((0.0, 0.0), (-1.0, 1.0), (0.0, 0.0)), (2,))
    machine = jax.tree.map(lambda leaf: leaf[..., 0], plants(layout, here, setup, wide, 1))
    rig = RigPlant(rig=build_rig(effects(), NOMINAL), inputs=rig_setup("A").inputs)
    none = jnp.zeros((1, 0))
    moved = [jnp.asarray([[0.0, one]]) for one in (0.01, 0.008)]
    sensors = Calibration(jnp.asarray([1e-3, 2e-3, 0.0]), jnp.asarray([10.0, 1e-5, 1e3]))
    theirs = nodes(
        rig, Rough(*(m[:, 1:] for m in moved), jnp.asarray([[2e6]]), none), sensors, 1e-3
    )
    ours = nodes(machine, Rough(*moved, jnp.asarray([[2e6]]), none), sensors, 1e-3)
    order = np.arange(len(scales(rig)))
    order[[1, 2]] = 2, 1  # places, then speeds
    size, other = np.asarray(scales(rig)), np.asarray(scales(machine))[order]
    change = other / size
    step = np.asarray(ours.step[0])[np.ix_(order, order)] * change[:, None] / change
    np.testing.assert_allclose(step, theirs.step[0], atol=1e-9)
    np.testing.assert_allclose(
        np.asarray(ours.entry[0])[order] * change[:, None], theirs.entry[0], atol=1e-9
    )
    sense = np.asarray(ours.sense[0])[:, order] / change
    np.testing.assert_allclose(sense, theirs.sense[0], rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(ours.offset[0], theirs.offset[0], atol=1e-6)
    rows = np.asarray(shown(machine))[:, order] / change
    np.testing.assert_allclose(rows, shown(rig), rtol=1e-12)


# Tests of machines


def found(name, folder, draws=8, **wrong):
    """The band of a known machine's load at its samples, its budget, and the truth (simulated)."""
    truth = MACHINES[name](folder / f"{name}.csv")
    spec, load = simulated_test(name, folder)
    law = true_law(spec, truth, draws)
    off = {label: law.values[label] * factor for label, factor in wrong.items()}
    law = dataclasses.replace(law, values=dict(law.values) | off)
    ((field,),) = read_fields(spec)
    one = learned(spec, [field], law, lambda _: None)
    made = bands(ways([field], [one], [law]), 1, apart=False)
    band = made.bands[f"load_{SOUGHT[name]}"].quantiles[:, ::4]
    return band, made.budget, load[: band.shape[1]]


def held(band, load) -> float:
    """The share of samples at which the 90 % band holds the load."""
    return float(np.mean((band[0] <= load) & (load <= band[4])))


@pytest.mark.slow
def test_the_load_on_a_press_without_a_load_cell(tmp_path):
    """A specimen that gives way at 212 kN; with three times the friction the load is another."""
    band, budget, load = found("press", tmp_path)
    assert held(band, load) > 0.8
    assert np.sqrt(np.mean((band[2] - load) ** 2)) < 0.01 * load.max()
    (peak,) = (line for line in budget if line.name == "peak load")
    assert peak.place == "workpiece"
    assert peak.median == pytest.approx(load.max(), rel=0.02)
    wrong, _, _ = found("press", tmp_path, **{"mu[head]": 3.0})
    assert held(wrong, load) < 0.6


@pytest.mark.slow
@pytest.mark.parametrize("name", [one for one in LOADS if one != "press"])
def test_the_load_on_other_machines(name, tmp_path):
    """Four cylinders that tilt, a shaker with its command, a body on a spring, a rig on a rope."""
    band, _, load = found(name, tmp_path)
    assert held(band, load) > 0.8
    assert np.sqrt(np.mean((band[2] - load) ** 2)) < 0.05 * np.abs(load).max()


@pytest.mark.slow
def test_a_press_from_its_calibration_to_its_load(tmp_path):
    """The commands one after another: the posterior of a fit, then the bands of a test."""
    MACHINES["press"](tmp_path / "press.csv")
    spec, load = simulated_test("press", tmp_path)
    study = rigid.load(spec.path)
    study.fit(out=tmp_path, quiet=True)
    made = rigid.load(spec.path).bands(quiet=True)
    assert made["load_workpiece"].attrs["long_name"] == "load, joint workpiece"
    band = made["load_workpiece"].values[:, ::4]
    assert held(band, load) > 0.8
    text = spec.path.read_text("utf-8").replace("value = 180.0", "value = 181.0")
    spec.path.write_text(text, "utf-8")
    with pytest.raises(InputError, match="posterior of another machine"):
        rigid.load(spec.path).bands(quiet=True)


REFUSED = {
    "a load at no joint": (('loads = ["workpiece"]', 'loads = ["workpice"]'), "did you mean"),
    "a load where there is oil": (('loads = ["workpiece"]', 'loads = ["rod"]'), "there is oil at"),
    "a load twice": (
        ('loads = ["workpiece"]', 'loads = ["workpiece", "workpiece"]'), "stands twice",
    ),
    "no load": (('loads = ["workpiece"]', ""), "no load is sought"),
    "a start": (
        ('kind = "test"\ncylinder = "head"', 'kind = "test"\nstart = "moving"\ncylinder = "head"'),
        "start belongs to a run",
    ),
}  # fmt: skip


@pytest.fixture(scope="module")
def simulated_press(tmp_path_factory) -> Path:
    """The folder of a press and its test, simulated once."""
    folder = tmp_path_factory.mktemp("press")
    MACHINES["press"](folder / "press.csv")
    simulated_test("press", folder)
    return folder


@pytest.mark.parametrize("case", REFUSED)
def test_a_test_that_cannot_be_is_refused_in_a_sentence(case, simulated_press, tmp_path):
    (old, new), says = REFUSED[case]
    shutil.copytree(simulated_press, tmp_path, dirs_exist_ok=True)
    path = tmp_path / "press.toml"
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new), "utf-8")
    with pytest.raises(InputError, match=re.escape(says)):
        read_fields(load_spec(path))


def test_a_test_that_does_not_begin_at_rest_is_refused(simulated_press, tmp_path):
    shutil.copytree(simulated_press, tmp_path, dirs_exist_ok=True)
    file = tmp_path / "press-test.csv"
    head, *rows = file.read_text("utf-8").splitlines()
    file.write_text("\n".join([head, *rows[100:]]), "utf-8")
    with pytest.raises(InputError, match="must begin at rest and out of load"):
        read_fields(load_spec(tmp_path / "press.toml"))


def test_a_test_needs_its_machine(tmp_path):
    assert set(JOINTS) == set(LOADS) == set(SOUGHT)
    text = with_test("press", "[priors]\n")
    (tmp_path / "press.toml").write_text(text, "utf-8")
    with pytest.raises(InputError) as refused:
        load_spec(tmp_path / "press.toml")
    assert "'pressing' is a test, and no machine is stated" in str(refused.value)
    assert "leave this out for the rig" in str(refused.value)

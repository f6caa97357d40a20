"""The second simulator: it shares no code with the first, and it agrees with rigid's physics."""

import ast
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rigs import SHEETS
from second_simulator import POPULATIONS, campaign
from second_simulator.causes import HystereticCell, Lag
from second_simulator.plant import AREA, Rig, Run, motion
from second_simulator.sensors import Chain, Sensor, converted, noise_of

import rigid
from rigid.spec import load_spec

FOLDER = Path(__file__).parent / "second_simulator"
ALLOWED = {"numpy", "scipy"} | sys.stdlib_module_names
SHARE = 0.01
"""Of the sheet's sqrt(noise^2 + step^2 / 12), by which the two simulators may differ."""


def rig_of(truth: dict) -> Rig:
    return Rig(**{k: tuple(v) if isinstance(v, list) else v for k, v in truth["rig"].items()})


def runs_of(truth: dict) -> list[Run]:
    return [
        Run(**run | {"valve": tuple(map(tuple, run["valve"])), "strap": run["strap"]})
        for run in truth["runs"]
    ]


def at_truth(truth: dict) -> dict[str, float]:
    """All that the package's model takes, by label."""
    rig = rig_of(truth)
    named = ("k_LC", "k_oil", "mu", "L_0", "M_HC", "M_Pl", "M_Fl", "k_frame")
    own = {k: getattr(rig, k) for k in named}
    for i, (mu, tau) in enumerate(zip(rig.mu_branch, rig.tau_branch, strict=True), 1):
        own |= {f"mu_branch[{i}]": mu, f"tau_branch[{i}]": tau}
    for run in runs_of(truth):
        where = f"{run.name},{run.cylinder}"
        own |= {f"kappa{'_tank' * (f < 0.0)}[{where}]": f for _, f in run.valve if f}
        if run.strap:
            own |= {f"preload[{where}]": run.strap[0], f"release_time[{where}]": run.strap[1]}
    return own


@pytest.fixture(scope="module")
def plain(tmp_path_factory) -> Path:
    return campaign("plain", 1, tmp_path_factory.mktemp("plain")).parent


def test_it_imports_nothing_of_the_package_or_its_generator():
    for path in sorted(FOLDER.glob("*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Import):
                assert {a.name.split(".")[0] for a in node.names} <= ALLOWED, path.name
            elif isinstance(node, ast.ImportFrom) and not node.level:
                assert (node.module or "").split(".")[0] in ALLOWED, path.name
            elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                assert node.func.id != "__import__", path.name


@pytest.mark.slow
def test_two_simulators_agree_within_a_share_of_each_sensors_step(plain: Path):
    truth = json.loads((plain / "truth.json").read_text("utf-8"))
    study = rigid.load(plain / "spec.toml")
    said, rig = study.simulate(at_truth(truth)), rig_of(truth)
    kinds = set()
    for run in runs_of(truth):
        moved, label = motion(rig, run), f"{run.name},{run.cylinder}"
        times = np.asarray(study.times[label])
        inside = times < run.duration - 1e-9
        mine = [moved.values(t) for t in times[inside]]
        for quantity, reading in said[label].items():
            apart = np.asarray(reading)[inside] - [values[quantity] for values in mine]
            sheet = SHEETS[quantity]
            floor = np.hypot(sheet.noise, sheet.step / 12.0**0.5)
            assert np.abs(apart).max() < SHARE * floor, (label, quantity)
            kinds.add((run.kind, quantity))
    assert len(kinds) == 7


def test_a_shut_chamber_keeps_its_oil_and_a_swing_loses_energy():
    strap = (6000.0, 0.04, 0.0, "logistic")
    rig = Rig()
    moved = motion(rig, Run("snap", "release", "A", 0.25, ((0.25, 0.0),), strap))

    def energy(t: float) -> float:
        y = moved.state(t)[0]
        (m1, m2), stroke = rig.masses, y[3] - y[2]
        oil = 0.5 * moved.plant.pressure(y[4], stroke) ** 2 / rig.k_oil * AREA * (rig.L_0 + stroke)
        memory = sum(
            0.5 * mu / tau * e**2
            for mu, tau, e in zip(rig.mu_branch, rig.tau_branch, y[5:], strict=True)
        )
        return 0.5 * (y[0] ** 2 / m1 + y[1] ** 2 / m2 + rig.k_LC * y[2] ** 2) + oil + memory

    assert moved.state(0.2)[0][4] == pytest.approx(moved.state(0.0)[0][4], rel=1e-9)
    # Pressure is of second order in the compression here: the quadratic energy is good to 1 %.
    levels = [energy(t) for t in np.arange(0.0405, 0.2, 0.005)]
    assert np.all(np.diff(levels) < 0.01 * levels[0])
    assert levels[-1] < 0.2 * levels[0]


def test_a_strap_that_takes_its_time_keeps_the_end_and_softens_the_start():
    def swing(lasts: float, law: str) -> np.ndarray:
        strap = (6000.0, 0.04, lasts, law)
        moved = motion(Rig(), Run("snap", "release", "A", 0.25, ((0.25, 0.0),), strap))
        return np.array([moved.values(t)["acceleration"] for t in (0.0399, 0.0401, 0.0405)])

    at_once = swing(0.0, "logistic")
    assert at_once[0] == pytest.approx(0.0, abs=1e-3)
    assert abs(at_once[1]) > 50.0
    for law in ("linear", "exponential", "logistic"):
        assert np.abs(swing(4e-3, law)).max() < 0.7 * abs(at_once[1])


@pytest.mark.slow
def test_a_release_on_a_sample_reads_half_of_the_jump(tmp_path: Path):
    truth = json.loads(
        (campaign("release-on-a-sample", 3, tmp_path).parent / "truth.json").read_text("utf-8")
    )
    run = next(run for run in runs_of(truth) if run.strap)
    file = tmp_path / f"{run.name}-{run.cylinder}.txt"
    read = np.loadtxt(file, delimiter=";", skiprows=1)
    on = int(np.argmin(abs(read[:, 0] - 1e3 * run.strap[1])))
    jump = run.strap[0] / rig_of(truth).masses[1]
    assert read[on, 1] == pytest.approx(0.5 * jump, abs=2.0)  # noise 0.35, a gain good to 1 %
    assert abs(read[on - 1, 1]) < 2.0


def test_noise_is_of_the_variance_and_colour_that_it_says():
    times, rng = np.arange(200_000) / 100.0, np.random.default_rng(5)
    for chain, colour in ((Chain(), 0.0), (Chain(), 0.9), (Chain(tails=4.0), 0.3)):
        noise = noise_of(chain, colour, times, rng)
        assert np.std(noise) == pytest.approx(1.0, abs=0.05)
        assert np.mean(noise[1:] * noise[:-1]) == pytest.approx(colour, abs=0.05)
    sensor = Sensor(1.0, 0.0, 0.0, 2.0, 0.0)
    exact = np.array([0.9, 1.1, 2.9])
    assert converted(Chain(), sensor, exact, np.zeros(3)).tolist() == [0, 1, 1]
    assert converted(Chain(cut=True), sensor, exact, np.zeros(3)).tolist() == [0, 0, 1]


def test_a_resonant_mounting_rings_at_its_frequency():
    lag = Lag("acceleration", 6e-4, 0.1)
    run = Run("snap", "release", "A", 0.1, ((0.1, 0.0),), (6000.0, 0.04, 0.0, "logistic"))
    moved, true = motion(Rig(), run, (lag,)), motion(Rig(), run)
    times = 0.04 + np.arange(1, 400) * 1e-5
    rings = [moved.values(t)["acceleration"] - true.values(t)["acceleration"] for t in times]
    crossings = np.count_nonzero(np.diff(np.sign(rings)))
    assert 1 <= crossings <= 3  # 4 ms of 265 Hz hold 2.1 half periods


def test_a_hysteretic_cell_reads_a_loop_that_stays_in_a_hold():
    """Against the law's integrals: tanh on the way in, a tangent and then tanh on the way back."""
    cell, rig = HystereticCell(100.0, 3e-4), Rig()
    valve = ((0.8, 0.08), (1.2, 0.0), (1.6, -0.08), (2.0, 0.0))
    run = Run("press", "frame", "A", 2.0, valve)
    moved, true = motion(rig, run, (cell,)), motion(rig, run)

    def seen(t: float) -> tuple[float, float]:
        load = true.values(t)["load"]
        return load / rig.k_LC / cell.width, (moved.values(t)["load"] - load) / cell.size

    (risen, up), (fallen, down) = seen(1.19), seen(1.99)
    root = (2.0 * cell.closing - 1.0) ** 0.5
    to_zero = np.arctan(root * np.tanh(risen)) / root
    # The load rings a little at every switch, which the integrals do not see.
    assert up == pytest.approx(np.tanh(risen), abs=2e-3)
    assert down == pytest.approx(-np.tanh(risen - fallen - to_zero), abs=5e-3)
    assert down < -0.5
    # In a hold the load goes on by a hundredth of the width, as friction forgets.
    assert seen(1.0)[1] == pytest.approx(up, abs=0.01)
    assert seen(1.8)[1] == pytest.approx(down, abs=0.01)


@pytest.mark.parametrize("population", sorted(POPULATIONS))
@pytest.mark.long
def test_every_population_gives_records_that_its_spec_reads(population: str, tmp_path: Path):
    spec = load_spec(campaign(population, 2, tmp_path))
    assert spec.simulated
    assert {record.kind for record in spec.records} == {"frame", "free-run", "release"}
    for record in spec.records:
        read = np.loadtxt(tmp_path / record.file, delimiter=";", skiprows=1)
        assert np.isfinite(read).all()
        assert np.ptp(read, axis=0).min() > 0.0


@pytest.mark.slow
def test_a_seed_is_a_campaign(plain: Path, tmp_path: Path):
    again = campaign("plain", 1, tmp_path / "again").parent
    names = sorted(path.name for path in plain.iterdir())
    assert names == sorted(path.name for path in again.iterdir())
    assert all((plain / n).read_bytes() == (again / n).read_bytes() for n in names)


@pytest.mark.slow
def test_the_command_names_its_spec(tmp_path: Path):
    told = subprocess.run(
        [sys.executable, "-m", "second_simulator", "plain", "--seed", "4", str(tmp_path)],
        cwd=FOLDER.parent, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert told.stdout.strip() == str(tmp_path / "spec.toml")


def test_oil_taken_in_at_atmospheric_density_fills_less():
    run = Run("run", "free-run", "A", 2.0, ((1.0, 0.2), (2.0, 0.0)))
    still = motion(replace(Rig(), intake=True), run).values(0.9)
    assert still["pressure"] > 0.0
    assert still["stroke"] < motion(Rig(), run).values(0.9)["stroke"]

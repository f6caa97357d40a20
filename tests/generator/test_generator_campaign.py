"""Campaigns as files: formats, codes, seeds, and that the generator stands alone."""

import ast
import csv
import json
import sys
import tomllib
from datetime import datetime, timedelta
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from rigid.generator import Conditions, Piece, campaign, draw
from rigid.generator.__main__ import main
from rigid.generator.campaign import slow_codes
from rigid.generator.sensors import Sensor, unit_noise
from rigid.generator.simulate import simulate

ROOT = Path(__file__).parents[2]
STEPS = {"Load": 0.295, "Stroke": 0.22, "Press": 5 * 6894.757293168e-5}  # kN, mm, bar
SLOW_FILES = [f"frame-{i}.dat" for i in (1, 2, 3)] + [f"free-run-{i}.dat" for i in (1, 2, 3)]
FAST_FILES = ["release-1.csv", "release-2.csv"]
RECORD_FILES = [*SLOW_FILES, *FAST_FILES, "field-1.dat"]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    out = tmp_path_factory.mktemp("campaign")
    return out, campaign(7, out)


def toa5(path: Path) -> dict[str, list[str]]:
    with path.open(newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0][0] == "TOA5"
    assert {len(row) for row in rows[1:]} == {len(rows[1])}
    return dict(zip(rows[1], map(list, zip(*rows[4:], strict=True)), strict=True))


def accelerations(path: Path) -> np.ndarray:
    return np.loadtxt(path, delimiter=",", comments=";")


def test_every_slow_reading_is_a_whole_code(made):
    out, _ = made
    for name in [*SLOW_FILES, "field-1.dat"]:
        table = toa5(out / name)
        for column in list(table)[2:]:
            codes = np.array(table[column], float) / STEPS[column.split("_")[0]]
            # the last printed digit is a part in 5e3 of a step, or finer
            assert np.abs(codes - np.rint(codes)).max() < 2e-4, (name, column)


def test_columns_are_those_of_the_cylinders(made):
    out, _ = made
    stamps, a, b = (
        ["TIMESTAMP", "RECORD"],
        *([f"{quantity}_{cylinder}" for quantity in STEPS] for cylinder in "AB"),
    )
    assert list(toa5(out / "frame-1.dat")) == stamps + a
    assert list(toa5(out / "frame-2.dat")) == stamps + b
    for name in ("free-run-1.dat", "field-1.dat"):
        assert list(toa5(out / name)) == stamps + a + b


def test_rows_are_stamped_and_counted_as_by_a_cr6(made):
    out, truth = made
    following = None
    for name in [*SLOW_FILES, "field-1.dat"]:
        table = toa5(out / name)
        stamps = table["TIMESTAMP"]
        assert not [s for s in stamps if "." in s and s[-1] == "0"]
        assert min(map(len, stamps)) == len("2018-03-12 09:30:00")
        seconds = [datetime.fromisoformat(s.ljust(22, "0") if "." in s else s) for s in stamps]
        assert {b - a for a, b in pairwise(seconds)} == {timedelta(milliseconds=10)}
        numbers = np.array(table["RECORD"], int)
        assert (np.diff(numbers) == 1).all()
        assert following in (None, numbers[0])
        following = numbers[-1] + 1
        duration = next(r.duration for r in truth.runs if r.name == Path(name).stem)
        assert len(numbers) == round(100 * duration) + 1


def test_release_is_quiet_then_rings(made):
    out, truth = made
    for name in FAST_FILES:
        rows = accelerations(out / name)
        assert rows.shape == (400, 4)
        assert (rows[:, 1:] == np.rint(rows[:, 1:])).all()
        times = rows[:, 0] - rows[0, 0]
        np.testing.assert_allclose(times, np.arange(400) / 1600, atol=1.5e-6)
        run = next(r for r in truth.runs if r.name == Path(name).stem)
        before = times < run.release_time
        known = truth.parameters()[f"release_time[{run.name},A]"]
        np.testing.assert_array_equal(before, rows[:, 0] < known)
        assert 0.02 <= run.release_time <= 0.04
        z = rows[:, 3] * 200 * 9.80665 / 32768
        noise = 6 * truth.sensors["acceleration,A"].noise
        assert np.abs(z[before]).max() < noise + 0.3
        # eq. (3) at the release, with at most a sample's time gone since
        assert 0.5 < z[~before][0] / (run.preload / truth.rig.mass_plunger) < 1.05
        assert np.abs(rows[:, 1:3]).max() * 200 * 9.80665 / 32768 < noise + 0.3


def test_same_seed_same_bytes(made, tmp_path):
    out, _ = made
    campaign(7, tmp_path)
    names = sorted(p.name for p in out.iterdir())
    assert names == sorted(p.name for p in tmp_path.iterdir())
    for name in names:
        assert (out / name).read_bytes() == (tmp_path / name).read_bytes(), name


def test_other_seed_other_records_and_no_field_no_change(made, tmp_path):
    out, _ = made
    campaign(7, tmp_path / "short", field=False)
    campaign(8, tmp_path / "other", field=False)
    for name in [*SLOW_FILES, *FAST_FILES]:
        assert (out / name).read_bytes() == (tmp_path / "short" / name).read_bytes()
        assert (out / name).read_bytes() != (tmp_path / "other" / name).read_bytes()
    assert not list((tmp_path / "short").glob("*field*"))


def test_specs_name_the_records_and_not_the_truth(made):
    out, truth = made
    specs = {p.stem: p.read_text() for p in out.glob("*.toml")}
    assert set(specs) == {"calibration", "constant-mu"}
    for text in specs.values():
        assert "truth" not in text
        spec = tomllib.loads(text)
        assert spec["simulated"] is True
        assert {record["file"] for record in spec["records"]} == set(RECORD_FILES)
        stated = [(r["name"], r["kind"], r["cylinder"]) for r in spec["records"]]
        assert stated == [(r.name, r.kind, r.cylinder) for r in truth.runs]
        for record, run in zip(spec["records"], truth.runs, strict=True):
            assert (out / record["file"]).is_file()
            stated = [(s.get("until"), s["position"]) for s in record.get("valve", [])]
            known = [(s.until, s.position) for s in run.valve]
            assert [p for _, p in stated] == [p for _, p in known if len(known) > 1]
            assert [u for u, _ in stated[:-1]] == [u for u, _ in known[:-1]]
    model = tomllib.loads(specs["constant-mu"])["model"]
    assert model["vary"] == {"mu": "kind"}
    memory = tomllib.loads(specs["calibration"])["model"]["effects"]
    assert memory == [*model["effects"], "frequency-dependent-friction"]


def test_truth_file_holds_the_draws(made):
    out, truth = made
    stored = json.loads((out / "truth.json").read_text())
    assert stored["parameters"]["k_LC"] == truth.rig.k_LC
    assert (
        stored["parameters"]["kappa[free-run-2,A]"]
        > 0
        > stored["parameters"]["kappa_tank[frame-1,A]"]
    )
    assert stored["parameters"]["mu"] == truth.friction.mu_inf
    assert stored["parameters"]["noise[load,A]"] == truth.sensors["load,A"].noise
    mu = truth.friction.coefficient(80.0)
    i = stored["frequency"].index(80.0)
    assert stored["mu_omega"][i] == pytest.approx(mu.real)
    assert stored["k_omega"][i] == pytest.approx(-2 * np.pi * 80.0 * mu.imag)
    assert len(stored["sensors"]) == 7


def test_true_ice_load_is_what_the_load_cell_feels(made):
    out, truth = made
    ice = np.load(out / "truth-field-1.npz")
    table = toa5(out / "field-1.dat")
    assert ice["rate_Hz"] == 1000
    for cylinder in "AB":
        load = 1e3 * np.array(table[f"Load_{cylinder}"], float)
        given = ice[f"ice_load_{cylinder}"][::10]
        stroke = 1e-3 * np.array(table[f"Stroke_{cylinder}"], float)
        plate = ice[f"plate_displacement_{cylinder}"][::10]
        assert given.max() == pytest.approx(load.max(), abs=3e3)
        assert given.min() == 0.0
        # gain, zero, noise and step of the cell; the rig's inertia counts in the drops alone
        assert np.quantile(np.abs(load - given), 0.9) < 5 * 100 + 3 * 225 + 3e-3 * given.max()
        sag = given / truth.rig.k_LC  # the cylinder gives way by this, eq. (6) and (8)
        assert np.quantile(np.abs(stroke - sag - plate), 0.9) < 1.5e-3


@pytest.mark.parametrize("seed", [7, 21, 22])
def test_pressures_stay_positive(seed: int):
    truth = draw(seed)
    for run in truth.runs:
        if run.kind in {"frame", "free-run", "field"}:
            pressure = simulate(truth, run).values["pressure"]
            # a valve shut on a free cylinder lets the pressure die out to nothing but rounding
            assert pressure.min() > -20.0, run.name
        if run.kind == "frame":
            load = simulate(truth, run).values["load"]
            assert 190e3 < load.max() < 270e3
            assert 0.08 < load[-1] / load.max() < 0.32


def test_readings_scatter_by_noise_and_rounding():
    truth = draw(7, field=False)
    run = next(r for r in truth.runs if r.kind == "frame")
    _, values = simulate(truth, run)
    for (channel, cylinder), codes in slow_codes(truth, run).items():
        sensor = truth.sensors[f"{channel},{cylinder}"]
        rest = codes * sensor.step - sensor.gain * values[channel] - sensor.zero
        expected = sensor.noise**2 + sensor.step**2 / 12  # rounding adds a uniform error
        # 6 standard errors of a variance, doubled: at a quarter of a step the error is not uniform
        assert np.var(rest) == pytest.approx(expected, rel=12 * np.sqrt(2 / codes.size))


def test_a_converter_rounds_to_the_nearest_step():
    sensor = Sensor(gain=2.0, zero=0.5, noise=0.0, step=0.2)
    assert sensor.codes(np.array([0.0, 1.0]), np.ones(2)).tolist() == [2, 12]


def lag_one(noise: np.ndarray) -> float:
    return float(np.mean(noise[1:] * noise[:-1]) / np.mean(noise**2))


def test_noise_can_be_coloured():
    size = 20_000
    white, red = (unit_noise(np.random.default_rng(1), size, c) for c in (0.0, 0.6))
    error = 5 / np.sqrt(size)  # five standard errors of a correlation near none, wide for 0.6
    assert abs(lag_one(white)) < error
    assert abs(lag_one(red) - 0.6) < error
    spread = 5 * np.sqrt(2 / size * (1 + 0.36) / (1 - 0.36))
    assert np.var(red) == pytest.approx(1.0, rel=spread)
    assert abs(lag_one(white) - 0.6) > error  # white noise would be found out


def test_coloured_campaign_changes_the_slow_records_alone(made, tmp_path):
    out, _ = made
    truth = campaign(7, tmp_path, field=False, conditions=Conditions(noise_correlation=0.5))
    assert truth.noise_correlation == 0.5
    assert (out / "frame-1.dat").read_bytes() != (tmp_path / "frame-1.dat").read_bytes()
    assert (out / "release-1.csv").read_bytes() == (tmp_path / "release-1.csv").read_bytes()
    with pytest.raises(ValueError, match="has to lie in"):
        campaign(7, tmp_path, conditions=Conditions(noise_correlation=1.0))


def test_hidden_pieces_are_named_in_the_truth_alone(made, tmp_path):
    out, _ = made
    truth = campaign(7, tmp_path, field=False, conditions=Conditions(hidden=(Piece(),)))
    assert [secret.name for secret in truth.hidden] == ["Piece"]
    assert (out / "frame-1.dat").read_bytes() == (tmp_path / "frame-1.dat").read_bytes()
    assert "Piece" not in (tmp_path / "calibration.toml").read_text()


def test_population_has_the_stated_spreads():
    truths = [draw(seed, field=False) for seed in range(200)]
    error = 5 / np.sqrt(2 * len(truths))  # five standard errors of a standard deviation
    laws = {
        "k_LC": [np.log(t.rig.k_LC / 6e7) / np.log(1.15) for t in truths],
        "tau_1": [np.log(t.friction.tau_1 / 0.2) / np.log(1.3) for t in truths],
        "k_oil": [(t.rig.k_oil / 2e9 - 1) / 0.05 for t in truths],
        "zero": [t.sensors["pressure,B"].zero / 0.25e5 for t in truths],
        "gain": [(t.sensors["load,A"].gain - 1) / 1e-3 for t in truths],
        "noise": [np.log(t.sensors["load,A"].noise / 147.5) / np.log(1.15) for t in truths],
    }
    for name, standard in laws.items():
        assert np.std(standard) == pytest.approx(1.0, abs=error), name
        assert abs(np.mean(standard)) < 5 / np.sqrt(len(truths)), name


def test_the_generator_stands_alone():
    allowed = {"numpy", "scipy"} | sys.stdlib_module_names
    for path in (ROOT / "rigid" / "generator").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                assert node.level == 0, path
                names = [f"{node.module}.{alias.name}" for alias in node.names]
            for name in names:
                alone = name.startswith("rigid.generator.") or name.split(".")[0] in allowed
                assert alone, f"{path.name} imports {name}"
                assert not name.startswith("scipy") or name.startswith("scipy.integrate.")


def test_shipped_campaign_is_what_its_command_makes(tmp_path, capsys):
    data, fits = tmp_path / "data" / "reference", tmp_path / "fits"
    arguments = ["--seed", "2018", "--out", str(data), "--specs", str(fits)]
    assert main(arguments) == 0
    assert capsys.readouterr().out == ""
    for spec in fits.iterdir():
        assert spec.read_text() == (ROOT / "fits" / spec.name).read_text()
    shipped = ROOT / "data" / "reference"
    assert {p.name for p in data.iterdir()} == {p.name for p in shipped.iterdir()}
    assert sum(p.stat().st_size for p in shipped.iterdir()) < 1e6
    for name in [*SLOW_FILES, "field-1.dat"]:
        new, old = toa5(data / name), toa5(shipped / name)
        for column in list(new)[2:]:
            # another processor's last bits may tip a reading on the edge of a step, no more
            tipped = np.array(new[column], float) != np.array(old[column], float)
            assert tipped.mean() < 2e-3


def test_command_refuses_what_makes_no_sense(tmp_path, capsys):
    for arguments in (["--noise-correlation", "1.5"], ["--seed", "-1"]):
        with pytest.raises(SystemExit) as stop:
            main(["--seed", "1", "--out", str(tmp_path / "x"), *arguments])
        assert stop.value.code == 2
        assert "allowed" in capsys.readouterr().err
    assert not (tmp_path / "x").exists()


@pytest.mark.slow
def test_command_says_so_where_a_cause_does_not_reach_its_strength(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("rigid.generator.strength.MOST_TRIALS", 0)
    with pytest.raises(SystemExit) as stop:
        main(["--seed", "1", "--out", str(tmp_path / "x"), "--hide", "pump-ripple"])
    assert stop.value.code == 2
    assert "does not reach a strength of 8.0" in capsys.readouterr().err
    assert not (tmp_path / "x").exists()

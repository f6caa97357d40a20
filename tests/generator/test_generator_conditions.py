"""Records that are not as the sheets have them, hidden causes in files, and the command's flags."""

import json
from dataclasses import replace

import numpy as np
import pytest
from short import FRAME, short_truth

from rigid.generator import Conditions, campaign
from rigid.generator.__main__ import main
from rigid.generator.campaign import drawn, release_counts, slow_codes
from rigid.generator.conditions import NULLS, under
from rigid.generator.draw import stream
from rigid.generator.hidden import hide
from rigid.generator.sensors import spikes
from rigid.generator.simulate import simulate


def codes(conditions: Conditions, channel: str) -> tuple[np.ndarray, np.ndarray]:
    """Codes of a channel of the frame, as the population has them and under conditions."""
    truth = short_truth()
    changed = under(replace(truth, noise_correlation=conditions.noise_correlation), conditions)
    return tuple(slow_codes(t, FRAME)[channel, "A"] for t in (truth, changed))


def test_usual_conditions_change_nothing():
    truth = short_truth()
    assert under(truth, Conditions()) == truth


def test_noise_can_be_louder_than_the_sheet_says():
    truth = short_truth()
    loud = under(truth, NULLS["noise-level"])
    assert {s.noise / truth.sensors[n].noise for n, s in loud.sensors.items()} == {2.0}
    ideal = simulate(truth, FRAME).values["load"]
    sensor = truth.sensors["load,A"]
    read = slow_codes(loud, FRAME)["load", "A"] * sensor.step
    expected = (2.0 * sensor.noise) ** 2 + sensor.step**2 / 12
    spread = 6 * np.sqrt(2 / read.size)  # six standard errors of a variance
    assert np.var(read - sensor.reading(ideal)) == pytest.approx(expected, rel=spread)


def test_a_converter_can_have_another_step():
    usual, coarse = codes(NULLS["adc-step"], "load")
    assert np.abs(2 * coarse - usual).max() <= 1
    assert np.ptp(coarse) < 0.51 * np.ptp(usual)


def test_outliers_hit_their_share_of_the_samples():
    usual, hit = codes(Conditions(outliers=0.05), "load")
    moved = np.abs(hit - usual) >= 2  # six times a noise of half a step, less rounding
    share = 0.05
    assert abs(moved.mean() - share) < 4 * np.sqrt(share / moved.size)
    np.testing.assert_array_equal(hit[~moved], usual[~moved])
    sizes = np.abs(spikes(np.random.default_rng(1), 10_000, 0.5))
    assert sizes[sizes > 0].min() >= 6.0
    truth = under(short_truth(), Conditions(outliers=0.05))
    run = truth.runs[2]
    assert np.any(release_counts(truth, run) != release_counts(short_truth(), run))


def test_a_gauge_can_be_at_the_end_of_its_range():
    usual, flat = codes(NULLS["saturation"], "pressure")
    top = flat.max()
    assert top < usual.max()
    np.testing.assert_array_equal(flat, np.minimum(usual, top))
    np.testing.assert_array_equal(*codes(NULLS["saturation"], "load"))


def test_a_loose_solver_errs_below_the_noise():
    truth = short_truth()
    tight, loose = (simulate(truth, FRAME, (), t).values for t in (1e-9, 1e-5))
    sensor = truth.sensors["load,A"]
    off = np.abs(loose["load"] - tight["load"]).max()
    assert 1e-3 * sensor.noise < off < sensor.noise
    usual, other = codes(NULLS["loose-solver"], "load")
    assert 0 < np.mean(usual != other) < 0.5


def test_conditions_out_of_bounds_are_refused():
    for wrong in ({"outliers": 1.0}, {"saturated": -0.1}, {"noise_factor": 0.0}):
        with pytest.raises(ValueError, match="it has to"):
            Conditions(**wrong)


def test_what_is_hidden_stands_in_the_truth_alone(tmp_path):
    truth = drawn(7, field=False)
    cause = hide("valve-event", stream(7, "hidden", "valve-event"), truth.runs)
    campaign(7, tmp_path, field=False, conditions=Conditions(hidden=(cause,), outliers=0.01))
    stored = json.loads((tmp_path / "truth.json").read_text())
    (told,) = stored["hidden"]
    assert (told["name"], told["equation"]) == ("valve-event", "pump")
    assert told["records"] == [f"{cause.record},{cause.cylinder}"]
    assert told["parameters"]["start"] == cause.start
    assert told["strength"] is None
    assert stored["flaws"]["outliers"] == 0.01
    assert "valve-event" not in (tmp_path / "calibration.toml").read_text()


def test_the_command_writes_flawed_records(tmp_path, capsys):
    for name in ("one", "two"):
        arguments = ["--seed", "7", "--out", str(tmp_path / name), "--no-field", "--hide", "none"]
        assert main([*arguments, "--condition", "outliers", "--condition", "adc-step"]) == 0
    capsys.readouterr()
    names = sorted(p.name for p in (tmp_path / "one").iterdir())
    for name in names:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    stored = json.loads((tmp_path / "one" / "truth.json").read_text())
    assert stored["hidden"] == []
    assert stored["flaws"]["outliers"] == NULLS["outliers"].outliers
    assert stored["sensors"]["load,A"]["step"] == 590.0


def test_the_command_refuses_what_it_does_not_know(tmp_path, capsys):
    for arguments in (
        ["--hide", "friction"],
        ["--condition", "fog"],
        ["--strength", "0"],
        ["--hide", "none", "--hide", "clock-offset"],
    ):
        with pytest.raises(SystemExit) as stop:
            main(["--seed", "1", "--out", str(tmp_path / "x"), *arguments])
        assert stop.value.code == 2
    assert "name it alone" in capsys.readouterr().err
    assert not (tmp_path / "x").exists()


@pytest.mark.slow
def test_the_command_hides_at_a_strength(tmp_path, capsys):
    flags = ["--seed", "7", "--no-field", "--strength", "5", "--hide", "load-cell-drift"]
    assert main([*flags, "--hide", "stroke-sensor-lag", "--out", str(tmp_path)]) == 0
    capsys.readouterr()
    stored = json.loads((tmp_path / "truth.json").read_text())["hidden"]
    assert [told["name"] for told in stored] == ["load-cell-drift", "stroke-sensor-lag"]
    truth = drawn(7, field=False)
    causes = []
    for told in stored:
        assert told["strength"] == pytest.approx(5.0, rel=0.05)
        assert told["equation"] == "sensor"
        cause = hide(told["name"], stream(7, "hidden", told["name"]), truth.runs)
        causes.append(cause.of(told["parameters"]["amplitude"]))
        assert causes[-1].parameters() == told["parameters"]
    # the same causes hidden by hand give the same bytes
    again = tmp_path / "again"
    campaign(7, again, field=False, conditions=Conditions(hidden=tuple(causes)))
    for path in [p for p in again.iterdir() if p.name != "truth.json"]:
        assert path.read_bytes() == (tmp_path / path.name).read_bytes()

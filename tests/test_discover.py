"""The command of discovery on simulated campaigns with something hidden in them, or nothing."""

import json
import tomllib
from pathlib import Path

import pytest

from rigid import discover as command
from rigid.generator import Conditions, campaign
from rigid.generator.campaign import drawn
from rigid.generator.conditions import secret
from rigid.generator.draw import stream
from rigid.generator.hidden import hide
from rigid.generator.strength import at_strength, ground
from rigid.io.cli import Options
from rigid.io.errors import InputError
from rigid.spec import load_spec

CLOCK = 1
CANDIDATES = (
    "hose-pressure-drop", "clock-offset", "load-cell-drift", "free-root-plate", "constant-force",
    "effective-area", "stroke-sensor-lag",
)  # fmt: skip
"""All steady, so that one program does."""


def made(folder: Path, seed: int, name: str | None) -> Path:
    """Spec of a campaign in which `name` is hidden at strength 8."""
    conditions, secrets = Conditions(clock=CLOCK), None
    if name is not None:
        truth = drawn(seed, conditions, field=False)
        cause = hide(name, stream(seed, "hidden", name), truth.runs)
        cause, strength = at_strength(ground(truth), cause, 8.0)
        conditions = Conditions(clock=CLOCK, hidden=(cause,))
        secrets = (secret(truth, cause, strength),)
    campaign(seed, folder, field=False, conditions=conditions, secrets=secrets)
    path = folder / "calibration.toml"
    listed = "".join(f'    "{one}",\n' for one in CANDIDATES)
    text = path.read_text("ascii").replace("[model]\n", f"[model]\ncandidates = [\n{listed}]\n", 1)
    path.write_text(text, "ascii")
    return path


def told(path: Path, capsys) -> dict:
    """What the command says of a spec; the JSON on standard output is the file's."""
    out = path.parent / "out"
    given = Options(spec=str(path), out=out, seed=1, resume=False, quiet=True, as_json=True)
    assert command.discover(given) == 0
    found = json.loads((out / "discovery.json").read_text("utf-8"))
    assert found == json.loads(capsys.readouterr().out)
    assert "Simulated data" in (out / "index.html").read_text("utf-8")
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "name", "verdict"),
    [
        (810_000, None, "nothing-missing"),
        (810_001, "hose-pressure-drop", "named"),
        (810_002, "gauge-jump", "unnamed"),
    ],
)
def test_verdict(seed: int, name: str | None, verdict: str, tmp_path: Path, capsys):
    path = made(tmp_path, seed, name)
    found = told(path, capsys)
    assert found["verdict"] == verdict
    assert found["gap"]["floor"] == 1.0
    if name is None:
        assert found["steps"] == []
        assert {one["effect"] for one in found["rejected"]} == set(CANDIDATES)
        return
    where = found["steps"][0]["where"]
    assert where["channel"] == "pressure"
    truth = json.loads((tmp_path / "truth.json").read_text("utf-8"))["hidden"][0]
    assert f"{where['record']},{where['cylinder']}" in truth["records"]
    if verdict != "named":
        assert found["steps"][0]["effect"] is None
        return
    step = found["steps"][0]
    assert (step["effect"], where["equation"]) == (name, "sensor")
    assert step["probability"] > 0.8
    low, high = (step["parameters"]["R_hose"][q] for q in ("q05", "q95"))
    # The hidden drop has a part in q^2 beside R q: up to some tenths more than its coefficient.
    assert 0.5 * low < truth["parameters"]["amplitude"] < 1.2 * high
    assert step["gap"]["elpd_difference"] > 0.0
    assert step["gap"]["after"] < step["gap"]["before"]
    extended = load_spec(Path(step["spec"]))
    assert extended.model.effects[-1] == name
    assert [r.file.resolve() for r in extended.records] == [
        r.file.resolve() for r in load_spec(path).records
    ]


def test_unknown_candidates_are_refused(tmp_path: Path):
    campaign(810_003, tmp_path, field=False, conditions=Conditions(clock=CLOCK))
    path = tmp_path / "calibration.toml"
    text = path.read_text("ascii").replace("[model]\n", '[model]\ncandidates = ["hose-drop"]\n', 1)
    path.write_text(text, "ascii")
    assert tomllib.loads(text)["model"]["candidates"] == ["hose-drop"]
    given = Options(
        spec=str(path), out=tmp_path / "out", seed=1, resume=False, quiet=True, as_json=True
    )
    with pytest.raises(InputError, match=r"hose-drop.*did you mean"):
        command.discover(given)
    assert not (tmp_path / "out").exists()

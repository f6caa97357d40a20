"""docs/tutorial: its files come from the generator, and what it says is what the commands say."""

import contextlib
import io
import json
from pathlib import Path

import pytest
import small_campaign

from rigid.check import main as check
from rigid.fit import main as fit

TUTORIAL = Path(__file__).parents[1] / "docs" / "tutorial"
SPEC = TUTORIAL / "my-rig.toml"
TEXT = (TUTORIAL / "index.md").read_text("utf-8")
SEED = 21


def test_its_files_are_simulated_and_made_by_the_generator(tmp_path):
    small_campaign.make(tmp_path, SEED)
    made = {path.name: path.read_bytes() for path in tmp_path.glob("measured/*/*")}
    assert made == {path.name: path.read_bytes() for path in (TUTORIAL / "measured").iterdir()}


def test_it_prints_the_spec_and_what_the_check_says():
    spec = SPEC.read_text("utf-8")
    assert f"```toml\n{spec}```" in TEXT
    assert "simulated = true" in spec
    told = io.StringIO()
    with contextlib.redirect_stdout(told):
        assert check([str(SPEC), "--quiet"]) == 0
    block = told.getvalue().split("\n\n")[1]
    assert len(block.splitlines()) == 4
    assert f"```text\n{block}\n```" in TEXT


@pytest.mark.slow
def test_it_prints_what_the_fit_finds_and_the_truth_lies_there(tmp_path):
    assert fit([str(SPEC), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    found = json.loads((tmp_path / "out" / "result.json").read_text("utf-8"))["parameters"]
    truth = small_campaign.make(tmp_path / "made", SEED)["parameters"]
    for name in ("k_LC", "mu"):
        row = next(line for line in TEXT.splitlines() if line.startswith(f"{name} "))
        printed, one = float(row.split()[2 if name == "k_LC" else 3]), found[name]
        # Two runs of 2,000 effective draws differ by 0.03 sds; other Pythons have other draws.
        assert abs(one["median"] - printed) < 0.2 * one["sd"], name
        # 1 in 16,000 of true values lie farther out; the seed is fixed.
        assert abs(one["median"] - truth[name]) < 4.0 * one["sd"], name

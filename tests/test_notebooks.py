"""The notebooks of docs/notebooks run from the first cell to the last and say what they show."""

import json
import os
from pathlib import Path

import matplotlib as mpl
import pytest

NOTEBOOKS = Path(__file__).parents[1] / "docs" / "notebooks"

pytestmark = pytest.mark.slow


def run(name: str) -> dict:
    """Run the code cells of a notebook one after the other; return its names."""
    mpl.use("agg")
    cells = json.loads((NOTEBOOKS / f"{name}.ipynb").read_text("utf-8"))["cells"]
    names: dict = {}
    for number, cell in enumerate(cells):
        if cell["cell_type"] == "code":
            text = "".join(cell["source"])
            exec(compile(text, f"{name}.ipynb, cell {number}", "exec"), names)
    return names


@pytest.mark.long
def test_the_spring_is_found_to_harden(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = run("spring")
    assert not names["fit"].usable
    assert names["found"].verdict == "named"
    assert names["better"].usable
    drawn = names["better"].calibrated.values
    for label, value in names["truth"].items():
        assert abs(drawn[label].mean() - value) < 4.0 * drawn[label].std(), label


@pytest.mark.skipif("RIGID_SHARED" not in os.environ, reason="RIGID_SHARED names no measured data")
def test_the_carriage_is_found_to_rub(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = run("carriage")
    assert not names["fit"].usable
    assert names["found"].steps[0]["effect"] == "coulomb-friction"

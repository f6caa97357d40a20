"""Adding a figure to a report is one file: put into a section's folder of a copy of the package."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FIGURE = '''"""How far the readings of every channel reach."""

from collections.abc import Iterator

import numpy as np

from rigid.plots.figure import Drawn
from rigid.plots.style import BLUE, house_style, new_figure
from rigid.report.content import CalibrationContent

PLACE = "fit"


def drawn(content: CalibrationContent) -> Iterator[Drawn]:
    """One bar a channel, in units of its first reading's rounding."""
    reach = np.array([np.ptp(one.data) for one in content.fits])
    names = [f"{one.record} {one.quantity}" for one in content.fits]
    with house_style():
        figure = new_figure(3.0, content.simulated)
        axes = figure.add_subplot()
        axes.barh(np.arange(len(reach)), np.log10(reach), color=BLUE)
        axes.set_xlabel("log reach [1]")
        axes.set_ylabel("channel [1]")
    caption = "Reach of the readings of every channel, from the lowest to the highest."
    numbers = {"channel": np.array(names), "reach [SI]": reach}
    yield Drawn("reach", figure, caption, "Bars: the reach of the readings by channel", numbers)
'''
PROGRAM = """
import sys
from pathlib import Path

sys.path.insert(0, "tests")
import fake_calibration as fake

from rigid.report.calibration.section import KIND
from rigid.report.section import write_report

write_report(KIND, fake.calibration(), Path("out"))
"""


def run(folder: Path, *arguments: str) -> None:
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-4000:]


@pytest.mark.slow
def test_a_figure_is_one_file(tmp_path: Path):
    for folder in ("rigid", "tests", "docs"):
        ignored = shutil.ignore_patterns("__pycache__", "*.jsonl", "studies", "benchmarks")
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=ignored)
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    (tmp_path / "rigid/report/calibration/figures/reach.py").write_text(FIGURE, "utf-8")
    run(tmp_path, "-c", PROGRAM)
    page = (tmp_path / "out" / "index.html").read_text("utf-8")
    assert page.count("Reach of the readings of every channel") == 1
    assert page.index('id="calibration-fit"') < page.index('id="fig-calibration-reach"')
    assert page.index('id="fig-calibration-reach"') < page.index('id="calibration-records"')
    written = {path.suffix for path in (tmp_path / "out/figures").glob("calibration-reach.*")}
    assert written == {".svg", ".pdf", ".png", ".csv"}
    table = (tmp_path / "out/figures/calibration-reach.csv").read_text("utf-8").splitlines()
    assert table[0] == "channel,reach [SI]"
    assert len(table) == 1 + 10
    names = ("test_plots.py", "test_architecture.py")
    tests = [f"tests/{name}" for name in names]
    chosen = "reach or keeps_to_its_architecture"
    run(tmp_path, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", "-k", chosen, *tests)

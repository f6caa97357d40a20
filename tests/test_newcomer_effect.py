"""Adding an effect is one file: the example of docs/own-effects.md, put into rigid/effects/."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
CHECKS = "oil-shear or every_name or page_says or pushes or keeps_to_its_architecture"


@pytest.mark.slow
def test_an_effect_is_one_file(tmp_path: Path):
    for folder in ("rigid", "tests", "docs", "fits", "data"):
        ignored = shutil.ignore_patterns("__pycache__", "*.jsonl", "studies", "benchmarks")
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=ignored)
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    page = (ROOT / "docs" / "own-effects.md").read_text("utf-8")
    [code] = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    (tmp_path / "rigid" / "effects" / "oil_shear.py").write_text(code, "utf-8")
    tests = [f"tests/test_{name}.py" for name in ("effects", "catalogue", "motion", "architecture")]
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-n",
            "0",
            "-p",
            "no:cacheprovider",
            "-k",
            CHECKS,
            *tests,
        ],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-4000:]
    found = subprocess.run(
        [sys.executable, "-m", "rigid.effects"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert "## oil-shear" in found.stdout

"""Adding a kind of record is one file in rigid/kinds/."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

KIND = '''
"""A cylinder pressed in the frame and left to creep."""

from typing import ClassVar

from rigid.kinds.base import Contact, RecordKind


class Relaxation(RecordKind):
    """The frame is compressed and the load let go down by itself."""

    name: ClassVar[str] = "relaxation"
    words: ClassVar[str] = "a relaxation"
    contact: ClassVar[Contact] = "frame"
'''

PROGRAM = """
import sys
from rigid.io.runtime import prepare
prepare()
import numpy as np
from pathlib import Path
from rigid.io.errors import InputError
from rigid.kinds import KINDS
from rigid.likelihood.assemble import assemble
from rigid.likelihood.problem import log_density
from rigid.records.read import read_records
from rigid.spec import load_spec

def density(path):
    spec = load_spec(path)
    spec = spec.model_copy(update={"records": spec.records[:1]})
    problem = assemble(spec, read_records(spec))
    return float(log_density(problem, np.zeros((1, problem.parameters.size)))[0])

here = Path("fits/calibration.toml")
text = here.read_text()
assert text.index('kind = "frame"') < text.index('kind = "release"')
Path("fits/new.toml").write_text(text.replace('kind = "frame"', 'kind = "relaxation"', 1))
Path("fits/odd.toml").write_text(text.replace('kind = "frame"', 'kind = "relaxatoin"', 1))
assert KINDS["relaxation"].words == "a relaxation"
old, new = density(here), density(Path("fits/new.toml"))
assert np.isfinite(new) and new == old, (old, new)
try:
    load_spec(Path("fits/odd.toml"))
except InputError as error:
    assert "relaxation" in str(error), error
else:
    raise AssertionError("an unknown kind was taken")
"""


@pytest.mark.slow
def test_a_record_kind_is_one_file(tmp_path: Path):
    """A kind that says of itself what a frame says has the same log-posterior, to the last bit."""
    for folder in ("rigid", "fits", "data"):
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=ignored)
    (tmp_path / "rigid" / "kinds" / "relaxation.py").write_text(KIND, "utf-8")
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-4000:]

"""The examples of docs/library.md, run in order."""

import re
from pathlib import Path

import matplotlib as mpl
import pytest
from test_study import write_cart

DOCUMENT = Path(__file__).parents[1] / "docs" / "library.md"
EXAMPLES = re.findall(r"<!-- example -->\n```python\n(.*?)```", DOCUMENT.read_text("utf-8"), re.S)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    write_cart(tmp_path)
    monkeypatch.chdir(tmp_path)
    mpl.use("agg")
    return tmp_path


# ArviZ warns of what so few blocks must show.
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:Estimated shape parameter of Pareto:UserWarning")
def test_the_examples_run(folder):
    assert len(EXAMPLES) >= 4
    names = {}
    for number, text in enumerate(EXAMPLES, start=1):
        exec(compile(text, f"docs/library.md, example {number}", "exec"), names)
    assert names["study"].names == ("M_Pl", "mu", "noise[force,A]")
    assert float(names["skewed"]["to-and-fro,A"]["force"][5]) == pytest.approx(
        1.01 * float(names["study"].simulate({})["to-and-fro,A"]["force"][5]), rel=1e-9
    )
    assert (folder / "cart-results" / "posterior.nc").is_file()


def test_every_name_of_the_package_stands_in_the_document():
    import rigid

    text = DOCUMENT.read_text("utf-8")
    missing = [name for name in rigid.__all__ if not re.search(rf"\b{name}\b", text)]
    assert not missing

"""`python -m rigid.paper`: files, page and status of a whole run without the fit."""

import csv
import json
import re

import pytest

from rigid import paper
from rigid.published.walk import walk as walking
from rigid.published.walk.numbers import read_numbers

FIGURES = (3, 4, 6, 8, 9, 10, 11, 12)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("paper")
    assert paper.main(["--no-fit", "--quiet", "--out", str(out)]) == 0
    return out


@pytest.mark.slow
def test_result_has_every_item_and_none_is_left_unexplained(folder):
    made = json.loads((folder / "result.json").read_text("utf-8"))
    names = [item["name"] for item in made["items"]]
    assert set(read_numbers()) < set(names)
    assert {f"equation-{n}" for n in range(2, 24)} < set(names)
    assert made["usable"] is True
    assert all(item["explained"] for item in made["items"])
    deviation = next(item for item in made["items"] if item["name"] == "load_deviation")
    assert deviation["verdict"] == "differs"
    assert deviation["computed"] == pytest.approx(100.9 / 300e3, rel=2e-3)  # tests/test_paper.py
    frame = next(item for item in made["items"] if item["name"] == "figure-6-stroke")
    # F (1/k_LC + 1/k_frame) less what the toe, 5 % longer than the slack, leaves at once.
    assert frame["computed"] == pytest.approx(250e3 / 60e6 + 0.875e-3, abs=0.1e-3)


@pytest.mark.slow
def test_page_has_every_equation_figure_and_erratum_and_stands_alone(folder):
    page = (folder / "index.html").read_text("utf-8")
    for number in range(2, 24):
        assert f'id="paper-equation-{number}"' in page
    for number in FIGURES:
        assert f'id="fig-paper-figure-{number}"' in page
    assert page.count("<math ") == 23  # (14) has its definitions below it
    assert not re.search(r'<script|src="|<link', page)
    targets = set(re.findall(r'href="#([^"]+)"', page))
    assert targets <= set(re.findall(r'id="([^"]+)"', page))


@pytest.mark.slow
def test_figures_are_files_with_their_numbers_and_say_where_they_are_simulated(folder):
    for number in FIGURES:
        assert (folder / "figures" / f"paper-figure-{number}.svg").stat().st_size > 5000
        text = (folder / "figures" / f"paper-figure-{number}.csv").read_text("utf-8")
        rows = list(csv.reader(text.splitlines()))
        assert len(rows) > 10
        assert all("[" in head for head in rows[0])
    page = (folder / "index.html").read_text("utf-8")
    for number in (6, 8, 9, 10, 11, 12):
        caption = re.search(rf"Fig\. {number} of the paper[^<]*Simulated", page)
        assert caption, number


@pytest.mark.slow
def test_a_number_broken_on_purpose_gives_status_1(folder, tmp_path, monkeypatch, capsys):
    numbers = read_numbers()
    broken = numbers | {"mu_release": numbers["mu_release"].misprinted(5.2e3)}
    monkeypatch.setattr(walking, "read_numbers", lambda: broken)
    assert paper.main(["--no-fit", "--quiet", "--out", str(tmp_path)]) == 1
    assert "differ without a reason" in capsys.readouterr().err
    made = json.loads((tmp_path / "result.json").read_text("utf-8"))
    assert made["usable"] is False
    assert "✗" in (tmp_path / "index.html").read_text("utf-8")

"""The command on published numbers, with few points: its files, its refusals."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from rigid.fit import fit
from rigid.inference.posterior import load_posterior
from rigid.io.cli import Options
from rigid.io.errors import InputError
from rigid.published import evidence, inference, run
from rigid.published.catalogue import STORIES
from rigid.spec import find_spec, load_spec

PAPER = Path(__file__).parents[1] / "fits" / "paper.toml"
SPEC = load_spec(find_spec(str(PAPER)))
KEPT = ("constant", "locked", "root")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Folder of a short run of two stories, and what it returned."""
    folder = tmp_path_factory.mktemp("paper")
    with pytest.MonkeyPatch.context() as patch:
        for name, value in {"FIRST": 1024, "ROUND": 512, "SIZE": 64, "MOST_ROUNDS": 3}.items():
            patch.setattr(evidence, name, value)
        patch.setattr(evidence, "LEARNED", 256)
        patch.setattr(inference, "BLOCK", 512)
        patch.setattr(run, "DRAWS", 100)
        patch.setattr("rigid.report.published.output.DRAWS", 100)
        kept = tuple(s for s in STORIES if s.key in KEPT)
        patch.setattr(run, "STORIES", kept)
        patch.setattr("rigid.report.published.output.STORIES", kept)
        options = Options("paper", folder, 3, resume=False, quiet=True, as_json=False)
        return folder, fit(options)


@pytest.mark.slow
def test_the_files_are_those_of_the_contract(made):
    folder, status = made
    assert status in (0, 1)
    assert {"index.html", "posterior.nc", "summary.csv", "result.json"} <= {
        p.name for p in folder.iterdir()
    }


@pytest.mark.slow
def test_the_result_names_each_story_under_both_priors(made):
    found = json.loads((made[0] / "result.json").read_text("utf-8"), parse_constant=pytest.fail)
    assert found["simulated"] is False
    assert set(found["stories"]) == {"catalogue", "indifferent"}
    for stories in found["stories"].values():
        assert set(stories) == set(KEPT)
        for story in stories.values():
            assert story["assumes"]
            assert story["decides"]
            assert sum(story["causes"].values()) == pytest.approx(1.0)
            assert sum(story["branches"].values()) == pytest.approx(1.0)
    rows = list(csv.DictReader((made[0] / "summary.csv").read_text("utf-8").splitlines()))
    assert [r["name"] for r in rows] == list(found["parameters"])
    assert {"k_LC[catalogue,root]", "inverse_M_root[indifferent,root]"} <= set(found["parameters"])


@pytest.mark.slow
def test_the_posterior_has_a_story_dimension(made):
    tree = load_posterior(made[0] / "posterior.nc")
    draws = tree["posterior"]
    assert draws["k_LC"].dims == ("chain", "draw", "prior", "story")
    assert np.isnan(draws["inverse_M_root"].sel(story="constant")).all()
    assert np.isfinite(draws["inverse_M_root"].sel(story="root")).all()
    assert tree["evidence"]["log_evidence"].shape == (2, len(KEPT))


@pytest.mark.slow
def test_the_page_says_what_it_rests_on(made):
    page = (made[0] / "index.html").read_text("utf-8")
    assert "Root plate free" in page
    assert "section Calibration experiments, text on fig. 8" in page
    assert "simulated data" not in page.lower().replace("nothing is simulated data", "")


def test_a_spec_with_records_and_published_numbers_is_refused(tmp_path):
    text = PAPER.read_text("utf-8") + (
        '\n[[records]]\nname = "a"\nkind = "frame"\nfile = "a.csv"\n'
        'channels = { time = { column = 1, unit = "s" }, load = { column = 2, unit = "N" } }\n'
    )
    file = tmp_path / "both.toml"
    file.write_text(text, "utf-8")
    options = Options(str(file), tmp_path / "out", 1, resume=False, quiet=True, as_json=False)
    with pytest.raises(InputError, match="one or the other"):
        fit(options)
    assert not (tmp_path / "out").exists()


def test_a_number_without_its_place_is_refused(tmp_path):
    lines = PAPER.read_text("utf-8").splitlines()
    lines.remove('place = "eq. (18)"')
    file = tmp_path / "short.toml"
    file.write_text("\n".join(lines), "utf-8")
    with pytest.raises(InputError, match="place"):
        load_spec(file)

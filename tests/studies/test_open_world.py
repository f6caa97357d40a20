"""The study of the open world: its campaigns and its page."""

import json
import sys

import open_world
import pytest
from open_world import FIRST_SEED, cases, origin, truths
from open_world_page import page
from rows import OneCode, lines_of
from second_simulator import POPULATIONS
from second_simulator.campaign import SHAPES


def test_every_population_has_campaigns_of_its_own_number():
    listed = list(cases(3, []))
    assert len({case.number for case in listed}) == 3 * len(POPULATIONS)
    assert {case.seed for case in listed} == {FIRST_SEED + i for i in range(3)}
    first = [case.seed % SHAPES for case in listed[: len(POPULATIONS)]]
    assert len(set(first)) == 1  # so that compiled programs serve again
    assert {case.population for case in cases(2, ["plain"])} == {"plain"}
    assert [case.seed for case in cases(2, ["plain"], 5)] == [5, 6]


def test_a_stopped_study_has_whole_rounds_and_goes_on(tmp_path, monkeypatch):
    asked: list[tuple[str, int]] = []
    code = ["one"]

    def one(case, discover, starts):
        asked.append((case.population, case.seed))
        if len(asked) == 3:
            raise KeyboardInterrupt
        said = {"verdict": "refused", "steps": [], "says": "no", "status": 2}
        told = {
            "nearest": None,
            "hidden": [],
            "truth": [],
            "core_s": 1.0,
            "made_s": 1.0,
            "answer": said,
        }
        return {"case": case._asdict()} | told

    def run(*words: str) -> str:
        start = ["open_world.py", "--discover", "--out", str(tmp_path / "open"), *words]
        monkeypatch.setattr(sys, "argv", start)
        open_world.main()
        return (tmp_path / "open_discovery.md").read_text("utf-8")

    monkeypatch.setattr(open_world, "one", one)
    monkeypatch.setattr(open_world, "commit", lambda: code[0])
    monkeypatch.setattr("rows.commit", lambda: code[0])
    monkeypatch.setattr("rows.committed", lambda: {"one": "2026-01", "two": "2026-02"}[code[0]])
    monkeypatch.setattr("rigid.io.runtime.prepare", lambda: None)
    ask = ("--campaigns", "2", "--only", "plain", "hum", "--first-seed", "5")
    with pytest.raises(KeyboardInterrupt):
        run(*ask)
    text = run(*ask)
    assert asked == [("plain", 5), ("hum", 5), ("plain", 6), ("plain", 6), ("hum", 6)]
    assert "4 campaigns, 2 whole rounds over 2 populations" in text
    assert "--campaigns 2 --first-seed 5 --starts 16 --only plain hum`, code of one" in text
    code[0] = "two"  # what another code has said is no answer of this one
    text = run(*ask, "--part", "1/2")
    assert asked[5:] == [("hum", 5), ("hum", 6)]
    assert "code of two of 2026-02: 2 campaigns, 0 whole rounds" in text
    assert "left out: 4 of one" in text
    assert "code of one of" in run(*ask, "--table", "--commit", "one")
    assert "No campaign" in run("--table")  # seeds of development are no part of that study
    kept = lines_of(tmp_path.glob("open/*"))
    assert {row["first_seed"] for row in kept} == {5}
    assert str(tmp_path) not in json.dumps(kept)


def test_seeds_of_development_are_told():
    assert "for development" in origin(FIRST_SEED)
    assert "Seeds are from 5 on" in origin(5)


def test_truths_take_friction_with_memory_together():
    rig = {
        "k_LC": 6e7, "k_oil": 2e9, "mu": 1e4, "mu_branch": [9e4, 1e4], "tau_branch": [0.1, 1e-3],
    }  # fmt: skip
    run = {"name": "run-1", "cylinder": "A", "valve": [[1.0, 0.2], [2.0, 0.0]], "strap": None}
    known = truths({"rig": rig, "runs": [run]})
    assert known["kappa[run-1,A]"] == 0.2
    assert 1.09e5 < known["abs_mu[0.01 Hz]"] < 1.1e5
    assert known["abs_mu[80 Hz]"] < 2.1e4


def test_the_page_keeps_populations_apart_and_tells_refusals():
    entry = {"median": 1.1, "sd": 0.1, "q05": 0.9, "q95": 1.3, "truth": 1.0}
    names = ("k_LC", "k_oil", "mu", "abs_mu[0.01 Hz]", "abs_mu[80 Hz]", "kappa[run-1,A]")
    table = dict.fromkeys((*names, "release_time[snap-1,A]"), entry)
    answer = {
        "usable": False, "gap": 1.2, "parameters": table,
        "checks": [["residuals", False, "large"]],
        "channels": [{"record": "snap-1,A", "quantity": "acceleration", "gap": 3.0, "lag_1": 0.1,
                      "largest": [[0.04, 60.0]], "without_largest": 1.0}],
    }  # fmt: skip
    row = {
        "case": {"number": 0, "population": "plain", "seed": 7}, "commit": "abc", "scale": 1.02,
        "starts": 16, "straps": [], "answer": answer, "nearest": None,
    }  # fmt: skip
    refused = row | {
        "case": {"number": 1, "population": "hum", "seed": 7},
        "answer": {"refused": "too short\nmore"},
    }
    text = page(OneCode([row, refused], "abc", "", {"old": 2}), "Seeds of a test.")
    assert "code of abc. 2 rows of other commits are left out." in text
    assert "| plain | 1 of 1 | 16 | 0 | 1.200-1.200 | 1 of 1, +1.0 |" in text
    assert "residuals" in text
    assert "refused: too short" in text
    assert "+60.0 at 0.0400 s" in text

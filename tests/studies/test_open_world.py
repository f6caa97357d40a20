"""The study of the open world: its campaigns and its page."""

import json
import sys

import open_world
import pytest
from open_world import FIRST_SEED, cases, origin, truths
from open_world_page import held, page
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


ENTRY = {"median": 1.1, "sd": 0.1, "q05": 0.9, "q95": 1.3, "truth": 1.0}
MISSED = ENTRY | {"median": 1.4, "q05": 1.2, "q95": 1.6}


def fit(number: int, population: str, usable: bool = True, parameters: dict | None = None) -> dict:
    names = ("k_LC", "k_oil", "mu", "abs_mu[0.01 Hz]", "abs_mu[80 Hz]", "kappa[run-1,A]")
    table = dict.fromkeys((*names, "kappa[run-1,B]", "release_time[snap-1,A]"), ENTRY)
    answer = {
        "usable": usable, "gap": 1.2, "parameters": table | (parameters or {}),
        "checks": [["residuals", usable, "large"]],
        "channels": [{"record": "snap-1,A", "quantity": "acceleration", "gap": 3.0, "lag_1": 0.1,
                      "largest": [[0.04, 60.0]], "without_largest": 1.0}],
    }  # fmt: skip
    return {
        "case": {"number": number, "population": population, "seed": 7}, "commit": "abc",
        "scale": 1.25, "starts": 16, "straps": [], "answer": answer, "nearest": None,
        "core_s": 20.0, "command": "study --of fits",
    }  # fmt: skip


def test_the_page_keeps_populations_apart_and_tells_refusals():
    refused = fit(1, "hum") | {"answer": {"refused": "too short\nmore"}}
    rows = [fit(0, "plain", usable=False), refused, fit(2, "jitter")]
    text = page(OneCode(rows, "abc", "2026-12-01T", {"old": 2}), "Seeds of a test.")
    assert "`study --of fits`, code of abc of 2026-12-01. 2 rows of other commits" in text
    assert "| plain | 1 of 1 | 0 | 1.200-1.200 | 100.00 | residuals | 20 |" in text
    assert "| plain | 0 |" + " - |" * 8 in text  # what is not usable holds nothing
    assert "| jitter | 1 | 100 (1.00) |" in text
    assert "refused: too short" in text
    assert text.count("+60.0 at 0.0400 s") == 2


def test_coverage_counts_campaigns_and_the_share_of_what_they_have_several_of():
    """Of 20 campaigns 15 to 20 hold the truth where 90 % do, in 95 % of the cases."""
    rows = [fit(i, "plain", parameters={"k_LC": MISSED}) for i in range(6)]
    rows += [fit(i, "plain", parameters={"kappa[run-1,B]": MISSED}) for i in range(6, 20)]
    for column, share, distance, inside in (
        ("k_LC", 0.7, ((6 * 16 + 14) / 20) ** 0.5, False),
        ("mu", 1.0, 1.0, True),
        ("kappa", (6 + 14 * 0.5) / 20, ((6 + 14 * (1 + 16) / 2) / 20) ** 0.5, False),
        # with the truth's pump the truth is 1.25: 1.1 is 1.5 sds below it, and 1.4 as far above
        ("kappa q", 1.0, 1.5, True),
    ):
        found = held(rows, column)
        assert found is not None
        assert (found.of, found.inside) == (20, inside)
        assert (found.share, found.distance) == pytest.approx((share, distance))
    assert held([], "mu") is None
    text = page(OneCode(rows, "abc", "", {}), "")
    assert "| plain | 20 | **70 (2.35)** | 100 (1.00) |" in text
    assert "2 of 8 shares lie outside" in text

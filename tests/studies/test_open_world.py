"""The study of the open world: its campaigns and its page."""

from open_world import FIRST_SEED, cases, truths
from open_world_page import page
from second_simulator import POPULATIONS
from second_simulator.campaign import SHAPES


def test_every_population_has_campaigns_of_its_own_number():
    listed = list(cases(3, []))
    assert len({case.number for case in listed}) == 3 * len(POPULATIONS)
    assert {case.seed for case in listed} == {FIRST_SEED + i for i in range(3)}
    first = [case.seed % SHAPES for case in listed[: len(POPULATIONS)]]
    assert len(set(first)) == 1  # so that compiled programs serve again
    assert {case.population for case in cases(2, ["plain"])} == {"plain"}


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
        "straps": [], "answer": answer, "nearest": None,
    }  # fmt: skip
    refused = row | {
        "case": {"number": 1, "population": "hum", "seed": 7},
        "answer": {"refused": "too short\nmore"},
    }
    text = page([row, refused], [])
    assert "| plain | 1 of 1 | 0 | 1.200-1.200 | 1 of 1, +1.0 |" in text
    assert "residuals" in text
    assert "refused: too short" in text
    assert "+60.0 at 0.0400 s" in text

"""The study of friction laws: its mixture, what it masks, its scores and its page."""

import dataclasses
import json
import math
from collections import Counter

import laws as study
import numpy as np
import pytest
from discovery_scores import TOLD_APART
from laws import FIRST_SEED, LAWS, Case, cases, kept, left_of_it
from laws_page import (
    chance,
    deviations,
    first,
    first_or_tied,
    log_scores,
    page,
    strictly_first,
    told_apart,
)

from rigid.friction.models import COULOMB, MEMORY, NAMES, SEAL, STRIBECK, VISCOUS
from rigid.generator import Conditions
from rigid.generator.campaign import drawn
from rigid.generator.strength import ground

COSINES = {
    "names": [law for law in LAWS if law != VISCOUS],
    "cosines": [[1.0 if a == b else 0.99 if {a, b} == {COULOMB, STRIBECK} else 0.2
                 for b in LAWS if b != VISCOUS] for a in LAWS if a != VISCOUS],
}  # fmt: skip


def answer(p: dict[str, float], tied: tuple[str, ...] = (), verdict: str = "law") -> dict:
    first = max(p, key=p.__getitem__)
    told = [
        {"law": n, "probability": p.get(n, 0.0), "elpd_difference": -6.0 * (n != first),
         "elpd_expected": -4.0, "elpd_error": 2.0}
        for n in NAMES
    ]  # fmt: skip
    return {"first": first, "tied": list(tied), "verdict": verdict, "laws": told,
            "processor_s": 1.0}  # fmt: skip


def row(law: str, strength: float, three: dict, one: dict | None = None) -> dict:
    answers = {"three": three} | ({"one": one} if one else {})
    return {
        "case": Case(0, law, strength)._asdict(), "seed": FIRST_SEED, "answers": answers,
        "strengths": {"three": strength, "one": 1.0}, "commit": "x",
    }  # fmt: skip


def test_laws_and_strengths_take_turns():
    listed = cases("issue")
    counts = Counter((case.law, case.strength) for case in listed)
    assert counts[COULOMB, 8.0] == counts[COULOMB, 5.0] == 25
    assert counts[VISCOUS, 0.0] == 50
    assert {case.law for case in listed[: len(LAWS)]} == set(LAWS)
    assert min(case.seed for case in listed) == FIRST_SEED > max(study.LOOKALIKE_SEEDS)


def test_one_setting_keeps_all_but_the_other_free_runs():
    assert kept("frame", "frame-2")
    assert kept("free-run", "free-run-2")
    assert not kept("free-run", "free-run-3")


@pytest.mark.slow
def test_fewer_records_leave_less_of_a_cause():
    """Those that stay give what a ground of them alone does."""
    truth = drawn(FIRST_SEED - 1, Conditions(clock=1, memory=False), field=False)
    names = ("free-run-2", "free-run-3")
    truth = dataclasses.replace(truth, runs=tuple(r for r in truth.runs if r.name in names))
    on = ground(truth)
    cause = study.hide(COULOMB, np.random.default_rng(1), truth.runs)
    alone = dataclasses.replace(
        truth, runs=tuple(r for r in truth.runs if kept(r.kind, r.name))
    )  # fmt: skip
    few = ground(alone)
    assert left_of_it(on, cause) == pytest.approx(few.strength(few.trace(cause)), rel=1e-3)
    assert left_of_it(on, cause) < on.strength(on.trace(cause))


def test_scores_tell_right_from_wrong():
    right = row(SEAL, 8.0, answer({SEAL: 0.9, COULOMB: 0.1}))
    tied = row(SEAL, 8.0, answer({COULOMB: 0.9, SEAL: 0.1}, (SEAL,), "cannot-tell"))
    wrong = row(SEAL, 8.0, answer({COULOMB: 1.0}))
    assert [first(r) for r in (right, tied, wrong)] == [True, False, False]
    assert [first_or_tied(r) for r in (right, tied, wrong)] == [True, True, False]
    assert [strictly_first(r) for r in (right, tied, wrong)] == [True, False, False]
    assert chance(wrong, "three") == 0.0
    stated, flat = log_scores([right])
    assert stated == pytest.approx(-math.log(0.9))
    assert flat == pytest.approx(-math.log(0.7 * 0.9 + 0.3 / 6))
    assert log_scores([wrong])[0] > log_scores([wrong])[1]
    np.testing.assert_allclose(deviations([right]), -1.0)
    assert len(deviations([wrong])) == 0


def test_what_can_be_told_apart():
    """From constant friction by half the strength; from a law of cosine c by s sqrt((1 - c)/2)."""
    seal = answer({SEAL: 1.0})
    assert told_apart(row(SEAL, 2.1 * TOLD_APART, seal), COSINES)
    assert not told_apart(row(SEAL, 1.9 * TOLD_APART, seal), COSINES)
    assert not told_apart(row(COULOMB, 8.0, answer({COULOMB: 1.0})), COSINES)
    assert not told_apart(row(VISCOUS, 0.0, answer({VISCOUS: 1.0})), COSINES)


def test_the_page_counts_what_it_says():
    rows = [row(SEAL, 8.0, answer({SEAL: 0.9, COULOMB: 0.1}))] * 9
    rows += [row(SEAL, 8.0, answer({COULOMB: 1.0}))]
    rows += [row(MEMORY, 5.0, answer({MEMORY: 0.6, VISCOUS: 0.4}, (VISCOUS,), "cannot-tell"),
                 answer({VISCOUS: 0.6, MEMORY: 0.4}, (MEMORY,), "cannot-tell"))]  # fmt: skip
    text = page(rows, COSINES, 24, "small")
    assert "| true law first, or tied | 10 of 11 | 91 % |" in text
    assert "| strictly first, where it can be told apart | 9 of 11 | 82 % |" in text
    assert "| its probability below 5 % | 1 of 11 | 9 % |" in text
    assert "| hidden: `cannot-tell` | 1 of 1 | 100 % |" in text
    assert "11 of 24" in text
    assert "Laws not reached: constant viscous, Coulomb, Stribeck, LuGre." in text
    assert page([], COSINES, 24, "small")  # nothing yet


def test_it_goes_on_where_it_stopped(tmp_path, monkeypatch):
    asked = []

    def one(case, twice):
        assert twice
        asked.append(case.seed)
        return row(case.law, case.strength, answer({case.law: 1.0})) | {"case": case._asdict()}

    out = tmp_path / "laws"
    out.mkdir()
    (out / "lookalikes.json").write_text(json.dumps(COSINES))
    monkeypatch.setattr(study, "one_campaign", one)
    monkeypatch.setattr(study, "cases", lambda size: cases(size)[:2])
    monkeypatch.setattr("sys.argv", ["laws.py", "--out", str(out)])
    assert study.main() == 0
    assert study.main() == 0
    monkeypatch.setattr("sys.argv", ["laws.py", "--out", str(out), "--part", "1/2"])
    assert study.main() == 0
    assert asked == [FIRST_SEED, FIRST_SEED + 1]
    assert "2 of 2" in (tmp_path / "laws.md").read_text()

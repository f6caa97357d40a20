"""Discovery in the open world: measures on made-up rows, and the page."""

import json
from pathlib import Path

import numpy as np
import pytest
from discovery_scores import known_from, upper
from open_world_discovery import page
from open_world_scores import (
    MET,
    MISSED,
    OPEN,
    Judged,
    added,
    judged,
    least_p,
    standing,
    stated,
    uniform,
)
from open_world_truth import EQUATIONS, KINDS, acting, alike
from rows import OneCode
from scipy.stats import binom
from second_simulator import POPULATIONS

from rigid.effects.base import EQUATIONS as EVERY
from rigid.generator.hidden import HIDDEN

STORED = json.loads(
    (Path(__file__).parents[2] / "docs/studies/discovery/lookalikes.json").read_text("utf-8")
)
KNOWN = known_from(STORED)
LEAK, SHUT = "piston-leakage", "shut-valve-leakage"  # twins: a cosine of 0.997


def step(effect: str | None, p: float, after: float = 0.9, elpd: float = 5.0, **more) -> dict:
    gap = {"before": 1.0, "after": after, "elpd_difference": elpd} if effect else None
    where = {"record": "run-1", "channel": "pressure", "equation": "oil-balance"}
    return {"effect": effect, "probability": p, "gap": gap, "where": where, **more}


def answer(verdict: str, *steps: dict, p: float = 0.5, **more) -> dict:
    return {
        "status": 0, "verdict": verdict, "steps": list(steps), "p_value": p,
        "gap": {"initial": 1.0, "final": 0.9}, "checks": [],
        "disagreements": [{"p_value": 0.9}, {"p_value": 0.4}],
        "probabilities": {s["effect"] or "unnamed": s["probability"] for s in steps[:1]}
        or {"nothing": 0.7},
    } | more  # fmt: skip


NOTHING = answer("nothing-missing")
REFUSED = {"verdict": "refused", "steps": [], "says": "a|b\nmore", "status": 2}


def row(population: str, said: dict, seed: int = 7) -> dict:
    made, number = POPULATIONS[population], 1000 * list(POPULATIONS).index(population) + seed
    truth = []
    if made.nearest or population in EQUATIONS:
        truth = [{"equation": "oil-balance", "records": ["press-1"]}]
    return {
        "case": {"number": number, "population": population, "seed": seed},
        "nearest": made.nearest, "hidden": [{}] * bool(made.hidden), "truth": truth,
        "answer": said, "core_s": 100.0 + seed, "made_s": 5.0,
        "command": "python x", "commit": "abc",
    }  # fmt: skip


def of(population: str, *said: dict) -> list[Judged]:
    return judged([row(population, one, seed) for seed, one in enumerate(said)], KNOWN)


def test_what_is_right_follows_the_truth():
    assert of("plain", NOTHING)[0].right == {"nothing"}
    assert of("intake-density", NOTHING)[0].right == {"pump-slip"}
    assert of("tight-place", NOTHING)[0].right == {"unnamed"}
    assert of("orifice", NOTHING)[0].right == {LEAK, SHUT}
    assert of("clock", NOTHING)[0].right == {"clock-offset"}
    assert alike(KNOWN, "of no table") == {"of no table"}


def test_every_population_says_where_its_cause_acts():
    runs = [{"name": kind, "kind": kind} for kind in ("frame", "free-run", "release")]
    assert set(KINDS) | set(EQUATIONS) <= set(POPULATIONS)
    for name, made in POPULATIONS.items():
        assert made.nearest is None or made.nearest in HIDDEN
        told = acting({"population": name, "nearest": made.nearest, "runs": runs})
        hides = bool(made.nearest or made.hidden)
        assert len(told) == hides
        for one in told:
            assert one["equation"] in EVERY
            assert one["records"]
    told = acting({"population": "slack", "nearest": "seating-slack", "runs": runs})
    assert told == [{"equation": "contact", "records": ["frame"]}]


def test_a_failed_check_and_a_refusal_are_right_in_nothing():
    quiet, unusable, refused = of("plain", NOTHING, NOTHING | {"status": 1}, REFUSED)
    assert (quiet.quiet, quiet.rightly) == (True, True)
    assert (unusable.quiet, unusable.rightly, unusable.unusable) == (False, False, True)
    assert (refused.quiet, refused.rightly, refused.lost) == (False, False, True)
    assert not any(one.alarmed for one in (quiet, unusable, refused))
    [alarm] = of("plain", answer("unnamed", step(None, 0.9), status=1))
    assert alarm.alarmed  # whatever the checks say
    heard = [one.heard for one in (quiet, unusable, refused, alarm)]
    assert heard == [True, False, False, True]  # what says nothing makes no share smaller
    assert not alarm.found
    [right] = of("orifice", answer("named", step(LEAK, 0.99), status=1))
    assert (right.found, right.rightly, right.in_equation) == (False, False, False)


def test_the_name_of_what_acts_is_no_false_alarm():
    named = answer("named", step("sample-averaging", 0.91))
    both = answer("named", step("sample-averaging", 0.91), step("clock-offset", 0.95))
    [acts, more] = of("release-on-a-sample", named, both)
    assert (acts.alarmed, acts.truly, acts.falsely, acts.misnamed) == (True, True, False, False)
    assert (more.truly, more.falsely, more.misnamed) == (False, True, True)
    [elsewhere] = of("plain", named)
    assert (elsewhere.truly, elsewhere.falsely, elsewhere.misnamed) == (False, True, True)


def test_names_are_right_by_nearest_or_by_twin():
    exact, twin, wrong, among = of(
        "orifice",
        answer("named", step(LEAK, 0.95)),
        answer("named", step(SHUT, 0.95)),
        answer("named", step("clock-offset", 0.95)),
        answer("indistinguishable", step("hose-pressure-drop", 0.5, alternatives=[
            {"effect": SHUT, "probability": 0.3}])),
    )  # fmt: skip
    assert [one.rightly for one in (exact, twin, wrong, among)] == [True, True, False, False]
    assert [one.by_twin for one in (exact, twin, wrong, among)] == [False, True, False, False]
    assert [one.misnamed for one in (exact, twin, wrong, among)] == [False, False, True, False]
    assert [one.among for one in (exact, twin, wrong, among)] == [False, False, False, True]
    assert (exact.in_equation, exact.in_record) == (True, False)
    later = answer("named", step(LEAK, 0.95), step("pump-ripple", 0.9))
    assert of("orifice", later)[0].misnamed  # a wrong name in any step
    assert not of("orifice", answer("named", step("pump-ripple", 0.89)))[0].misnamed


def test_outside_the_catalogue_a_confident_name_is_no_flag():
    unnamed, doubtful, sure, nothing = of(
        "tight-place",
        answer("unnamed", step(None, 0.9)),
        answer("named", step("pump-ripple", 0.85)),
        answer("named", step("pump-ripple", 0.91)),
        NOTHING,
    )
    assert [j.flagged for j in (unnamed, doubtful, sure, nothing)] == [True, True, False, False]
    assert [j.rightly for j in (unnamed, doubtful, sure, nothing)] == [True, False, False, False]


def test_additions_that_do_harm_are_counted():
    good, wide, worse = (
        answer("named", step(LEAK, 0.9, after, elpd))
        for after, elpd in ((1.0, 0.0), (1.0 + 1e-6, 1.0), (0.9, -1e-6))
    )
    assert added(of("orifice", good, wide, worse, NOTHING, REFUSED)) == (3, 1, 1)
    assert [one.harmed for one in of("orifice", good, wide, worse)] == [False, True, True]


@pytest.mark.parametrize(
    ("count", "total", "least", "stands"),
    [
        (0, 60, 60, MET),  # bound 4.9 %
        (1, 60, 60, MISSED),  # 7.7 %
        (0, 59, 60, OPEN),
        (59, 59, 60, OPEN),
        (0, 60, None, MET),
        (1, 60, None, OPEN),
        (7, 60, None, MISSED),  # lower bound 5.6 %
        (1, 1, None, OPEN),  # 5 % exactly
        (0, 0, None, "-"),
    ],
)
def test_a_share_stands_to_its_bar_by_its_bounds(count, total, least, stands):
    assert standing(count, total, 0.05, least) == stands


def test_a_share_at_its_bar_is_hardly_ever_met():
    """Where the share is as large as the bar, at most 5 % of studies say that it is met."""
    for total in (60, 200):
        some = range(total // 4)  # beyond, none is met and all are missed
        met = [n for n in some if standing(n, total, 0.05) == MET]
        assert binom.cdf(max(met), total, 0.05) <= 0.05
        missed = [n for n in some if standing(n, total, 0.05) == MISSED]
        assert binom.sf(min(missed) - 1, total, 0.05) <= 0.05
        assert upper(max(met), total) <= 0.05 < upper(max(met) + 1, total)


def test_uniform_p_values_stay_in_their_band():
    """95 % of uniform samples do, to 4 sds of a share of so many; doubled evidence does not."""
    assert least_p(of("plain", NOTHING, REFUSED)) == [0.4]
    assert uniform([0.25, 0.75]).distance == pytest.approx(0.25)
    rng, studies = np.random.default_rng(5), 2000
    drawn = [uniform(values) for values in rng.uniform(size=(studies, 60))]
    kept = np.mean([one.distance <= one.band for one in drawn])
    assert abs(kept - 0.95) < 4.0 * np.sqrt(0.95 * 0.05 / studies)
    skewed = [uniform(values**2) for values in rng.uniform(size=(100, 60))]
    assert np.mean([one.distance > one.band for one in skewed]) > 0.9


def test_verdicts_are_forecasts_of_names_with_their_twins():
    both = {"probabilities": {LEAK: 0.5, SHUT: 0.3, "unnamed": 0.2}}
    campaigns = [
        *of("orifice", answer("named", step(SHUT, 0.3)) | both),
        *of("orifice", answer("named", step("pump-ripple", 0.6)), NOTHING | {"status": 1}),
        *of("plain", NOTHING, REFUSED),
    ]
    probability, right = stated(campaigns, KNOWN)
    np.testing.assert_allclose(probability, [0.8, 0.6, 0.7])
    assert right.tolist() == [1.0, 0.0, 1.0]


def test_the_page_counts_what_it_says():
    rows = [row("plain", NOTHING, seed) for seed in range(60)]
    rows += [
        row("coloured", answer("named", step("pump-ripple", 0.95)), 0),
        row("jitter", REFUSED, 0),
    ]
    rows += [row("orifice", answer("named", step(name, 0.95)), i)
             for i, name in enumerate((LEAK, SHUT, "clock-offset"))]  # fmt: skip
    bad = [{"name": "residuals", "ok": False, "says": "large"}]
    rows += [row("tight-place", answer("unnamed", step(None, 0.9), status=1, checks=bad), 0)]
    code = OneCode(rows, "abc", "2026-11-27T10:00:00+00:00", {"old": 3})
    text = page(code, STORED, ["plain", "coloured"], "Seeds of a test.")
    assert "code of abc of 2026-11-27: 66 campaigns, 1 whole rounds over 2 populations" in text
    assert "left out: 3 of old." in text
    assert "| plain | 0 of 60 | 0.0 % | 0.0-4.9 % | met | 0 | 0 | 0 | 60 | 0 | 0 |" in text
    assert (
        "| coloured | 1 of 1 | 100.0 % | 5.0-100.0 % | too few to say | 0 | 1 | 1 | 0 | 0 | 0 |"
        in text
    )
    assert "| jitter | 0 of 0 | - | - | - | 0 | 0 | 0 | 0 | 0 | 1 |" in text
    assert "| orifice, in the catalogue | 2 % | 1 of 3 | 33.3 %" in text
    assert f"| orifice | {LEAK} | 3 of 3 | 100.0 % | 36.8-100.0 % | 2 of 3 | 66.7 %" in text
    assert "| tight-place | 0 of 1 | 0.0 % | 0.0-95.0 % | 0 of 1" in text
    assert "| orifice | 3 | 0 | 0 |" in text
    assert "| orifice | 3 | 101 | 102 | 5 |" in text
    assert "4 of 66 campaigns: what is said first" in text
    assert "| coloured | 0 | named | pump-ripple | 0.95 | 0.500 | 1.000, 0.900 | run-1," in text
    assert "| jitter | 0 | refused | | | | | a/b |" in text
    assert "| tight-place | 0 | unnamed, failed: residuals | unnamed | 0.90 |" in text
    assert "No campaign has been run" in page(OneCode([], "no commit", "", {}), STORED, [], "")

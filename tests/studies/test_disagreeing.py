"""The study of the p-values of disagreements: its campaigns and its page."""

from collections import Counter

from disagreeing import CLEAN, FIRST_SEED, OF_EACH, campaigns, page
from discovery_cases import FIRST_SEED as BENCHMARK
from discovery_cases import NAMES, cases

from rigid.generator.conditions import NULLS


def row(number: int, least: float, after: float | None = None) -> dict:
    return {
        "case": campaigns()[number]._asdict(),
        "verdict": "nothing-missing" if after is None else "named",
        "least": least,
        "least_after": after,
        "alone": [least / 10.0, 0.6],
        "commit": "x",
    }


def test_campaigns_are_of_all_sorts_and_have_seeds_that_no_other_study_has():
    listed = campaigns()
    counts = Counter(case.condition or case.population for case in listed)
    assert counts == {"clean": CLEAN, "single": len(NAMES)} | dict.fromkeys(NULLS, OF_EACH)
    seeds = [case.seed for case in listed]
    assert seeds == list(range(FIRST_SEED, FIRST_SEED + len(listed)))
    assert FIRST_SEED > max(case.seed for case in cases("standard")) > BENCHMARK


def test_the_page_counts_least_p_values():
    hidden = CLEAN + OF_EACH * len(NULLS)
    rows = [row(0, 0.04), row(1, 0.3), row(2, 0.9), row(CLEAN, 0.005)]
    rows += [row(hidden, 0.01, 0.5), row(hidden + 1, 0.2)]
    rows += [{"case": rows[0]["case"], "verdict": "unreachable", "commit": "x"}]
    text = page(rows, 140)
    assert "| clean | 3 | 0 | 1 | 1 | 1 | 2 |" in text
    assert "| flawed, all | 1 | 1 | 1 | 1 | 1 | 1 |" in text
    assert "| clean | 1 of 3 | 33.3 % |" in text
    assert "Of 8 comparisons in them, 25.0 % below 0.01" in text
    assert "| as specified | 1 of 2 | 50.0 % |" in text
    assert "| with what was added | 0 of 1 | 0.0 % |" in text
    assert "7 of 140 campaigns" in text
    assert "Not looked at: 1" in text
    assert "0 of 140" in page([], 140)

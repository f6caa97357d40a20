"""The page of the ideal observer: shares, and what discovery found over them."""

import math

import pytest
from ideal_observer import beside, page

DRAWS = [
    {
        "effect": name,
        "strength": 5.0,
        "alarm": i < found,
        "p_value": 0.001,
        "first": name,
        "probability": 0.9,
        "right": i < found - 1,
    }
    for name, found in (("piston-leakage", 4), ("load-cell-drift", 2))
    for i in range(4)
]
ROWS = [{"case": {"number": 0}, "commit": "abc", "date": "2026-11-28T00:00", "draws": DRAWS}]


def single(name: str, verdict: str, strength: float = 5.0) -> dict:
    said = [] if verdict == "nothing-missing" else [{"effect": name, "probability": 0.9}]
    case = {"population": "single", "hide": [name], "strength": strength, "first": 1}
    answer = {"verdict": verdict, "steps": said}
    return {"case": case, "commit": "def", "answer": answer, "seed": 1}


def test_shares_are_those_of_the_draws():
    text = page(ROWS, 1)
    assert "8 draws" in text
    assert "| 5 | 6 of 8 | 75.0 % |" in text
    assert "4 of 8 | 50.0 % |" in text
    assert "| piston-leakage | 0, 0 of 0 | 4, 3 of 4 | 0, 0 of 0 |" in text


def test_what_discovery_found_stands_over_what_the_observer_finds():
    """Three of four over three quarters is 1, and a line that is searched does not count."""
    rows = [single("piston-leakage", "named") for _ in range(3)]
    rows += [single("piston-leakage", "nothing-missing"), single("pump-ripple", "named")]
    text = beside(DRAWS, rows)
    error = math.sqrt(0.75 * 0.25 / 4 / 0.75**2 + 0.75**2 * 0.25 / 8 / 0.75**3)
    assert f"| 5 | 3 of 4 | 1.00 ± {error:.2f} | 3 of 4 | 1.50" in text
    assert "code of def" in text
    assert error == pytest.approx(0.35, abs=0.01)

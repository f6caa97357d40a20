"""How names turned out: the counts of made-up rows, and the file that the package reads."""

import json
from itertools import pairwise

from discovery_scores import known_from
from held_out import STUDIES, Said, counted, of_the_generator, of_the_second, told
from open_world_truth import CATALOGUED, COMPLETE, OUTSIDE

from rigid.report.discovery.held_out import BANDS, TOLD, turned_out

KNOWN = known_from(json.loads((STUDIES / "discovery/lookalikes.json").read_text("utf-8")))
LEAK, SHUT = "piston-leakage", "shut-valve-leakage"  # twins: a cosine of 0.997


def answer(verdict: str, effect: str | None = None, probability: float = 0.9, **more) -> dict:
    steps = [{"effect": effect, "probability": probability}] if verdict != "nothing-missing" else []
    return {"verdict": verdict, "p_value": 0.001, "status": 0, "steps": steps} | more


def benchmark(population: str, hide: list[str], said: dict) -> dict:
    return {"case": {"population": population, "hide": hide}, "answer": said}


def second(population: str, nearest: str | None, hidden: dict | None, said: dict) -> dict:
    case = {"population": population, "number": 1, "seed": 7}
    return {"case": case, "nearest": nearest, "hidden": hidden, "truth": [], "answer": said}


def test_the_file_of_the_package_is_what_the_rows_give():
    assert json.loads(TOLD.read_text("utf-8")) == told()


def test_campaigns_of_the_benchmark_are_read_by_what_is_hidden():
    rows = [
        benchmark("single", [LEAK], answer("named", LEAK)),
        benchmark("single", [LEAK], answer("indistinguishable", SHUT, 0.4)),
        benchmark("single", [LEAK], answer("named", "hose-pressure-drop", 0.7)),
        benchmark("taken out", [LEAK], answer("named", "hose-pressure-drop", 0.85)),
        benchmark("outside", ["bump"], answer("unnamed")),
        benchmark("null", [], answer("nothing-missing")),
        benchmark("behind", ["bump", LEAK], answer("named", LEAK)),
        benchmark("single", [LEAK], {"verdict": "failed", "steps": [], "status": 3}),
    ]
    assert of_the_generator(rows, KNOWN) == [
        Said(CATALOGUED, LEAK, 0.9, True),
        Said(CATALOGUED, SHUT, 0.4, True),
        Said(CATALOGUED, "hose-pressure-drop", 0.7, False),
        Said(OUTSIDE, "hose-pressure-drop", 0.85, False),
        Said(OUTSIDE, None, 0.0, False),
        Said(COMPLETE, None, 0.0, False),
    ]


def test_campaigns_of_the_second_simulator_count_where_the_run_ended_well():
    averaging = "sample-averaging"
    rows = [
        second("orifice", LEAK, {"name": "orifice"}, answer("named", LEAK)),
        second("orifice", LEAK, {"name": "orifice"}, answer("named", LEAK, status=1)),
        second("hum", None, {"name": "hum"}, answer("named", LEAK, 0.6)),
        second("plain", None, None, answer("named", LEAK, 0.6)),
        second("release-on-a-sample", None, None, answer("named", averaging, 0.6)),
    ]
    assert [(s.sort, s.right) for s in of_the_second(rows, KNOWN)] == [
        (CATALOGUED, True),
        (OUTSIDE, False),
        (COMPLETE, False),
        (COMPLETE, True),
    ]


def test_names_are_counted_by_how_sure_they_were():
    said = [
        Said(CATALOGUED, LEAK, 0.9, True),
        Said(CATALOGUED, LEAK, 0.8, False),
        Said(CATALOGUED, LEAK, 0.79, True),
        Said(CATALOGUED, None, 0.0, False),
        Said(OUTSIDE, LEAK, 0.81, False),
        Said(OUTSIDE, None, 0.0, False),
        Said(COMPLETE, LEAK, 0.2, False),
        Said(COMPLETE, LEAK, 0.2, True),
    ]
    low, middle, high = counted(said)
    assert [one["from"] for one in (low, middle, high)] == [low for low, _ in BANDS]
    assert high["listed"] == {"right": 1, "named": 2}
    assert middle["listed"] == {"right": 1, "named": 1}
    assert high["unlisted"] == {"wrong": 1, "campaigns": 2}
    assert low["nothing"] == {"wrong": 1, "campaigns": 2}


def test_every_probability_has_a_band_and_its_counts():
    assert BANDS[0][0] == 0.0
    assert BANDS[-1][1] > 1.0
    assert all(high == low for (_, high), (low, _) in pairwise(BANDS))
    assert [turned_out(p)[0] for p in (0.0, 0.5, 0.79, 0.8, 1.0)] == [
        *("less than 0.5", "0.5 to 0.8", "0.5 to 0.8"),
        *("0.8 and more", "0.8 and more"),
    ]
    for place, told_at in enumerate((0.3, 0.6, 0.9)):
        for one, stored in zip(turned_out(told_at)[1], told(), strict=True):
            band = stored["bands"][place]
            assert one.simulator == stored["simulator"]
            assert one.listed == (band["listed"]["right"], band["listed"]["named"])
            assert one.unlisted == (band["unlisted"]["wrong"], band["unlisted"]["campaigns"])
            assert one.nothing == (band["nothing"]["wrong"], band["nothing"]["campaigns"])

"""Which numbers belong to a record: each leave-one-out releases these, and no others."""

from pathlib import Path

import pytest

from rigid.likelihood.assemble import assemble
from rigid.localfit.hypothesis import Hypothesis
from rigid.records.read import read_records
from rigid.spec import load_spec
from rigid.spec.record import Stretch

FITS = Path(__file__).parents[1] / "fits"
TANKS = ((2.68, "open"), (7.04, "tank"), (8.0, "shut"), (8.99, "tank"), (float("inf"), "shut"))
"""A valve programme with two stretches to the tank."""
OWN = {
    ("frame-1,A",): {
        "kappa[frame-1,A]", "kappa_tank[frame-1,A]", "kappa_tank[frame-1,A,2]",
        "k_oil[frame-1,A]", "pump_angle[frame-1]",
    },
    ("free-run-1,A",): {"kappa[free-run-1,A]", "k_oil[free-run-1,A]"},
    ("free-run-1,A", "free-run-1,B"): {
        "kappa[free-run-1,A]", "k_oil[free-run-1,A]", "kappa[free-run-1,B]", "k_oil[free-run-1,B]",
        "pump_angle[free-run-1]",
    },
    ("free-run-2,B",): {
        "kappa[free-run-2,B]", "k_oil[free-run-2,B]", "event_size", "event_start",
        "event_duration", "event_edge",
    },
    ("release-1,A",): {
        "preload[release-1,A]", "release_time[release-1,A]", "k_oil[release-1,A]",
    },
}  # fmt: skip


@pytest.fixture(scope="module")
def model() -> Hypothesis:
    """All numbers that are a record's own, beside ones that vary by kind and by cylinder."""
    spec = load_spec(FITS / "calibration.toml")
    more = {
        "effects": (*spec.model.effects, "pump-ripple", "valve-event"),
        "vary": {"mu": "kind", "k_LC": "cylinder", "k_oil": "record"},
        "only": {"valve-event": "free-run-2,B"},
    }
    valve = tuple(Stretch.model_validate({"until": u, "position": p}) for u, p in TANKS)
    records = tuple(
        r.model_copy(update={"valve": valve}) if r.name == "frame-1" else r for r in spec.records
    )
    spec = spec.model_copy(update={"records": records, "model": spec.model.model_copy(update=more)})
    return Hypothesis(assemble(spec, read_records(spec)))


def released(model: Hypothesis, out: tuple[str, ...]) -> set[str]:
    own = model.own_of(out)
    assert own.shape == (model.size,)
    assert not own[len(model.parameters) :].any(), "sensors serve all records"
    return {label for label, mine in zip(model.labels, own, strict=False) if mine}


@pytest.mark.parametrize("out", OWN)
def test_what_is_left_out_releases_its_own_numbers_and_no_others(
    model: Hypothesis, out: tuple[str, ...]
):
    assert OWN[out] <= set(model.labels)
    assert released(model, out) == OWN[out]


def test_every_number_of_a_record_is_released_once_all_its_cylinders_are_out(model: Hypothesis):
    names = {t.name: [u.label for u in model.problem.tracks if u.name == t.name]
             for t in model.problem.tracks}  # fmt: skip
    found = [released(model, tuple(tracks)) for tracks in names.values()]
    assert sum(map(len, found)) == len(set.union(*found)) == sum(
        bool(p.record) for p in model.parameters
    )  # fmt: skip


def test_one_more_record_has_its_own_angle_of_the_pump(model: Hypothesis):
    own = {p.label for p in model.parameters if p.is_own("free-run-1", "A")}
    assert own == OWN["free-run-1,A",] | {"pump_angle[free-run-1]"}


def test_what_stands_in_brackets_alone_does_not_tell(model: Hypothesis):
    """The rule of before, a label that ends in [record,cylinder], misses three sorts of numbers."""
    told = {label for label in model.labels if label.endswith("[frame-1,A]")}
    assert OWN["frame-1,A",] - told == {"kappa_tank[frame-1,A,2]", "pump_angle[frame-1]"}

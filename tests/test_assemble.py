"""From a spec to a problem: where effects act, and what a spec may not ask for."""

from pathlib import Path

import pytest

from rigid.io.errors import InputError
from rigid.likelihood.assemble import assemble
from rigid.records.read import read_records
from rigid.spec import load_spec

EXAMPLE = Path(__file__).parents[1] / "fits" / "calibration.toml"
RECORDS = '"../data/reference/'


def problem_with(folder: Path, p_max: str = "700e5", **model: str):
    """The reference campaign under another [model] and pump."""
    text = EXAMPLE.read_text("utf-8")
    begin, end = text.index("[model]"), text.index("[channels.A]")
    table = "\n".join(f"{key} = {value}" for key, value in model.items())
    assert "[rig]" not in text
    text = text[:begin] + f"[rig]\np_max = {p_max}\n\n[model]\n{table}\n\n" + text[end:]
    path = folder / "changed.toml"
    data = EXAMPLE.parents[1] / "data" / "reference"
    path.write_text(text.replace(RECORDS, f'"{data.as_posix()}/'), "utf-8")
    spec = load_spec(path)
    return assemble(spec, read_records(spec))


def effects(*more: str) -> str:
    base = ("load-cell-spring", "oil-compressibility", "viscous-friction", "pump-curve", *more)
    return str(list(base)).replace("'", '"')


def test_an_effect_confined_to_a_record_acts_there_alone(tmp_path: Path):
    found = problem_with(
        tmp_path,
        effects=effects("coulomb-friction"),
        only='{ coulomb-friction = "free-run-2,A" }',
    )
    with_it = [g for g in found.groups if any(e.name == "coulomb-friction" for e in g.effects)]
    assert [t.label for g in with_it for t in g.tracks] == ["free-run-2,A"]
    assert sum(len(g.tracks) for g in found.groups) == 11
    assert "F_C" in found.parameters.labels


def test_an_effect_that_acts_in_one_kind_is_left_out_elsewhere(tmp_path: Path):
    found = problem_with(
        tmp_path, effects=effects("coulomb-friction"), only='{ coulomb-friction = "frame" }'
    )
    for group in found.groups:
        names = [e.name for e in group.effects]
        assert ("coulomb-friction" in names) == (group.tracks[0].kind == "frame")


@pytest.mark.parametrize(
    ("model", "says"),
    [
        (
            {"effects": effects("coulomb-friction"), "only": '{ coulomb-friction = "free-run-9" }'},
            "only coulomb-friction: unknown name 'free-run-9'",
        ),
        (
            {"effects": effects(), "only": '{ coulomb-friction = "frame" }'},
            "only: unknown name 'coulomb-friction'",
        ),
        (
            {"effects": effects("coulomb-friction", "stribeck-friction")},
            "'coulomb-friction' and 'stribeck-friction' are two laws for one thing",
        ),
    ],
)
def test_what_is_not_there_is_refused_with_a_sentence(tmp_path: Path, model, says: str):
    with pytest.raises(InputError, match=says):
        problem_with(tmp_path, **model)


def test_records_in_which_the_pump_beats_have_its_angle(tmp_path: Path):
    angles = [
        label
        for label in problem_with(tmp_path, effects=effects("pump-ripple")).parameters.labels
        if label.startswith("pump_angle")
    ]
    # Both cylinders of a free run share it; releases know nothing of the pump.
    assert sorted(angles) == sorted(
        f"pump_angle[{kind}-{i}]" for kind in ("frame", "free-run") for i in (1, 2, 3)
    )


def test_a_ripple_confined_to_a_record_asks_for_no_other_angles(tmp_path: Path):
    found = problem_with(
        tmp_path, effects=effects("pump-ripple"), only='{ pump-ripple = "frame-2,B" }'
    )
    angles = [label for label in found.parameters.labels if label.startswith("pump_angle")]
    assert angles == ["pump_angle[frame-2]"]

"""Programs are kept as they were traced, by all that they were traced from."""

import dataclasses
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rigid.effects import CATALOGUE
from rigid.effects.placed import placed
from rigid.io import compiled as kept
from rigid.io.compiled import Compiled, compiled
from rigid.io.structure import NoStructureError, named, structure
from rigid.localfit.one_of import one_of

TRACED: list[str] = []
"""Functions that were traced, in order."""


class Pair(NamedTuple):
    """What a program may return."""

    both: dict[str, jax.Array]
    fixed: float | None


class Law(eqx.Module):
    """An array and two values that programs are traced with."""

    level: jax.Array
    power: float
    name: str = eqx.field(static=True, default="usual")


@compiled
def powered(law: Law, x: jax.Array) -> Pair:
    TRACED.append("powered")
    return Pair({"up": law.level * x**law.power, "down": -x}, law.power)


@compiled
def worked_out(law: Law, x: jax.Array) -> Law:
    """Returns a module, which `jax.export` does not write."""
    return Law(law.level * x, law.power)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Where programs are kept; functions of this file count as the package's."""
    monkeypatch.setenv("RIGID_TRACINGS", "1")
    monkeypatch.setenv("RIGID_CACHE", str(tmp_path))
    for module in ("rigid.io.compiled", "rigid.io.structure"):
        monkeypatch.setattr(f"{module}.OURS", __name__.split(".")[0])
    TRACED.clear()
    for one in (powered, worked_out):
        one.forget()
    yield tmp_path
    for one in (powered, worked_out):
        one.forget()


def law(power: float = 2.0, **more: Any) -> Law:
    return Law(jnp.asarray(3.0), power, **more)


def as_in_another_process() -> None:
    """Forget what the process has, but not what the disk has."""
    powered.forget()
    jax.clear_caches()


def test_a_program_is_traced_once_and_found_by_the_next_process(folder: Path):
    x = jnp.arange(4.0)
    first = powered(law(), x)
    assert TRACED == ["powered"]
    as_in_another_process()
    again = powered(law(), x)
    assert TRACED == ["powered"]
    assert type(again) is Pair
    assert (again.fixed, list(again.both)) == (2.0, list(first.both))
    np.testing.assert_array_equal(again.both["up"], 3.0 * np.arange(4.0) ** 2)
    np.testing.assert_array_equal(again.both["down"], -np.arange(4.0))
    assert len(list(folder.glob("powered-*.kept"))) == 1


@pytest.mark.parametrize(
    ("other", "x"),
    [
        (law(3.0), jnp.arange(4.0)),
        (law(name="unusual"), jnp.arange(4.0)),
        (law(), jnp.arange(5.0)),
        (law(), jnp.arange(4)),
    ],
    ids=["a value", "a static value", "a shape", "a type"],
)
def test_whatever_a_program_is_traced_with_tells_it_apart(folder: Path, other: Law, x: jax.Array):
    powered(law(), jnp.arange(4.0))
    as_in_another_process()
    found = powered(other, x)
    assert TRACED == ["powered"] * 2
    np.testing.assert_array_equal(found.both["up"], 3.0 * np.asarray(x) ** other.power)
    assert len(list(folder.glob("powered-*.kept"))) == 2


def test_programs_of_other_code_are_traced_anew(folder: Path, monkeypatch: pytest.MonkeyPatch):
    powered(law(), jnp.arange(4.0))
    as_in_another_process()
    monkeypatch.setattr(kept, "_here", lambda: "another digest")
    powered(law(), jnp.arange(4.0))
    assert TRACED == ["powered"] * 2


def test_the_digest_is_of_all_code_and_of_settings(monkeypatch: pytest.MonkeyPatch):
    digest = kept._here.__wrapped__
    before = digest()
    assert digest() == before
    monkeypatch.setenv("EQX_ON_ERROR", "raise")
    assert digest() != before
    monkeypatch.undo()
    read = Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda p: read(p) + b" " * (p.name == "rig.py"))
    assert digest() != before


def test_nothing_is_kept_unless_a_command_runs(folder: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("RIGID_TRACINGS", "0")
    powered(law(), jnp.arange(4.0))
    assert not list(folder.glob("*.kept"))


def test_a_damaged_program_is_told_and_traced_anew(folder: Path, capsys: pytest.CaptureFixture):
    powered(law(), jnp.arange(4.0))
    (path,) = folder.glob("powered-*.kept")
    path.write_bytes(path.read_bytes()[:-9])
    as_in_another_process()
    found = powered(law(), jnp.arange(4.0))
    np.testing.assert_array_equal(found.both["up"], 3.0 * np.arange(4.0) ** 2)
    assert "damaged" in capsys.readouterr().err
    assert TRACED == ["powered"] * 2


def test_a_disk_that_takes_nothing_costs_a_tracing_and_no_more(folder: Path, monkeypatch):
    monkeypatch.setenv("RIGID_CACHE", str(folder / "file" / "inside"))
    (folder / "file").write_text("no folder")
    found = powered(law(), jnp.arange(4.0))
    np.testing.assert_array_equal(found.both["down"], -np.arange(4.0))


def test_a_result_that_cannot_be_written_down_is_left_to_equinox(folder: Path):
    found = worked_out(law(), jnp.asarray(2.0))
    assert (float(found.level), found.power) == (6.0, 2.0)
    assert not list(folder.glob("*.kept"))


def test_a_program_inside_another_is_part_of_that(folder: Path):
    slope = jax.grad(lambda x: powered(law(), x).both["up"])(2.0)
    assert float(slope) == 12.0
    assert not list(folder.glob("*.kept"))


def test_threads_that_ask_for_one_program_trace_it_once(folder: Path):
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda _: powered(law(), jnp.arange(7.0)), range(8)))
    assert TRACED == ["powered"]
    assert len(list(folder.glob("powered-*.kept"))) == 1


def test_code_of_others_is_never_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """A helper that an effect of one's own imports may change, and nothing here would see it."""
    monkeypatch.setenv("RIGID_TRACINGS", "1")
    monkeypatch.setenv("RIGID_CACHE", str(tmp_path))
    powered.forget()
    found = powered(law(), jnp.arange(4.0))
    np.testing.assert_array_equal(found.both["down"], -np.arange(4.0))
    assert not list(tmp_path.glob("*.kept"))


def told(value: Any) -> str:
    return structure(value, eqx.is_array)


def test_effects_of_the_catalogue_have_a_structure_wherever_they_act():
    for effect in CATALOGUE.values():
        assert told(effect) == f"{named(effect)} ( )"
        here, there = (told(placed(effect, place)) for place in ("boom", "arm"))
        assert here != there
    dry = tuple(CATALOGUE[f"{name}-friction"] for name in ("coulomb", "stribeck"))
    assert told(one_of(dry)) != told(one_of(dry[:1]))


def test_what_has_no_text_has_no_structure():
    class Inside:
        pass

    made = type("CoulombFriction", (), {"__module__": CATALOGUE["coulomb-friction"].__module__})
    lying = type("OneOf", (), {"made": (one_of, ((CATALOGUE["coulomb-friction"],),))})
    for value in (Inside, Inside(), lambda: None, object(), made, lying, powered._function):
        with pytest.raises(NoStructureError):
            told(value)


@dataclasses.dataclass
class Held:
    one: int


def test_a_value_that_is_held_beside_the_fields_has_no_structure(folder: Path):
    held = Held(1)
    assert told(held) == f"one of ( {named(Held)} ( ) int 1 )"
    vars(held)["more"] = 2
    with pytest.raises(NoStructureError, match="more"):
        told(held)


def test_two_values_that_compare_equal_have_two_structures():
    assert len({told(value) for value in (1, 1.0, True, "1", (1,), [1], None)}) == 7


def test_a_function_is_compiled_under_its_own_name():
    assert isinstance(powered, Compiled)
    assert powered.__name__ == "powered"

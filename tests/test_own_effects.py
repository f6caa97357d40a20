"""An effect of a user's own: a file beside the spec, named in it."""

from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from rigid.effects import CATALOGUE, State
from rigid.io.errors import InputError
from rigid.likelihood.assemble import chosen_effects
from rigid.likelihood.effect_lookup import effects_named, marks, name_in_specs
from rigid.spec import load_spec

PAGE = Path(__file__).parents[1] / "docs" / "own-effects.md"

SOURCE = '''
from typing import ClassVar

from rigid.effects import AbstractEffect, Action
from rigid.effects.declare import lognormal, parameter
from neighbour import NAME


class CubicFriction(AbstractEffect):
    """F = -c v^3."""

    coefficient: object = parameter("c_cubic", "c", "N s^3/m^3", lognormal(1e9, 10.0), absent=0.0)

    name: ClassVar[str] = NAME
    equation: ClassVar[str] = "plunger-momentum"
    source: ClassVar[str] = "a test"

    def __call__(self, state, own):
        return Action(between=-self.coefficient * state.slip**3)


class Nothing:
    pass
'''


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "mine.py").write_text(SOURCE, encoding="utf-8")
    (tmp_path / "neighbour.py").write_text('NAME = "cubic-friction"\n', encoding="utf-8")
    return tmp_path


def test_a_file_beside_the_spec_is_found(folder: Path):
    (effect,) = effects_named(["mine:CubicFriction"], folder, "spec")
    assert effect.name == "cubic-friction"
    assert effects_named(["mine.py:CubicFriction"], folder, "spec") == (effect,)
    (again,) = effects_named([f"../{folder.name}/mine.py:CubicFriction"], folder, "spec")
    assert again is effect  # a class has to be the same wherever it is named from


def test_the_name_leads_back_from_another_folder(folder: Path):
    (effect,) = effects_named(["mine:CubicFriction"], folder, "spec")
    other = folder / "reports" / "mine"
    other.mkdir(parents=True)
    name = name_in_specs(effect, other)
    assert name == "../../mine.py:CubicFriction"
    assert effects_named([name], other, "spec") == (effect,)
    coulomb = CATALOGUE["coulomb-friction"]
    assert name_in_specs(coulomb, other) == "coulomb-friction"


def test_a_chain_is_marked_with_the_file_of_such_an_effect(folder: Path):
    """So that a run is not resumed under another law of the same name."""
    effects = effects_named(["mine:CubicFriction", "coulomb-friction"], folder, "spec")
    mark = marks(effects)
    assert list(mark) == ["cubic-friction"]
    (folder / "mine.py").write_text(SOURCE + "\n# changed\n", encoding="utf-8")
    assert marks(effects)["cubic-friction"] != mark["cubic-friction"]


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("yours:Effect", "put yours.py into"),
        ("mine:Effect", "it has CubicFriction"),
        ("mine:Nothing", "no effect 'Nothing'"),
        (":Effect", "cannot import ''"),
        ("cubic-friction", "unknown name 'cubic-friction'"),
    ],
)
def test_what_is_not_there_is_said(folder: Path, name: str, says: str):
    with pytest.raises(InputError) as refusal:
        effects_named([name], folder, "spec [model] effects")
    assert str(refusal.value).startswith("spec [model] effects: ")
    assert says in str(refusal.value)


def test_a_file_that_fails_is_told_and_read_again_once_mended(folder: Path):
    (folder / "neighbour.py").write_text("NAME = 1 / 0\n", encoding="utf-8")
    (folder / "mine2.py").write_text("1 / 0\n", encoding="utf-8")
    with pytest.raises(InputError, match="fails: division by zero"):
        effects_named(["mine2:CubicFriction"], folder, "spec")
    (folder / "mine2.py").write_text(
        SOURCE.replace("from neighbour import NAME", 'NAME = "x"'), encoding="utf-8"
    )
    assert effects_named(["mine2:CubicFriction"], folder, "spec")[0].name == "x"


def test_a_name_of_the_catalogue_is_taken(folder: Path):
    (folder / "mine3.py").write_text(
        SOURCE.replace("from neighbour import NAME", 'NAME = "coulomb-friction"'), encoding="utf-8"
    )
    with pytest.raises(InputError, match="give it another name"):
        effects_named(["mine3:CubicFriction"], folder, "spec")


SPEC = """
[model]
effects = ["load-cell-spring", "oil-compressibility", "pump-curve", "mine:OilShear"]

[[records]]
name = "a"
kind = "free-run"
cylinder = "A"
file = "a.csv"
channels = { time = { column = "t", unit = "s" }, pressure = { column = "p", unit = "bar" } }
"""


def test_the_example_of_the_page_is_an_effect_of_a_spec(tmp_path: Path):
    source = PAGE.read_text(encoding="utf-8").split("```python\n")[1].split("```")[0]
    (tmp_path / "mine.py").write_text(source, encoding="utf-8")
    (tmp_path / "a.csv").write_text("t,p\n0,0\n1,0\n", encoding="utf-8")
    (tmp_path / "spec.toml").write_text(SPEC, encoding="utf-8")
    effect = chosen_effects(load_spec(tmp_path / "spec.toml"))[-1]
    slip = np.array([-2e-3, 0.0, 3e-3])
    still, speed = jnp.zeros(3), jnp.asarray(slip)
    state = State(still, still, still, speed, still, still + 0.2)
    got = effect.build({"c_shear": 1e6})(state, ()).between
    np.testing.assert_allclose(got, [4.0, 0.0, -9.0], atol=1e-12)

"""What solves an effect of a user's own: steps where diffrax says that they hold, else diffrax."""

from pathlib import Path

import numpy as np
import pytest
from rigs import frame_problem

import rigid
from rigid.inference.calibrate import fingerprint
from rigid.likelihood.groups import SlowGroup
from rigid.report.taken import sentences, taken

EFFECTS = '''
from typing import ClassVar

import jax.numpy as jnp

from rigid.effects import AbstractEffect, Action
from rigid.effects.declare import lognormal, parameter


class Smooth(AbstractEffect):
    """Friction that grows with the square of the speed."""

    size: object = parameter("c_own", "c", "N s^2/m^2", lognormal(1e6, 3.0), absent=0.0)
    name: ClassVar[str] = "smooth"
    equation: ClassVar[str] = "plunger-momentum"
    source: ClassVar[str] = "a test"

    def __call__(self, state, own):
        return Action(between=-self.size * state.slip * abs(state.slip))


class Stiff(Smooth):
    """Friction that follows the speed within ten microseconds, and faster the faster it is."""

    size: object = parameter("c_own", "c", "N s/m", lognormal(1e5, 3.0), absent=0.0)
    name: ClassVar[str] = "stiff"
    scales: ClassVar[tuple[float, ...]] = (1e-3,)

    def __call__(self, state, own):
        rate = 1e5 * (1.0 + (state.slip / 1e-3) ** 2)
        return Action(between=-self.size * own[0], rates=(rate * (state.slip - own[0]),))


class Cornered(Smooth):
    """Friction that turns round within a nanometre a second."""

    size: object = parameter("c_own", "c", "N", lognormal(3e3, 3.0), absent=0.0)
    name: ClassVar[str] = "cornered"

    def __call__(self, state, own):
        return Action(between=-self.size * jnp.tanh(state.slip / 1e-6))


class Humming(Smooth):
    """A force that swings once in a step of the steps."""

    size: object = parameter("c_own", "c", "N", lognormal(3e3, 3.0), absent=0.0)
    name: ClassVar[str] = "humming"

    def __call__(self, state, own):
        return Action(on_plunger=self.size * jnp.sin(2.0 * jnp.pi * 1600.0 * state.time))
'''

SPEC = """
[model]
effects = ["load-cell-spring", "oil-compressibility", "viscous-friction", "pump-curve", "mine:{0}"]

[[records]]
name = "frame-1"
kind = "frame"
cylinder = "A"
file = "frame.csv"
valve = [{{ until = 0.1, position = "shut" }}, {{ until = 0.45, position = "open" }},
         {{ position = "shut" }}]
[records.channels]
time = {{ column = "t", unit = "s" }}
load = {{ column = "load", unit = "N" }}
stroke = {{ column = "stroke", unit = "m" }}
pressure = {{ column = "pressure", unit = "Pa" }}

[solve]
{1}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("own")
    (path / "mine.py").write_text(EFFECTS, encoding="utf-8")
    pieces = frame_problem(60).pieces
    columns = [np.asarray(p.data)[:, 0] for p in pieces]
    rows = [
        ",".join(f"{v:.9g}" for v in (0.01 * i, *row))
        for i, row in enumerate(zip(*columns, strict=True))
    ]
    (path / "frame.csv").write_text("\n".join(["t,load,stroke,pressure", *rows]) + "\n", "utf-8")
    assert tuple(p.quantity for p in pieces) == SlowGroup.quantities
    return path


def study(folder: Path, effect: str, solve: str = "") -> rigid.Study:
    path = folder / f"{effect}{len(solve)}.toml"
    path.write_text(SPEC.format(effect, solve), encoding="utf-8")
    return rigid.load(path)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "method"),
    [
        ("Smooth", "steps"),
        ("Cornered", "diffrax"),
        ("Stiff", "diffrax"),
        ("Humming", "diffrax"),
    ],
)
def test_steps_solve_what_they_hold_for_and_diffrax_the_rest(
    folder, effect, method, capsys, monkeypatch
):
    monkeypatch.setattr("rigid.inference.solver_choice.POINTS", 3)
    asked = study(folder, effect)
    assert asked.spec.solve.method is None
    assert asked.solved.solve.method == method
    assert asked.problem.tolerance == (None if method == "steps" else 1e-8)
    assert capsys.readouterr().err == f"{asked.solved.why_solver}\n"
    assert effect.lower() in asked.solved.why_solver
    made = taken(asked.solved, asked.problem, ())
    assert made["why_solver"] == asked.solved.why_solver
    assert asked.solved.why_solver in sentences(made)[-1]
    assert fingerprint(asked.solved, asked.records, 1) != fingerprint(asked.spec, asked.records, 1)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["steps", "diffrax"])
def test_what_the_spec_says_is_not_asked(folder, method, capsys):
    asked = study(folder, "Humming", f'method = "{method}"')
    assert asked.solved is asked.spec
    assert asked.problem.tolerance == (None if method == "steps" else 1e-8)
    assert capsys.readouterr().err == ""
    assert sentences(taken(asked.solved, asked.problem, ()))[-1].startswith("Held exact")

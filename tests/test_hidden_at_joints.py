"""Forces and flows without a name at the joints of a machine that a spec puts together."""

import numpy as np
import pytest
from machines.loading import machine, noiseless
from rigs import release_problem

from rigid.discovery.fitted import Fitted
from rigid.discovery.unmodelled.base import none
from rigid.discovery.unmodelled.inputs import Input
from rigid.discovery.unmodelled.joints import paths_at_joints
from rigid.inference.few_starts import best_of_few
from rigid.localfit.expansion import Point, expanded
from rigid.localfit.families import families
from rigid.localfit.hidden_inputs import (
    CYLINDER_SPEED,
    HIDDEN,
    PRESSURE,
    SPEED,
    STROKE,
    HiddenDrag,
    HiddenFlow,
    HiddenForce,
    HiddenSpring,
    at_joints,
    hidden_of,
)
from rigid.localfit.hypothesis import Hypothesis, start
from rigid.localfit.local import LocalFit
from rigid.localfit.samples import lay_out

SMALL = 0.01
"""Force [N] that another simulator adds, of 28 N that the spring pushes with."""


def looked_for(name: str, folder) -> dict[tuple[str, str], set[str]]:
    """What hidden things go by, by what they are and where."""
    problem = machine(name, folder).question.problem
    return {
        (effect.__name__, joint): {one.name for one in followed}
        for effect, joint, followed in at_joints(problem)
    }


EVERY, OVER_TIME = {"time", "pressure", "stroke", "speed"}, {"time", "cylinder speed"}


@pytest.mark.slow
def test_forces_between_the_same_ends_are_looked_for_once(tmp_path):
    """A press: three joints between the ground and the ram, oil at two of them."""
    assert looked_for("press", tmp_path) == {
        (HiddenForce.__name__, "head"): EVERY,
        (HiddenFlow.__name__, "head"): EVERY,
        (HiddenForce.__name__, "rod"): {"pressure"},
        (HiddenFlow.__name__, "rod"): EVERY,
    }


@pytest.mark.slow
def test_forces_from_outside_are_looked_for_on_every_body(tmp_path):
    """A rig on a rope: barrel and root, behind other joints; the rope pulls at the root itself."""
    found = looked_for("hanging", tmp_path)
    study = machine("hanging", tmp_path).solved
    assert study.machine is not None
    cells = {e for e in found if e[0] == HiddenSpring.__name__}
    drags = {joint for kind, joint in found if kind == HiddenDrag.__name__}
    held = {
        joint.between[1] for joint in study.machine.joints.values() if "ground" in joint.between
    }
    behind = {name: joint.between[0] for name, joint in study.machine.joints.items()}
    assert {behind[joint] for joint in drags} == set(behind.values()) - {"ground"} - held
    assert all(found[HiddenDrag.__name__, joint] == OVER_TIME for joint in drags)
    listed = study.machine.joints.items()
    assert cells == {
        (HiddenSpring.__name__, name)
        for name, joint in listed
        if "load-cell-spring" in joint.effects
    }


@pytest.mark.slow
def test_the_rig_has_those_of_the_rig():
    assert hidden_of(release_problem({"k_LC": 6e7, "mu": 2e4}, samples=64)) == HIDDEN


@pytest.fixture(scope="module")
def swing(tmp_path_factory) -> LocalFit:
    """The fit of a body on a spring."""
    problem = machine("swing", tmp_path_factory.mktemp("swing")).question.problem
    best = best_of_few(problem, 4, 1)
    program = families(problem, ())[0]
    noise = np.zeros(sum(p.base == "noise" for p in problem.parameters.sampled))
    w = start(problem, best.z, best.standard)
    return expanded(program, Point(Hypothesis(problem), lay_out(problem), w, noise))


@pytest.mark.slow
def test_a_joint_is_followed_whether_or_not_it_is_read(swing: LocalFit):
    """The body is let go at 31 mm and -0.2 m/s; its swing of 27.4 rad/s dies away."""
    path = paths_at_joints(swing)["spring"]
    assert path.runs == ("decay",)
    assert path.lasts == pytest.approx(5.99)
    farthest = np.hypot(0.031, 0.2 / np.sqrt(900.0 / 1.2))
    low, high = path.spans[STROKE]
    assert 0.85 * farthest < -low < farthest
    assert 0.85 * farthest < high <= 1.001 * farthest
    fastest = farthest * np.sqrt(900.0 / 1.2)
    assert all(0.85 * fastest < abs(one) < fastest for one in path.spans[SPEED])
    assert path.spans[PRESSURE] == path.spans[CYLINDER_SPEED] == (0.0, 0.0)


@pytest.mark.slow
def test_what_a_bump_leaves_is_what_another_simulator_says(swing: LocalFit, tmp_path, monkeypatch):
    """A triangle of force over place or speed, added to the equations of a SciPy simulator."""

    def read(extra) -> np.ndarray:
        noiseless(monkeypatch, "swing", tmp_path / "read.csv", extra=extra)
        return 1e-3 * np.loadtxt(tmp_path / "read.csv", delimiter=",", skiprows=1)[:, 1]

    fit = Fitted(swing, families(swing.layout.problem, ()))
    found = Input.signatures(fit, lambda: none(len(swing.residual)))
    alone = read(lambda x, v: 0.0)  # noqa: ARG005
    for which, state in (("stroke", 0), ("speed", 1)):
        mine = [i for i, one in enumerate(found.target) if one.variable == which]
        assert len(mine) == 6
        centres = found.centre[mine]
        width = centres[1] - centres[0]
        for number in (1, 4):

            def bump(*now: float, at=centres[number], width=width, state=state) -> float:
                return SMALL * max(0.0, 1.0 - abs(now[state] - at) / width)

            told = found.columns[:, mine[number]][: len(alone)]  # what comes after is padded
            seen = (read(bump) - alone) / SMALL
            assert np.abs(told - seen).max() < 0.05 * np.abs(seen).max()


@pytest.mark.slow
def test_a_magnet_beside_a_spring_is_seen_where_it_is(tmp_path):
    """4 N, 6 mm wide, 20 mm from rest: no effect of the catalogue, and its shape is told."""

    def magnet(x: float, v: float) -> float:
        return 4.0 * np.exp(-(((x - 0.02) / 0.006) ** 2))

    found = machine("swing", tmp_path, seed=2, extra=magnet).discover()
    assert found.outcome.verdict == "unnamed"
    first = found.outcome.steps[0]
    likeliest = next(iter(first.explained.hidden))
    outcome = found.outcome
    hidden = first.explained.inferred(likeliest, outcome.base, outcome.bench.bumps).shown
    assert (hidden.name, hidden.variable) == ("hidden force at spring", "stroke")
    assert hidden.formula is None
    assert hidden.place[np.argmax(hidden.mean)] == pytest.approx(0.02, abs=0.006)
    assert hidden.mean.max() == pytest.approx(4.0, abs=1.0)

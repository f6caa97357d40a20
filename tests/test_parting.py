"""The record that parts two explanations: how far apart they are, before it is taken and after."""

import json

import numpy as np
import pytest
import small_campaign
from cart import write_cart
from test_plan import SECOND

from rigid import load, plan
from rigid.inference.few_starts import best_of_few
from rigid.io.errors import InputError
from rigid.localfit.candidates import candidates
from rigid.localfit.expansion import Point, expand
from rigid.localfit.families import families
from rigid.localfit.hypothesis import Hypothesis, start
from rigid.localfit.local import LocalFit
from rigid.localfit.samples import lay_out
from rigid.planning.change import Change
from rigid.planning.elsewhere import Possible, alike, elsewhere
from rigid.planning.parting import Pair, Rivals, best, between_effects, between_fits

PAIR = ("coulomb-friction", "direction-dependent-viscosity")


@pytest.fixture(scope="module")
def cart(tmp_path_factory):
    """A cart with one record, and the same with another of the same kind."""
    folder = tmp_path_factory.mktemp("cart")
    one = write_cart(folder, seconds=4.0)
    two = folder / "two.toml"
    write_cart(folder, "again", seed=2, seconds=4.0)
    channels = one.read_text("utf-8").split("[records.channels]\n")[1].split("\n\n")[0]
    more = SECOND.format(name="again", kind="motion", more='file = "again.csv"', channels=channels)
    two.write_text(one.read_text("utf-8").replace("\n[sampler]", f"{more}\n[sampler]"), "utf-8")
    return load(one), load(two)


def pair_of(study, at: dict[str, float]) -> Pair:
    """Two effects around a fit at given numbers, z by label."""
    problem = study.problem
    effects = tuple(e for e in study.question.effects if e.name in PAIR)
    programs = families(problem, effects, together=True)
    z = np.array([at.get(label, 0.0) for label in problem.parameters.labels])
    w = start(problem, z, np.zeros((len(problem.sensors), 2)))
    noise = np.array(
        [at.get(p.label, 0.0) for p in problem.parameters.sampled if p.base == "noise"]
    )
    (local,) = expand(programs[0], [Point(Hypothesis(problem), lay_out(problem), w, noise)])
    both = (candidates([effects[0]], 1)[0], candidates([effects[1]], 1)[0])
    return Pair(local, programs, both, 5.0)


def test_two_effects_are_as_far_apart_with_a_record_as_was_expected(cart):
    """The second record's data say nothing of how far apart the two are, but through curvatures."""
    one, two = cart
    best_ = best_of_few(two.problem, 4, 1)
    at = dict(zip(two.problem.parameters.labels, best_.z.tolist(), strict=True))
    possible = Possible(one.spec, one.records, (Change("to-and-fro"),))
    (expected,) = between_effects(pair_of(one, at), possible, (1, 2))
    nothing = Possible(two.spec, two.records, (Change("again"),))
    (taken,) = between_effects(pair_of(two, at), nothing)
    assert expected.apart[0] == pytest.approx(taken.now, rel=0.02)
    assert expected.now < 0.9 * taken.now  # the second record is worth something
    assert expected.apart[0] < expected.apart[1]


def rivals(study) -> Rivals:
    """Two drags held, each at its fit, as two hypotheses."""
    problem = study.problem
    found = best_of_few(problem, 4, 1)
    program = families(problem, (), together=True)[0]
    locals_ = []
    for drag in (90.0, 150.0):
        hypothesis = Hypothesis(problem, held={"mu": drag})
        full = dict(zip(Hypothesis(problem).labels, start_of(problem, found), strict=False))
        w = np.array([*(full[n] for n in hypothesis.labels), *np.zeros(2 * len(problem.sensors))])
        noise = found.z[[p.base == "noise" for p in problem.parameters.sampled]]
        locals_.append(expand(program, [Point(hypothesis, lay_out(problem), w, noise)])[0])
    return Rivals((locals_[0], locals_[1]), (program, program))


def start_of(problem, found) -> list[float]:
    return start(problem, found.z, found.standard).tolist()


def by_draws(true: LocalFit, wrong: LocalFit, rows: np.ndarray) -> float:
    """Distance of a record of one to the other refitted, over draws of the one: least squares."""
    rng = np.random.default_rng(3)
    root = np.sqrt(np.maximum(wrong.terms.curvature[rows], 0.0))
    prior = np.linalg.cholesky(wrong.information).T
    stacked = np.concatenate([root[:, None] * wrong.design[rows], prior])
    total = []
    for shift in rng.multivariate_normal(np.zeros(len(true.w)), true.covariance, 200):
        expected = true.design[rows] @ shift
        miss = root * (wrong.residual[rows] - true.residual[rows] + expected)
        goal = np.concatenate([miss, np.zeros(len(prior))])
        moved = np.linalg.lstsq(stacked, goal, rcond=None)[0]
        total.append(float(np.sum((goal - stacked @ moved) ** 2)))
    return float(np.sqrt(np.mean(total)))


def test_two_hypotheses_are_as_far_apart_as_least_squares_say(cart):
    """Against draws and least squares; 200 draws tell the small uncertain part within a tenth."""
    study, _ = cart
    both = rivals(study)
    possible = Possible(study.spec, study.records, (Change("to-and-fro"),))
    (found,) = between_fits(both, possible)
    rows = both.locals[0].layout.read
    one, other = both.locals
    expected = 0.5 * max(by_draws(one, other, rows), by_draws(other, one, rows))
    assert found.apart[0] == pytest.approx(expected, rel=0.02)
    assert found.apart[0] > 1.0  # two drags, 90 and 150, are not one to these records


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """A small campaign of the generator: a frame, a free run on two cylinders, a release."""
    folder = tmp_path_factory.mktemp("campaign")
    small_campaign.make(folder)
    return load(folder / "specs" / "own.toml")


@pytest.mark.slow
def test_a_candidate_stands_in_place_of_the_record_it_is_like(campaign):
    """Samples of both cylinders, their weights, and the flow fraction that is set."""
    problem = campaign.problem
    program = families(problem, (), together=True)[0]
    z = np.zeros(problem.parameters.size)
    w = start(problem, z, np.zeros((len(problem.sensors), 2)))
    noise = np.zeros(sum(p.base == "noise" for p in problem.parameters.sampled))
    layout = lay_out(problem)
    layout = layout.weighed(0.25 * layout.read)
    (here,) = expand(program, [Point(Hypothesis(problem), layout, w, noise)])
    change = Change("stroll", flow=0.5)
    possible = Possible(campaign.spec, campaign.records, (change,))
    other = elsewhere(here, possible, (change,), program)
    tracks = [layout.tracks[i] for i in np.unique(other.there.layout.track[other.rows("stroll")])]
    assert tracks == ["stroll,left", "stroll,right"]
    assert set(other.there.layout.weight[other.rows("stroll")]) == {0.25}
    values, was = (one.hypothesis.every(one.w) for one in (other.there, here))
    for label in ("kappa[stroll,left]", "kappa[stroll,right]"):
        assert values[label] == pytest.approx(0.5 * was[label], rel=1e-3)
    assert values["kappa[squeeze,left]"] == was["kappa[squeeze,left]"]
    shared, private = other.slopes("stroll", 2)
    rows = int(other.rows("stroll").sum())
    assert shared.shape == (2 * rows, here.hypothesis.size)
    own = [p.label for p in here.hypothesis.parameters if p.record == "stroll"]
    assert private.shape == (2 * rows, 2 * len(own))
    assert not private[:rows, len(own) :].any()
    assert other.beyond(campaign.spec, change) is None
    tight = campaign.spec.model_copy(update={"plan": None})
    assert other.beyond(tight, Change("stroll", ranges={"stroke": 1e-3})).what == "stroke"


def test_candidates_that_change_the_same_are_worked_out_together():
    a, b, c = Change("a", flow=2.0), Change("b", flow=2.0, cost=3.0), Change("a", flow=0.5)
    again = Change("a", flow=2.0, cost=2.0)
    assert alike((a, b, c)) == ((a, b), (c,))
    assert sum(map(len, alike((a, b, c, again)))) == 4


def test_the_worthiest_that_keeps_its_limits_is_taken(cart):
    one, _ = cart
    spec = one.spec
    possible = Possible(spec, one.records, (Change("to-and-fro"), Change("to-and-fro", cost=3.0)))
    ranked = between_effects(pair_of(one, {}), possible)
    assert [r.change.cost for r in ranked] == [1.0, 3.0]
    assert ranked[0].worth == pytest.approx(3.0 * ranked[1].worth)
    assert best(ranked) is ranked[0]
    assert best(()) is None


def test_the_command_ranks_records_for_two_effects(cart, tmp_path, capsys):
    path, out = cart[0].spec.path, tmp_path / "out"
    status = plan.main([str(path), "--between", *PAIR, "--quiet", "--out", str(out)])
    made = json.loads((out / "plan-between.json").read_text("utf-8"))
    assert status == (0 if made["usable"] else 1)
    assert {made["between"]["first"], made["between"]["other"]} == set(PAIR)
    (record,) = made["records"]
    assert [e["records"] for e in record["expected"]] == [1, 2, 4]
    told = [made["now"]["told"], *(e["told"] for e in record["expected"])]
    assert told == sorted(told)
    assert all(0.5 <= one <= 1.0 for one in told)
    assert "to-and-fro again" in capsys.readouterr().out
    assert len((out / "plan-between.csv").read_text("utf-8").splitlines()) == 1 + 3
    assert 'id="fig-plan-between-apart"' in (out / "index.html").read_text("utf-8")


@pytest.mark.parametrize(
    ("names", "says"),
    [
        (("coulomb-friction", "coulomb-friction"), "name two effects"),
        (("colomb-friction", "stribeck-friction"), "did you mean 'coulomb-friction'"),
        (("viscous-friction", "coulomb-friction"), "could not be missing"),
    ],
)
def test_effects_that_cannot_be_compared_are_told(cart, names, says):
    with pytest.raises(InputError, match=says):
        cart[0].plan_between(*names, quiet=True)


def test_two_questions_at_once_are_refused(cart, capsys):
    path = str(cart[0].spec.path)
    assert plan.main([path, "--between", *PAIR, "--of", "mu"]) == 2
    assert "run the command for each" in capsys.readouterr().err

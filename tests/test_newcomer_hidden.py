"""Laws that every sort of hidden thing keeps, and one added by a single file."""

import dataclasses
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from rigs import BASE, SHEETS, converted, drive, effects, parameters, track

from rigid.discovery.fitted import Fitted
from rigid.discovery.signatures import hidden_signatures
from rigid.discovery.unmodelled import SORTS
from rigid.discovery.unmodelled.base import AbstractHidden, Inferred
from rigid.discovery.weighing.explain import bundles_of, shares
from rigid.effects.base import EQUATIONS, Action, State
from rigid.io.values import pack, unpack
from rigid.likelihood.channels import make_pieces
from rigid.likelihood.groups import ReleaseGroup, SlowGroup
from rigid.likelihood.priors import Lognormal, Normal, Uniform
from rigid.likelihood.problem import Problem
from rigid.likelihood.tracks import Series
from rigid.localfit.expansion import Point, expanded
from rigid.localfit.families import families
from rigid.localfit.hidden_inputs import HIDDEN, AbstractHiddenInput
from rigid.localfit.hypothesis import Hypothesis, start
from rigid.localfit.samples import lay_out
from rigid.report.discovery.figures.hidden import hidden_figure

TESTS = Path(__file__).parent


def two_kinds() -> Problem:
    """A free run long enough for waves and a release."""
    run = track("free-run-1,A", "free-run", 600, drive=drive(600, (0.5, 28.0), (0, 1, 0)))
    release = track("release-1,A", "release", 128)
    begins = 15.4 * release.interval
    free = {
        "mu": Lognormal(1e5, 1.5),
        "k_LC": Lognormal(6e7, 1.2),
        "kappa[free-run-1,A]": Lognormal(0.2, 1.2),
        "preload[release-1,A]": Normal(6000.0, 60.0),
        "release_time[release-1,A]": Uniform(begins - 1e-3, begins + 1e-3),
    }
    sensors = tuple(f"{q},A" for q in (*SlowGroup.quantities, "acceleration"))
    listed = parameters(free, quantities=sensors)
    truth = listed.values(jnp.zeros((1, listed.size)))
    groups = SlowGroup((run,), effects(BASE)), ReleaseGroup((release,), effects(BASE))
    rng, series = np.random.default_rng(0), {}
    for group in groups:
        (one,), ideal = group.tracks, group.predict(truth)
        data = {q: converted(x[: one.samples, 0, 0], SHEETS[q], rng) for q, x in ideal.items()}
        series[one.label] = Series(data, {q: np.ones(one.samples) for q in data})
    return Problem(effects(BASE), listed, groups, make_pieces(groups, series, SHEETS))


@pytest.fixture(scope="module")
def fit() -> Fitted:
    made = two_kinds()
    programs = families(made, ())
    noise = np.zeros(sum(p.base == "noise" for p in made.parameters.sampled))
    w = start(made, np.zeros(made.parameters.size), np.zeros((len(made.sensors), 2)))
    point = Point(Hypothesis(made), lay_out(made), w, noise)
    return Fitted(expanded(programs[0], point), programs)


@pytest.fixture(scope="module")
def everything(fit: Fitted):
    return hidden_signatures(fit, SORTS.values())


@pytest.mark.slow
@pytest.mark.parametrize("sort", SORTS.values(), ids=SORTS)
class TestEverySort:
    def test_its_signatures_are_finite_and_its_own(self, sort, fit, everything):
        mine = everything.of(np.array([type(one) is sort for one in everything.target]))
        assert mine.columns.shape == (len(fit.local.residual), len(mine.target))
        assert len(mine.target) > 0
        assert np.isfinite(mine.columns).all()
        assert np.isfinite(mine.centre).all()

    def test_it_says_what_it_is(self, sort, everything):
        for one in {one for one in everything.target if type(one) is sort}:
            about = one.about
            assert about.equation in EQUATIONS
            assert all((about.name, about.unit, about.over.name, about.over.unit))
            assert one.prior_class
            assert one.pooled is None or one.pooled.pooled is None

    def test_it_is_read_from_the_shelf_as_it_was_put_there(self, sort, everything):
        for one in {one for one in everything.target if type(one) is sort}:
            tree, arrays = pack(one, {})
            assert unpack(json.loads(json.dumps(tree)), arrays, list(SORTS.values()), {}) == one

    def test_of_no_size_it_is_shown_as_what_the_model_has(self, sort, fit, everything):
        targets = [one for one in everything.target if type(one) is sort]
        for one in dict.fromkeys([targets[0], targets[-1]]):
            own = everything.of(np.array([target == one for target in everything.target]))
            size = len(own.target)
            args = np.zeros(size), np.eye(size), own, fit.local, everything
            shown = Inferred(one, *args).shown
            np.testing.assert_array_equal(shown.mean, shown.formula)
            assert shown.groups or not shown.mean.any()
            assert (shown.sd >= 0.0).all()
            assert shown.name
            assert shown.words
            hidden_figure(shown, simulated=True)


@pytest.mark.slow
def test_shares_of_the_prior_add_up_to_one_and_classes_are_alike(everything):
    information = np.eye(len(everything.target))
    bundles = bundles_of(everything.target, 0, information)
    bet = np.exp(shares(bundles))
    assert bet.sum() == pytest.approx(1.0)
    classes = np.array([one.prior_class for one, _ in bundles])
    assert set(classes) == {"time", "curve", "straight", "shift"}
    for one in set(classes):
        assert bet[classes == one].sum() == pytest.approx(0.25)


@pytest.mark.parametrize("effect", HIDDEN)
def test_a_hidden_force_without_height_does_nothing(effect: type[AbstractHiddenInput]):
    heights, centre, width = effect.parameters()
    assert len(heights.labels) == len(effect.followed)
    state = State(*jnp.full((6, 1), 0.3), time=jnp.full(1, 0.3))
    quiet = dict.fromkeys(heights.labels, 0.0) | {centre.name: 0.3, width.name: 1.0}
    for label, one in zip(heights.labels, effect.followed, strict=True):
        sizes = [effect.build(quiet | {label: h})(state, ()) for h in (0.0, 2.0)]
        pushed = [max(float(np.abs(part).max()) for part in action[:6]) for action in sizes]
        away = abs(float(np.ravel(one.of(state))[0]) - 0.3)
        assert pushed == [0.0, pytest.approx(2.0 * max(1.0 - away, 0.0))]
        assert isinstance(sizes[0], Action)


NEWCOMER = '''
"""A load cell that creeps with how fast the pressure changes."""

import dataclasses
from collections.abc import Callable
from typing import ClassVar

import numpy as np

from rigid.discovery.fitted import Fitted
from rigid.discovery.unmodelled.base import About, AbstractHidden, Bumps, none, together
from rigid.localfit.hidden_inputs import Abscissa

BAR_PER_MINUTE, POND = 1e5 / 60.0, 9.80665e-3
PLACES = np.linspace(-4000.0, 4000.0, 9)


@dataclasses.dataclass(frozen=True)
class Creep(AbstractHidden):
    """An error of the load cell over the pressure's rate."""

    cylinder: str

    sort: ClassVar[str] = "creep"

    @property
    def about(self) -> About:
        over = Abscissa("rate of the pressure", "bar/min", "r")
        return About("sensor", "creep of the load cell", "pond", over)

    @classmethod
    def signatures(cls, fit: Fitted, earlier: Callable[[], Bumps]) -> Bumps:
        layout, reading = fit.local.layout, fit.local.reading
        rows = {c[:3]: np.flatnonzero(layout.channel == n) for n, c in enumerate(layout.channels)}
        columns = np.zeros((len(reading), len(PLACES)))
        for (track, kind, quantity), mine in rows.items():
            if quantity == "pressure" and (load := rows.get((track, kind, "load"))) is not None:
                rate = np.gradient(reading[mine], layout.time[mine]) / BAR_PER_MINUTE
                width = PLACES[1] - PLACES[0]
                height = np.maximum(0.0, 1.0 - np.abs(rate[:, None] - PLACES) / width)
                columns[load] = POND * height
        return together([none(len(reading)), Bumps(columns, (cls("A"),) * len(PLACES), PLACES)])
'''

PROGRAM = """
import sys
from pathlib import Path

import equinox as eqx
import numpy as np

from rigid.io.runtime import prepare

prepare()
import test_screening as screening

from rigid.discovery.fitted import Fitted
from rigid.discovery.signatures import hidden_signatures
from rigid.discovery.unmodelled import SORTS
from rigid.report.discovery import compared, output
from rigid.report.discovery.present import Context, content
from rigid.report.discovery.section import KIND
from rigid.report.made import made as provenance
from rigid.report.section import write_report
from rigid.spec import load_spec

problem = screening.campaign(302)
local, programs = screening.fitted(problem)
mine = hidden_signatures(Fitted(local, programs), [SORTS["creep"]])
change = mine.columns @ np.cos(mine.centre / 1000.0)
change *= 60.0 / np.linalg.norm(change * np.sqrt(local.terms.curvature))
layout, pieces = local.layout, []
for piece in problem.pieces:
    rows = [(c.sensor, n) for n, c in enumerate(layout.channels) if c.quantity == piece.quantity]
    more = np.stack([change[layout.channel == n] for _, n in rows], axis=1)
    pieces.append(eqx.tree_at(lambda p: p.data, piece, piece.data + more))
import dataclasses

outcome = screening.found_in(dataclasses.replace(problem, pieces=tuple(pieces)))
found = outcome.steps[0].explained
spec = load_spec(Path(sys.argv[1]))
where = compared.compared(outcome, 0)
made = output.as_dict(spec, outcome, None) | {"disagreements": compared.told(where)}
run = Context(provenance(spec, 0, ()), (), where)
write_report(KIND, content(spec, outcome, made, run), Path(sys.argv[2]))
print(outcome.verdict, next(iter(found.hidden)).sort, made["steps"][0]["where"]["equation"])
"""


@pytest.mark.slow
def test_one_file_adds_a_sort(tmp_path: Path):
    """Screened, weighed, unnamed with its description, and on the page in its own odd units."""
    shutil.copytree(TESTS.parent / "rigid", tmp_path / "rigid")
    added = tmp_path / "rigid" / "discovery" / "unmodelled" / "creep.py"
    added.write_text(NEWCOMER, encoding="utf-8")
    (tmp_path / "program.py").write_text(PROGRAM, encoding="utf-8")
    spec = TESTS.parent / "fits" / "calibration.toml"
    run = subprocess.run(
        [sys.executable, "program.py", str(spec), str(tmp_path / "report")],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), str(TESTS)])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout.split() == ["unnamed", "creep", "sensor"]
    page = (tmp_path / "report" / "index.html").read_text("utf-8")
    assert "What explains most: creep of the load cell over rate of the pressure" in page
    assert "rate of the pressure [" in page
    assert "bar/min]" in page
    assert "pond]" in page


def test_every_sort_is_one_class_in_one_file():
    files = [one.__module__ for one in SORTS.values()]
    assert len(set(files)) == len(files)
    assert all(issubclass(one, AbstractHidden) for one in SORTS.values())
    assert all(dataclasses.fields(one) for one in SORTS.values())

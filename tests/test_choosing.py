"""Laws of friction compared: the integral, left-out records, errors, verdicts; and the command."""

import dataclasses
import json
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from rigs import MEMORY, SHEETS, converted, drive, effects, parameters, track
from scipy.special import logsumexp

from rigid import laws as command
from rigid.choosing.comparing import (
    CANNOT_TELL,
    LAW,
    TIED,
    Standing,
    probabilities,
    verdict_of,
)
from rigid.choosing.integral import evidence, shape_of
from rigid.choosing.laws import (
    BRISTLES,
    COULOMB,
    NAMES,
    SEAL,
    STRIBECK,
    VISCOUS,
    Law,
    laws,
    without_friction,
)
from rigid.choosing.laws import MEMORY as WITH_MEMORY
from rigid.choosing.leaving import Left, left_out
from rigid.choosing.scatter import CAMPAIGNS, scattered
from rigid.choosing.starts import prior_starts
from rigid.choosing.together import led, simulated
from rigid.choosing.widths import AS_STATED, VARIANTS, sized, spread
from rigid.cli import Options
from rigid.discovery.families import Family, families
from rigid.discovery.hypothesis import Hypothesis
from rigid.discovery.judging import units
from rigid.discovery.local import Local, expand
from rigid.discovery.samples import lay_out
from rigid.generator import Conditions, campaign
from rigid.generator.hidden.dry import PressureDependent
from rigid.groups import SlowGroup
from rigid.likelihood import make_pieces
from rigid.priors import Lognormal, Normal, Uniform
from rigid.problem import Problem
from rigid.spec import load_spec
from rigid.tracks import Series

BRANCHES = {"mu_branch[1]": 0.0, "mu_branch[2]": 0.0}
SEVERAL = {"kappa[free-run-1,A]": 0.2, "kappa[free-run-2,A]": 0.05, "kappa[free-run-3,A]": 0.1}


def problem(seed: int, **truth: float) -> Problem:
    """Three free runs of a rig, its friction constant unless the truth says otherwise."""
    tracks = tuple(
        track(f"free-run-{i},A", "free-run", 300, drive=drive(300, (0.5, 1.8), (0, 1, 0)),
              stroke_high=0.1, switch_strokes=np.full(8, 0.05))
        for i in (1, 2, 3)
    )  # fmt: skip
    free = {
        "mu": Lognormal(1e6, 3.0),
        "mu_branch[1]": Lognormal(5e5, 5.0),
        **{k: Lognormal(v, 1.2) for k, v in SEVERAL.items()},
    }
    listed = parameters(free, MEMORY, ("load,A", "stroke,A", "pressure,A"))
    values = listed.values(jnp.zeros((1, listed.size)))
    values |= {k: jnp.asarray([v]) for k, v in ({"mu": 1e6} | BRANCHES | truth).items()}
    group = SlowGroup(tracks, effects(MEMORY))
    ideal, rng = group.predict(values), np.random.default_rng(seed)
    series = {}
    for i, one in enumerate(tracks):
        data = {q: converted(ideal[q][:, i, 0], SHEETS[q], rng) for q in ideal}
        series[one.label] = Series(data, {q: np.ones(one.samples) for q in data})
    return Problem(group.effects, listed, (group,), make_pieces((group,), series, SHEETS))


CONSTANT = Law(VISCOUS, False, None, {"mu_branch[1]": 0.0, "mu_branch[2]": 0.0})
ONE_BRANCH = Law(WITH_MEMORY, True, None, {"mu_branch[2]": 0.0})


def fits(made: Problem) -> tuple[Family, dict[str, Local]]:
    """Constant friction and one branch of memory, each at its best."""
    family = families(made, (), together=True)[0]
    noise = np.zeros(3)
    out = {}
    for law in (CONSTANT, ONE_BRANCH):
        hypothesis = Hypothesis(made, held=law.held)
        like = expand(hypothesis, (family, lay_out(made)), np.zeros(hypothesis.size), noise)
        out[law.name] = led(family, simulated(family, prior_starts(like, 1, 0)), False)[0]
    return family, out


@pytest.fixture(scope="module")
def plain() -> tuple[Family, dict[str, Local]]:
    return fits(problem(500))


def amplitude(local: Local) -> dict:
    known = {p.label: p.law for p in local.hypothesis.parameters}
    return {k: known[k] for k in ("mu_branch[1]",) if k in known}


def flat(count: int, size: float, seed: int, amplitude_at: float = 0.0):
    """A linear toy: y = a x + b u + noise, a lognormal amplitude and a Gaussian number."""
    rng = np.random.default_rng(seed)
    x, u = size * rng.standard_normal(count) / np.sqrt(count), rng.standard_normal(count)
    return x, u, amplitude_at * x + 0.3 * u + rng.standard_normal(count)


class Toy:
    """What `shape_of` asks of a fit, of a linear model with unit noise."""

    def __init__(self, x, u, y, law):
        self.hypothesis = self
        self.parameters = [type("P", (), {"label": "a", "law": law})()] if law else []
        self.labels = tuple(p.label for p in self.parameters)
        self.z_noise = np.zeros(0)
        self.w = np.array(([-1.0] if law else []) + [0.2])
        self.law, self.x, self.u, self.y = law, x, u, y
        a, rise = self._amplitude(self.w)
        self.design = np.stack(([x * rise] if law else []) + [u], axis=1)
        residual = y - a * x - self.w[-1] * u
        ones = np.ones(len(y))
        self.terms = type("T", (), {"bend": ones, "score": residual, "value": -0.5 * residual**2})()

    def _amplitude(self, w):
        if self.law is None:
            return 0.0, 0.0
        a = float(self.law.from_standard(w[0]))
        return a, a * float(np.log(self.law.factor))

    def values(self, w):
        return {"a": self._amplitude(w)} if self.law else {}

    def exact(self) -> float:
        """Evidence on a fine grid of both numbers."""
        grid = np.linspace(-8.0, 8.0, 1601)
        a = np.asarray(self.law.from_standard(grid)) if self.law else np.zeros(1)
        b = np.linspace(-3.0, 3.0, 1201)
        logs = np.array(
            [
                -0.5 * np.sum((self.y - v * self.x) ** 2)
                + b * (self.u @ (self.y - v * self.x))
                - 0.5 * b**2 * (self.u @ self.u)
                - 0.5 * b**2
                for v in a
            ]
        )
        inner = logsumexp(logs, axis=1) + np.log(b[1] - b[0]) - 0.5 * np.log(2 * np.pi)
        if self.law is None:
            return float(inner[0])
        mass = -0.5 * grid**2 + np.log(grid[1] - grid[0]) - 0.5 * np.log(2 * np.pi)
        return float(logsumexp(inner + mass))

    def laplace(self) -> float:
        """Laplace's integral at the same point: what it would be without the grid."""
        known = np.eye(len(self.w)) + self.design.T @ self.design
        pull = self.design.T @ self.terms.score - self.w
        value = self.terms.value.sum() - 0.5 * self.w @ self.w
        value += 0.5 * pull @ np.linalg.solve(known, pull)
        return float(value - 0.5 * np.linalg.slogdet(known)[1])


@pytest.mark.parametrize("size", [0.02, 0.3, 3.0])
def test_an_amplitude_that_is_only_known_to_be_small_goes_by_the_grid(size):
    """Against quadrature over both numbers; the trapezoid's error is far below 1e-3."""
    law = Lognormal(5.0, 4.0)
    toy = Toy(*flat(200, size, 7), law)
    assert evidence(toy, {"a": law}) == pytest.approx(toy.exact(), abs=2e-3)


def test_laplace_would_be_off_there():
    law = Lognormal(5.0, 4.0)
    toy = Toy(*flat(200, 3.0, 7), law)
    assert abs(toy.laplace() - toy.exact()) > 0.5


@pytest.mark.parametrize("name", VARIANTS)
def test_another_prior_is_as_if_the_law_had_been_fitted_with_it(name):
    stated = Lognormal(5.0, 4.0)
    other = VARIANTS[name](stated)
    data = flat(200, 40.0, 11, amplitude_at=2.0)  # a strong amplitude: no grid
    first, second = Toy(*data, stated), Toy(*data, other)
    first.w[0] = np.log(2.0 / 5.0) / np.log(4.0)
    first = _at(first, data, stated, 2.0)
    second = _at(second, data, other, 2.0)
    assert not len(shape_of(first, {"a": stated}).wide)
    assert evidence(first, {"a": other}) == pytest.approx(evidence(second, {"a": other}), abs=1e-6)
    assert evidence(second, {"a": other}) == pytest.approx(second.exact(), abs=0.02)


def _at(toy: Toy, data, law, value: float) -> Toy:
    """The toy expanded where its amplitude has a value."""
    x, u, y = data
    z = float(np.log(value / float(law.median)) / np.log(float(law.factor)))
    toy.w = np.array([z, 0.3])
    rise = value * float(np.log(law.factor))
    toy.design = np.stack([x * rise, u], axis=1)
    residual = y - value * x - 0.3 * u
    toy.terms = type("T", (), {"bend": np.ones(len(y)), "score": residual,
                               "value": -0.5 * residual**2})()  # fmt: skip
    return toy


def test_priors_are_made_larger_and_wider_as_said():
    assert float(sized(Lognormal(5.0, 4.0), 3.0).from_standard(1.0)) == pytest.approx(60.0)
    assert float(spread(Lognormal(5.0, 4.0), 2.0).from_standard(1.0)) == pytest.approx(80.0)
    assert float(sized(Normal(1.0, 2.0), 3.0).from_standard(-1.0)) == pytest.approx(-3.0)
    assert float(sized(Uniform(1.0, 2.0), 3.0).from_standard(8.0)) == pytest.approx(6.0)
    assert next(iter(VARIANTS)) == AS_STATED


def mean_log_score(made_by_larger: bool, judge) -> float:
    """Mean of -ln p of the truth over toy campaigns, between a law and a larger one."""
    law, total = Lognormal(2.0, 2.0), 0.0
    seeds = range(60)
    rng = np.random.default_rng(17)
    for seed in seeds:
        a = float(law.from_standard(rng.standard_normal())) if made_by_larger else 0.0
        data = flat(100, 1.0, 1000 + seed, amplitude_at=a)
        p = probabilities({"small": judge(*data, None), "large": judge(*data, law)})
        total -= np.log(max(p["large" if made_by_larger else "small"], 1e-6))
    return total / len(seeds)


def test_without_the_occam_factor_the_larger_law_wins_where_it_is_not_needed():
    """The comparison, broken on purpose: the height of the top in place of the integral.

    What is right is right on average: with each law as often the truth as the other, no answer has
    a better expected log score than the probabilities, ln 2 being that of no answer at all.
    """

    def honest(x, u, y, law):
        return evidence(Toy(x, u, y, law), {"a": law} if law else {})

    def top(x, u, y, law):
        columns = np.stack([x, u] if law else [u], axis=1)
        best = np.linalg.lstsq(columns, y, rcond=None)[0]
        return -0.5 * float(np.sum((y - columns @ best) ** 2))

    right = [mean_log_score(large, honest) for large in (False, True)]
    wrong = [mean_log_score(large, top) for large in (False, True)]
    assert np.mean(right) < np.log(2.0)
    assert np.mean(right) < np.mean(wrong)
    # The top of a larger law is never lower, so that the smaller is given less than a half always.
    assert wrong[0] > np.log(2.0) > right[0]


def test_the_fit_with_memory_and_the_one_without_agree_where_there_is_none(plain):
    _, found = plain
    constant, memory = found[VISCOUS], found[WITH_MEMORY]
    # A larger law is never worse by more than the prior of what it need not have: all the way down
    # to nothing within its seven sds.
    assert memory.terms.value.sum() > constant.terms.value.sum() - 0.5
    logs = {name: evidence(one, amplitude(one)) for name, one in found.items()}
    assert logs[VISCOUS] > logs[WITH_MEMORY]
    value, _ = constant.hypothesis.values(constant.w)["mu"]
    assert value == pytest.approx(1e6, rel=0.05)
    assert constant.hypothesis.constants()["mu_branch[1]"] == 0.0
    assert "mu_branch[1]" not in constant.hypothesis.labels


def test_left_out_records_are_predicted_as_a_fit_without_them_says(plain):
    """The parabola against fits made again without each record: within 0.1 of the log density."""
    family, found = plain
    local = found[VISCOUS]
    parts = units(local, None)
    assert len(parts) == 3
    quick = left_out(family, local, {}, parts)
    assert not quick.refitted.any()
    for rows, density in zip(parts, quick.density, strict=True):
        less = local.layout.weighed(np.where(rows, 0.0, local.layout.weight))
        again = expand(local.hypothesis, (family, less), local.w, local.z_noise)
        again = led(family, [again], False, noise=False)[0]
        assert density == pytest.approx(evidence(local, {}) - evidence(again, {}), abs=0.1)


def test_errors_are_what_differences_scatter_by(plain):
    """Campaigns by simulation of the rig, against those by the parabola: sd of the difference.

    The sd of 24 differences is known to 15 % (1/sqrt(48)), that of CAMPAIGNS to 5 %; 3 sd.
    """
    _, found = plain
    parts = units(found[VISCOUS], None)
    judged = {name: (one, amplitude(one)) for name, one in found.items()}
    drawn = scattered(found[VISCOUS], judged, parts, 3)
    assert drawn[VISCOUS].density.shape == (CAMPAIGNS, 3)
    said = float((drawn[WITH_MEMORY].evidence - drawn[VISCOUS].evidence).std())
    true = []
    for seed in range(24):
        _, one = fits(problem(600 + seed))
        logs = [evidence(one[name], amplitude(one[name])) for name in (WITH_MEMORY, VISCOUS)]
        true.append(logs[0] - logs[1])
    assert said == pytest.approx(float(np.std(true)), rel=3 * 0.16)
    middle = float((drawn[WITH_MEMORY].evidence - drawn[VISCOUS].evidence).mean())
    assert middle == pytest.approx(float(np.mean(true)), abs=3 * said / np.sqrt(24) + 0.15)


def standing(law: Law, evidence_: float, tied: bool) -> Standing:
    none = np.zeros(1)
    return Standing(
        law=law, local=None, left=Left(none, none > 0), difference=none, errors=none, error=1.0,
        odds_error=1.0, expected=0.0, tied=tied, evidence=dict.fromkeys(VARIANTS, evidence_),
    )  # fmt: skip


def test_verdicts():
    constant, coulomb, seal = Law(VISCOUS, False), Law(COULOMB, False), Law(SEAL, False)
    first = standing(constant, 0.0, False)
    assert verdict_of([first, standing(coulomb, -9.0, False)]) == LAW
    assert verdict_of([first, standing(coulomb, -9.0, True)]) == TIED
    # a larger law that the odds do not rule out, under one prior at least
    close = standing(coulomb, -9.0, True)
    close.evidence["half the width"] = -2.0
    assert verdict_of([first, close]) == CANNOT_TELL
    # a smaller one, or one of another kind: a tie is a tie whatever the odds
    assert (
        verdict_of([standing(coulomb, 0.0, False), standing(constant, -9.0, True)]) == CANNOT_TELL
    )
    assert verdict_of([standing(coulomb, 0.0, False), standing(seal, -9.0, True)]) == CANNOT_TELL


def test_which_law_contains_which():
    constant, memory = Law(VISCOUS, False), Law(WITH_MEMORY, True)
    beside = {name: Law(name, True) for name in (COULOMB, STRIBECK, BRISTLES, SEAL)}
    dry = {name: Law(name, False) for name in beside}
    dry = {n: dataclasses.replace(v, dry=object) for n, v in dry.items()}
    beside = {n: dataclasses.replace(v, dry=object) for n, v in beside.items()}
    assert all(law.contains(constant) for law in (memory, *dry.values(), *beside.values()))
    assert all(law.contains(memory) for law in beside.values())
    assert not any(law.contains(memory) for law in dry.values())
    assert dry[BRISTLES].contains(dry[STRIBECK])
    assert dry[STRIBECK].contains(dry[COULOMB])
    assert not dry[COULOMB].contains(dry[STRIBECK])
    assert not dry[SEAL].contains(dry[COULOMB])
    assert not constant.contains(memory)


@pytest.mark.slow
def test_the_command_finds_seal_friction_and_writes_its_files(tmp_path: Path, capsys):
    """A strong one, so that neither seed nor prior matters."""
    hidden = (PressureDependent(2e-5),)
    campaign(
        820_010, tmp_path, field=False,
        conditions=Conditions(clock=1, memory=False, hidden=hidden),
    )  # fmt: skip
    path, out = tmp_path / "calibration.toml", tmp_path / "out"
    text = path.read_text("ascii").replace(f'    "{WITH_MEMORY}",\n', "")
    path.write_text(text, "ascii")
    given = Options(spec=str(path), out=out, seed=1, resume=False, quiet=True, as_json=True)
    assert command.compare_laws(given) == 0
    found = json.loads((out / "laws.json").read_text("utf-8"))
    assert found == json.loads(capsys.readouterr().out)
    assert {one["law"] for one in found["laws"]} == set(NAMES)
    assert found["first"] == SEAL
    assert sum(one["probability"] for one in found["laws"]) == pytest.approx(1.0)
    others = [one for one in found["laws"] if one["law"] != SEAL]
    assert all(one["elpd_difference"] < -4.0 for one in others)
    seal = found["laws"][0]["parameters"]["c_seal"]
    # The hidden law fades: 2e-5 (1 + p/2e8)^-1, some 25 % less at the frame's pressures.
    assert 1.2e-5 < seal["median"] < 2.2e-5
    rows = (out / "laws.csv").read_text("utf-8").splitlines()
    assert len(rows) == 1 + len(NAMES)
    page = (out / "index.html").read_text("utf-8")
    assert "Simulated data" in page
    assert "Laws of friction" in page


def test_the_laws_of_a_spec(tmp_path: Path):
    """Dry friction stands beside what the spec has; a coefficient by kind of record is no law."""
    folder = Path(__file__).parents[1] / "fits"
    spec = load_spec(folder / "constant-mu.toml")
    plain_spec = without_friction(spec)
    assert spec.model.vary
    assert not plain_spec.model.vary
    assert plain_spec.model.effects == load_spec(folder / "calibration.toml").model.effects
    made = problem(1)
    bending = Lognormal(2e-5, 1.1)
    numbers = made.parameters
    more = dataclasses.replace(numbers.sampled[0], label="presliding", law=bending)
    made = dataclasses.replace(
        made, parameters=dataclasses.replace(numbers, sampled=(*numbers.sampled, more))
    )
    by_name = {law.name: law for law in laws(spec, made)}
    assert tuple(by_name) == NAMES
    assert by_name[COULOMB].effects == (VISCOUS, COULOMB)
    assert by_name[COULOMB].held["mu_branch[1]"] == 0.0
    assert by_name[STRIBECK].held["z_bristle"] == pytest.approx(2e-5)
    beside = laws(load_spec(folder / "calibration.toml"), made)
    assert beside[2].effects == (VISCOUS, WITH_MEMORY, COULOMB)
    assert "mu_branch[1]" not in beside[2].held

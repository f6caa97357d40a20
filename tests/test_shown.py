"""What is said and shown of what was found."""

import re

import jax.numpy as jnp
import numpy as np
import pytest
from rigs import parameter
from scipy.stats import chi2, norm

from rigid.discovery.form import OtherForm
from rigid.discovery.outcome import Outcome, Step
from rigid.discovery.refit import Refit
from rigid.discovery.unmodelled.base import Bumps, together
from rigid.discovery.unmodelled.crosstalk import answering
from rigid.discovery.unmodelled.inputs import Input
from rigid.discovery.unmodelled.straight import straight
from rigid.discovery.weighing.explain import PRIOR_NOTHING, PRIOR_UNNAMED, Explained, bundles_of
from rigid.discovery.weighing.odds import MIMICS, Odds
from rigid.discovery.weighing.verdict import is_missing
from rigid.effects import CATALOGUE
from rigid.inference.settled import Settled
from rigid.likelihood.priors import Normal
from rigid.likelihood.problem import Problem
from rigid.localfit.candidates import Candidate
from rigid.localfit.hypothesis import Hypothesis
from rigid.localfit.local import LocalFit
from rigid.localfit.samples import ChannelKey, Layout, Terms
from rigid.localfit.screening import Around, screen
from rigid.localfit.where import Where
from rigid.planning.change import Change
from rigid.planning.parting import Parting
from rigid.report.discovery.figures.against import against_figure
from rigid.report.discovery.figures.hidden import hidden_figure
from rigid.report.discovery.figures.residuals import residuals_figure
from rigid.report.discovery.lead import SHOWN, lead, ruling, told_moves, would_show
from rigid.report.discovery.present import bets
from rigid.report.discovery.residuals import against, line_sizes, residuals
from rigid.report.discovery.section import Moved
from rigid.report.discovery.words import KAPPA, meanings

SAMPLES = 300
TIME = np.arange(SAMPLES) * 0.01
LISTED = ("load", "stroke", "pressure")
CHANNELS = tuple(ChannelKey("free-run-1,A", "free-run", q, f"{q},A", 0.01) for q in LISTED)
NUMBER = np.repeat(np.arange(len(LISTED)), SAMPLES)
READING = np.concatenate(
    [1e3 * np.sin(2.0 * TIME), 0.05 * np.sin(5.0 * TIME), 1e6 * np.cos(3.0 * TIME)]
)
NOISE = np.repeat([100.0, 1e-4, 1e4], SAMPLES)


SETTLED = Settled(0.0, (), 4.2)


def bare(cls, **fields):
    """An object of a class with some of its fields alone: the rest is never asked for."""
    one = object.__new__(cls)
    for name, value in fields.items():
        object.__setattr__(one, name, value)
    return one


def found(hidden: Bumps, change: np.ndarray):
    """What is shown where the records hold a change (n,) and the fit adjusts nothing."""
    bend = NOISE**-2.0
    around = Around(change * bend, bend, np.zeros((len(bend), 1)), np.zeros(1))
    screening = screen(around, hidden.columns)
    bundles = bundles_of(hidden.target, 0, screening.information)
    logs = np.array([b.log_bayes(screening.slope) for _, b in bundles])
    none = np.zeros(0)
    explained = Explained((), screening, none, bundles, logs, np.zeros(0))
    base = bare(LocalFit, layout=bare(Layout, channels=CHANNELS))
    return explained.inferred(next(iter(explained.hidden)), base, hidden).shown


def test_a_gauge_that_reads_the_flow_is_said_to_answer_to_the_rate_of_the_stroke():
    hidden = answering(CHANNELS, NUMBER, np.tile(TIME, 3), READING)
    at = [t.kind == "pressure" and t.rates for t in hidden.target].index(True) + 1
    shown = found(hidden, 1e5 * hidden.columns[:, at])  # 0.25 m/s at the most
    assert shown.groups == ("rate of load", "rate of stroke", "rate of pressure")
    assert shown.name == "distortion of the gauge"
    number = float(shown.words.split(", ")[1].split()[0])
    # A strength of 30: the prior, of three numbers together, takes a few per cent off.
    assert number == pytest.approx(1e5, rel=0.06)
    assert "Pa per m/s of the rate of stroke" in shown.words
    assert shown.mean[1] == pytest.approx(number * 5.0 * 0.05, rel=0.02)
    assert np.abs(shown.mean[[0, 2]]).max() < 0.1 * shown.mean[1]
    axes = hidden_figure(shown, simulated=True).axes[0]
    assert [tick.get_text() for tick in axes.get_xticklabels()] == list(shown.groups)
    assert "[kPa]" in axes.get_ylabel()


def test_a_leak_is_said_to_be_in_proportion_to_the_pressure():
    places = np.linspace(0.0, 1e6, 6)
    pressure = 5e5 * (1.0 + np.sin(np.arange(3 * SAMPLES)))
    height = np.maximum(0.0, 1.0 - np.abs(pressure[:, None] - places) / 2e5)
    target = Input("flow", "pressure")
    curves = Bumps(1e9 * NOISE[:, None] * height, (target,) * 6, places)
    hidden = together([curves, *straight(curves)])
    shown = found(hidden, hidden.columns @ (-3e-15 * np.eye(len(hidden.target))[7]))
    assert shown.words.split()[0].startswith("-3") or shown.words.split()[0].startswith("-2.9")
    assert shown.words.endswith(" p")
    np.testing.assert_allclose(shown.place, places)
    assert not shown.groups


def test_a_line_is_shown_at_its_frequency_with_its_amplitude():
    rng = np.random.default_rng(3)
    interval, count, hertz = 0.01, 1000, 14.0
    time = interval * np.arange(count)
    series = 0.3 * np.sin(2.0 * np.pi * hertz * time + 0.4) + 0.1 * rng.standard_normal(count)
    frequency, size = line_sizes(series, interval, (13.8, 14.2))
    assert frequency[0] > 6.8
    assert frequency[-1] < 21.4
    top = int(np.argmax(size))
    assert frequency[top] == pytest.approx(hertz)
    # The amplitude of noise of sd s in a line of n samples has sd s sqrt(2/n).
    assert size[top] == pytest.approx(0.3, abs=4.0 * 0.1 * np.sqrt(2.0 / count))
    assert np.delete(size, top).max() < 0.1


def test_the_page_says_what_is_bet_before_any_record():
    numbers = [float(word.strip("'\",.")) for word in re.findall(r"0\.\d\d|\b11\b", bets())]
    assert numbers[:3] == [PRIOR_NOTHING, pytest.approx(0.45), PRIOR_UNNAMED]
    assert sum(numbers[:3]) == pytest.approx(1.0)
    assert numbers[3] == round(1.0 + 0.45 / (MIMICS * PRIOR_UNNAMED))


@pytest.mark.parametrize(
    ("name", "hertz", "frequencies"),
    [
        ("pump-ripple", 14.0, True),
        ("free-root-plate", 14.0, False),  # it swings and dies out
        ("pump-ripple", 60.0, False),  # faster than any channel reads
    ],
)
def test_only_what_beats_is_shown_by_frequency(name: str, hertz: float, frequencies: bool):
    layout = bare(
        Layout, channels=CHANNELS, channel=NUMBER, time=np.tile(TIME, 3),
        weight=np.ones(len(NUMBER)), floor=NOISE,
    )  # fmt: skip
    terms = [Terms(np.full(len(NUMBER), v), NOISE**-1.0, NOISE**-2.0) for v in (0.0, 1.0)]
    before, after = (bare(LocalFit, layout=layout, residual=NOISE, terms=t) for t in terms)
    one = Refit(bare(Candidate, effect=CATALOGUE[name]), before, after, 5.0)
    place = Where("free-run-1", "A", "pressure", (0.5, 2.0), (hertz - 0.2, hertz + 0.2))
    shown = residuals(bare(Step, chosen=name, refits={name: one}, place=place))
    assert {each.frequencies for each in shown} == {frequencies}
    axes = residuals_figure(shown, simulated=True).axes[-1]
    assert axes.get_xlabel() == ("frequency [Hz]" if frequencies else "time [s]")


def test_classes_do_not_follow_how_the_noise_of_rounded_samples_fell():
    """Rounded to a step of five noises, a sample says most where its noise took it over an edge."""
    rng = np.random.default_rng(17)
    noise, count = np.full(30_000, 0.2), 30_000
    expected = np.full(count, 0.3)  # where one in six is rounded up
    trace = 0.1 * rng.choice((-1.0, 1.0), count) * rng.uniform(0.2, 1.0, count)
    codes = np.rint(expected + noise * rng.standard_normal(count))
    ends = [(codes + half - expected) / noise for half in (-0.5, 0.5)]
    mass = np.maximum(norm.cdf(ends[1]) - norm.cdf(ends[0]), 1e-300)
    dense = [norm.pdf(end) for end in ends]
    score = (dense[0] - dense[1]) / mass / noise
    bend = score**2 + (ends[1] * dense[1] - ends[0] * dense[0]) / mass / noise**2
    layout = bare(Layout, floor=np.hypot(noise, 1.0 / np.sqrt(12.0)))
    fits = [
        bare(LocalFit, layout=layout, residual=codes - expected - t, terms=Terms(mass, score, bend))
        for t in (0.0 * trace, trace)
    ]
    one = Refit(bare(Candidate, effect=CATALOGUE["return-spring"]), *fits, 5.0)
    shown = against(bare(Step, chosen="return-spring", refits={"return-spring": one}))
    assert shown is not None
    off = shown.before / shown.sd
    assert np.abs(off).max() < 4.0
    assert np.sum(off**2) < chi2.ppf(0.999, len(off))


@pytest.mark.parametrize("there", [1.0, 0.0])
def test_what_is_left_over_follows_what_an_effect_explains_if_it_is_there(there: float):
    """Strength 12: the slope of left over against explained has a standard deviation of 1/12."""
    rng = np.random.default_rng(16)
    trace = NOISE * np.tile(np.sin(3.0 * TIME) + (TIME > 2.0), 3)
    trace *= 12.1 / np.sqrt(np.sum((trace / NOISE) ** 2))
    noise = NOISE * rng.standard_normal(len(NOISE))
    bend = NOISE**-2.0
    fits = [
        bare(
            LocalFit,
            layout=bare(Layout, floor=NOISE),
            residual=noise + (there - taken) * trace,
            terms=Terms(noise, bend * (noise + (there - taken) * trace), bend),
        )
        for taken in (0.0, 1.0)
    ]
    one = Refit(bare(Candidate, effect=CATALOGUE["return-spring"]), *fits, 5.0)
    shown = against(bare(Step, chosen="return-spring", refits={"return-spring": one}))
    assert shown is not None
    assert len(shown.explained) == 24  # 12.1^2 / 6
    weight = shown.explained / shown.sd**2
    slopes = [weight @ left / (weight @ shown.explained) for left in (shown.before, shown.after)]
    error = 1.0 / np.sqrt(weight @ shown.explained)
    assert error == pytest.approx(1.0 / 12.0, rel=0.05)  # classes lose little of the strength
    assert slopes[0] == pytest.approx(there, abs=4.0 * error)
    assert slopes[1] == pytest.approx(there - 1.0, abs=4.0 * error)
    left, right = against_figure(shown, simulated=True).axes
    assert left.get_xlim() == right.get_xlim() == left.get_ylim() == right.get_ylim()


def test_what_would_have_shown_has_the_strength_that_is_told():
    trace = NOISE * np.tile(np.sin(3.0 * TIME), 3) / 50.0
    listed = tuple(
        bare(Candidate, effect=CATALOGUE[name], amplitude=label, level=level)
        for name, label, level in (
            ("coulomb-friction", "F_C", None),
            ("seating-slack", "slack", 2e-6),
            ("valve-event", "event_size", None),
        )
    )
    columns = np.stack([trace, trace, 0.0 * trace], axis=1)
    bend = NOISE**-2.0
    around = Around(0.0 * trace, bend, np.zeros((len(bend), 1)), np.zeros(1))
    screening = screen(around, columns)
    none = np.zeros(3)
    told = would_show(Explained(listed, screening, none, (), *(np.zeros(0),) * 2))
    label, size, unit = told["coulomb-friction"].split()
    assert (label, unit) == ("F_C", "N")
    strength = float(size) * np.linalg.norm(trace / NOISE)
    assert strength == pytest.approx(SHOWN, rel=0.05)  # two digits are told
    # Counted in levels of 2 um, whose traces these are.
    microns = float(told["seating-slack"].split()[1])
    assert microns == pytest.approx(2.0 * SHOWN / np.linalg.norm(trace / NOISE), rel=0.05)
    assert told["valve-event"] == "nothing shows"


def test_one_number_of_each_sort_is_told_and_the_rest_counted():
    moved = (
        Moved("kappa[frame-1,A]", "kappa", "share", "1", 0.08, 0.09, 6.0),
        Moved("kappa[frame-2,B]", "kappa", "share", "1", 0.07, 0.08, 7.0),
        Moved("mu", "mu", "", "N s/m", 8e4, 7e4, -4.0),
        Moved("k_LC", "k_LC", "stiffness", "N/m", 6e7, 6.01e7, 0.9),
    )
    said = told_moves(moved)
    assert said.index("share (kappa[frame-2,B]) from 0.07000 to 0.08000") < said.index("mu from 80")
    assert "frame-1" not in said
    assert "k_LC" not in said
    assert said.endswith("and 1 more.")
    assert told_moves(moved[3:]) == "No quoted number moved by as much as its uncertainty."


@pytest.mark.parametrize(
    ("apart", "often"), [(1.64, "95 %"), (0.0, "50 %"), (4.0, "more than 99 %")]
)
def test_a_record_is_proposed_with_how_often_it_tells(apart: float, often: str):
    taken = Parting(Change("free-run-1", flow=2.0), (apart,), 0.0, None)
    assert taken.sentence == (
        "a record like free-run-1, 2 times its flow fraction: with it, the two are told apart in "
        f"{often} of campaigns"
    )


def test_numbers_are_told_in_words_whatever_record_or_branch_they_are_of():
    names = ("viscous-friction", "frequency-dependent-friction")
    labels = ("mu[free-run]", "mu_branch[2]", "kappa[frame-2,B]", "L_0")
    law = Normal(jnp.asarray(0.0), jnp.asarray(1.0))
    model = bare(
        Hypothesis,
        problem=bare(Problem, effects=tuple(CATALOGUE[name] for name in names)),
        added=(),
        parameters=tuple(parameter(label, law) for label in labels),
    )
    assert meanings(model) == {
        "mu[free-run]": "viscous friction coefficient",
        "mu_branch[2]": "friction coefficient of a branch with memory",
        "kappa[frame-2,B]": KAPPA,
        "L_0": "",
    }


def odds(chance: dict[str, float], form: float = 0.0) -> Odds:
    return Odds({name: float(np.log(p)) for name, p in chance.items()}, {}, 0.0, form)


def test_the_answer_speaks_of_every_step():
    worded = tuple(bare(Candidate, effect=effect) for effect in CATALOGUE.values())
    steps = tuple(
        bare(
            Step, verdict=verdict, chosen=name, judged=None, next_record=record, refused={},
            explained=bare(Explained, p_value=0.004, listed=worded),
            said=odds({"nothing": 0.01, "unnamed": 0.1, name: 0.7, other: 0.19}, form),
        )
        for verdict, name, other, record, form in (
            ("named", "piston-leakage", "return-spring", None, 0.0),
            ("indistinguishable", "coulomb-friction", "stribeck-friction", "a free run", 0.06),
        )
    )  # fmt: skip
    said = dict(lead(bare(Outcome, steps=steps, settled=SETTLED, forms={}), None))
    far = Settled(0.0, (), 4.2, driven=(("L_0", -5.1),))
    warned = dict(lead(bare(Outcome, steps=steps, settled=far, forms={}), None))["How sure?"]
    assert warned[1:] == said["How sure?"]
    forms = {"coulomb-friction": OtherForm("speed", 7.4), "piston-leakage": OtherForm("time", 2.9)}
    varied = dict(lead(bare(Outcome, steps=steps, settled=SETTLED, forms=forms), None))["How sure?"]
    assert varied[0] == said["How sure?"][0]
    assert "let vary over speed by half and more, coulomb-friction explains" in varied[1]
    assert "7 nats better" in varied[1]
    assert warned[0].startswith("L_0 is 5.1 prior sds below its prior: a law that is not exact")
    first, second = said["What is it?"]
    assert "leaks past the piston" in first
    assert "coulomb-friction: a friction force on the plunger" in second
    assert "piston-leakage 0.70, return-spring 0.19" in said["How sure?"][0]
    assert "coulomb-friction 0.70, stribeck-friction 0.19" in said["How sure?"][1]
    assert "0.4 % of campaigns" in said["How sure?"][0]
    assert "no law is exact" not in said["How sure?"][0]
    assert "With a probability of 0.06 it is no second effect" in said["How sure?"][1]
    [following] = said["What next?"]
    assert "take a free run." in following
    assert "exact laws" not in following
    rest = bare(
        Step, verdict="unnamed", chosen=None, judged=None, next_record=None, refused={},
        explained=bare(Explained, p_value=0.004, listed=()), said=odds({"unnamed": 0.99}),
        place=Where("free-run-1", "A", "pressure", None, None),
    )  # fmt: skip
    [following] = dict(lead(bare(Outcome, steps=(*steps, rest), settled=SETTLED, forms={}), None))[
        "What next?"
    ]
    assert "what is left says that one is not" in following


def test_an_effect_that_fails_a_check_is_told_with_its_reason_and_not_named():
    refused = {"piston-leakage": "the gap grows with it, from 1.19 to 1.27"}
    step = bare(
        Step, verdict="unnamed", chosen=None, judged=None, next_record=None, refused=refused,
        explained=bare(Explained, p_value=0.004, listed=()),
        said=odds({"nothing": 0.01, "unnamed": 0.1, "piston-leakage": 0.7}),
        place=Where("free-run-1", "A", "pressure", None, None),
    )  # fmt: skip
    outcome = bare(Outcome, steps=(step,), settled=SETTLED, forms={})
    [what] = dict(lead(outcome, None))["What is it?"]
    assert "(probability 0.70) but is not named: the gap grows with it" in what
    assert "Missing:" not in ruling(outcome)


@pytest.mark.parametrize(
    ("nothing", "p_value", "said"),
    [
        (0.01, 0.0029, True),
        (0.2, 0.0029, True),
        (0.01, 0.003, False),  # chance alone leaves as much too often
        (0.3, 0.0029, False),  # hardly three to one, and not as rare as it then has to be
        (0.4, 0.001, True),
        (0.51, 0.0001, False),  # nothing is likelier
    ],
)
def test_the_less_odds_say_the_rarer_by_chance_what_is_missing_has_to_be(nothing, p_value, said):
    assert is_missing(nothing, p_value) is said


@pytest.mark.parametrize(("nothing", "says"), [(0.6, "Nothing is missing"), (0.3, "do not decide")])
def test_it_is_not_said_that_nothing_is_missing_where_that_is_less_likely_than_not(nothing, says):
    outcome = bare(Outcome, steps=(), last_probability={"nothing": nothing, "unnamed": 1 - nothing})
    assert says in ruling(outcome)

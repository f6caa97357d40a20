"""Where records and predictions disagree: false alarms, places, the count of all that is tried."""

import numpy as np
import pytest
from scipy.stats import binom

from rigid.discovery.disagreement import ALL, Disagreement, Pool, judged, looks
from rigid.localfit.samples import ChannelKey
from rigid.report.discovery.compared import Compared, sentence, shown, table, told
from rigid.report.discovery.figures.where import compared_figure

SAMPLES, DRAWS, INTERVAL = 400, 300, 0.01
TIME = INTERVAL * np.arange(SAMPLES)
STATES = {"speed": np.cos(4.0 * TIME), "pressure": np.sin(11.0 * TIME)}
RECORDS = {f"free-run-{n},A": (f"free-run-{n}", "A") for n in (1, 2)}
CHANNELS = [
    ChannelKey(f"free-run-{n},A", "free-run", q, f"{q},A", INTERVAL)
    for n in (1, 2)
    for q in ("load", "pressure")
]


def looked_at(seed: int, change: dict[int, np.ndarray] | None = None) -> tuple[Disagreement, ...]:
    """White noise in four channels, with changes in some of them."""
    rng = np.random.default_rng(seed)
    channels, tests = [], []
    pools = {"load": Pool(), "pressure": Pool()}
    for number, channel in enumerate(CHANNELS):
        series = rng.standard_normal((SAMPLES, 1 + DRAWS))
        series[:, 0] += (change or {}).get(number, 0.0)
        for test in looks(series, TIME, INTERVAL, STATES):
            channels.append(channel)
            tests.append(test)
        pools[channel.quantity].add(series, STATES)
    for quantity, pool in pools.items():
        together = list(pool.looks())
        channels += [ChannelKey(ALL, "", quantity, quantity, 0.0)] * len(together)
        tests += together
    return judged(channels, tests)


@pytest.mark.slow
def test_one_campaign_in_ten_has_a_p_value_of_a_tenth_and_far_more_without_the_count():
    runs = [looked_at(seed) for seed in range(200)]
    least = np.array([min(one.p_value for one in found) for found in runs])
    alarms = int((least <= 0.1).sum())
    low, high = binom.ppf([0.001, 0.999], len(runs), 0.1)
    assert low <= alarms <= high
    careless = np.array([min(one.alone for one in found) for found in runs])
    assert (careless <= 0.1).sum() > 2 * high


def test_a_push_for_a_while_shows_over_time_where_it_is():
    push = np.where((TIME > 1.0) & (TIME < 1.4), 1.2, 0.0)
    first = looked_at(1, {2: push})[0]
    assert (first.record, first.quantity, first.over) == ("free-run-2,A", "load", "time")
    assert first.p_value < 0.01
    assert 0.9 < first.where[0] < first.where[1] < 1.5


def test_a_push_of_forty_sds_is_no_more_than_certain():
    push = np.where((TIME > 1.0) & (TIME < 1.4), 40.0, 0.0)
    first = looked_at(1, {2: push})[0]
    assert first.p_value == pytest.approx(1.0 / (1 + DRAWS))


def test_a_line_shows_at_its_frequency():
    first = looked_at(2, {1: 0.6 * np.sin(2.0 * np.pi * 12.0 * TIME)})[0]
    assert (first.quantity, first.over) == ("pressure", "frequency")
    assert first.where[0] == pytest.approx(12.0, abs=0.3)
    assert first.p_value < 0.01


def test_what_goes_by_a_state_shows_over_it():
    by_speed = np.where(STATES["speed"] < -0.85, 0.9, 0.0)  # in two stretches of time
    looked = looked_at(3, {0: by_speed})
    found = {o.over: o for o in looked if (o.record, o.quantity) == ("free-run-1,A", "load")}
    assert found["speed"].p_value < 0.01
    assert found["speed"].where[1] < -0.7


def test_what_goes_by_a_state_in_all_records_shows_in_all_together_before_it_does_in_one():
    by_speed = np.where(STATES["speed"] < -0.85, 0.35, 0.0)
    sure = {"all": 0, "one": 0}
    for seed in range(20):
        for one in looked_at(seed, {0: by_speed, 2: by_speed}):
            if (one.quantity, one.over) == ("load", "speed") and one.p_value < 0.05:
                sure["all" if one.record == ALL else "one"] += 1
    # Of 100 samples in two records, 3.5 sds: beyond the twentieth of all in half of the campaigns;
    # of 50 samples, 2.5 sds, in one of ten, and there are two such records.
    assert sure["all"] / 20 > 0.2
    assert sure["one"] / 40 < 0.5 * sure["all"] / 20


def test_a_state_that_is_nothing_but_rounding_is_told_as_nothing():
    """A load that starts from rest is -2e-15 N there, by the rounding of the solver."""
    series = np.random.default_rng(5).standard_normal((SAMPLES, 1 + DRAWS))
    load = np.where(TIME < 1.0, -2e-15, 500.0 * TIME)
    series[:, 0] += np.where(TIME < 1.0, 2.0, 0.0)
    found = {look.over: look for look in looks(series, TIME, INTERVAL, {"load": load})}
    pool = Pool()
    for _ in range(2):
        pool.add(series, {"load": load})
    for look in (found["load"], *pool.looks()):
        assert look.where[0] == 0.0
        assert -look.log_p[0] > 5.0


def test_samples_that_resemble_the_one_before_show_at_their_lag():
    rng = np.random.default_rng(4)
    drawn = rng.standard_normal(SAMPLES + 1)
    found = looked_at(4, {3: 2.0 * (drawn[1:] + drawn[:-1])})
    mine = [one for one in found if one.over == "lag" and one.p_value < 0.05]
    assert [(one.record, one.quantity, one.where) for one in mine] == [
        ("free-run-2,A", "pressure", (INTERVAL, INTERVAL))
    ]


def test_what_is_told_is_sure_or_the_one_that_comes_nearest():
    push = np.where((TIME > 1.0) & (TIME < 1.4), 1.2, 0.0)
    seeds = (seed for seed in range(5, 50) if looked_at(seed)[0].p_value > 0.1)
    quietest = next(seeds)
    nothing, something = looked_at(quietest), looked_at(quietest, {2: push})
    quiet = told(Compared(nothing, None, RECORDS))
    assert len(quiet) == 1
    assert quiet[0]["p_value_after"] is None
    assert table(quiet) == ()
    assert "nowhere beyond chance" in sentence(Compared(nothing, None, RECORDS))
    after = {(o.record, o.quantity, o.over): o for o in nothing}
    both = Compared(something, after, RECORDS)
    loud = told(both)
    assert all(one["p_value"] < 0.05 for one in loud)
    assert loud[0]["unit"] == "s"
    row = table(loud)[0]
    assert row[:2] == ("free-run-2,A load", "time")
    assert loud[0]["p_value"] < 0.05 < loud[0]["p_value_after"]
    assert " of 24 comparisons" in sentence(both)
    picture = shown(both)
    assert picture.over == ("time", "frequency", "lag", "speed", "pressure")
    assert picture.after is not None
    assert picture.before.shape == picture.after.shape == (6, 5)
    assert len(compared_figure(picture, simulated=True).axes) == 3


def test_a_channel_that_is_too_short_leaves_nothing_to_say():
    assert judged([], []) == ()
    assert sentence(Compared((), None, {})).startswith("No channel")


def test_half_the_sampling_rate_is_no_surer_than_any_other_frequency():
    """Its power has one degree of freedom, that of others two: taken for two, it wins too often."""
    rng, runs, samples = np.random.default_rng(6), 1000, 100
    last = 0
    for _ in range(runs):
        series = rng.standard_normal((samples, 40))
        found = {look.over: look for look in looks(series, np.arange(float(samples)), 1.0, {})}
        last += found["frequency"].where[0] == 0.5
    # 1000/50 by chance; 99.9 % of a binomial law
    assert last <= binom.isf(0.001, runs, 1.0 / 50)

"""What is set aside: spikes, and samples beyond a sensor's range; in a search as in a refit."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from test_screening import SHEETS, campaign, fitted

from rigid.inference.derived import channels, overall_gap
from rigid.inference.search import search
from rigid.likelihood.set_aside import Readings, beyond, listed, readings_of, spikes
from rigid.localfit.ascent import refined
from rigid.localfit.leave_one_out import gap
from rigid.localfit.local import LocalFit
from rigid.localfit.noise.leftover import Traces
from rigid.localfit.noise.weights import facts
from rigid.localfit.samples import aside_of, data_of, lay_out
from rigid.report.taken import lines, sentences, taken
from rigid.spec import find_spec, load_spec


def readings(local: LocalFit) -> Readings:
    return readings_of(local.layout.problem, local.hypothesis.sigmas(local.z_noise))


def spiked(problem):
    """Every fiftieth reading of the load is off: by 9 and by -16 of its noise in turn."""
    pieces = tuple(
        eqx.tree_at(
            lambda p: p.data,
            p,
            p.data.at[25::100].add(9.0 * p.sheet.floor).at[75::100].add(-16.0 * p.sheet.floor),
        )
        if p.quantity == "load"
        else p
        for p in problem.pieces
    )
    return dataclasses.replace(problem, pieces=pieces)


@pytest.mark.slow
def test_spikes_are_found_though_the_noise_level_that_was_fitted_holds_them():
    """Those of 16 sds raise it so that those of 9 stand less than 6 of the fitted sds off."""
    problem = campaign(304)
    local, clean = fitted(spiked(problem))[0], fitted(problem)[0]
    assert spikes(readings(clean), clean.residual).sum() == 0
    loads = np.array([c.quantity == "load" for c in local.layout.channels])[local.layout.channel]
    sample = np.concatenate([np.arange(500)] * len(local.layout.channels))
    np.testing.assert_array_equal(
        spikes(readings(local), local.residual), loads & (sample % 50 == 25)
    )


@pytest.mark.slow
def test_a_gauge_at_the_end_of_its_range_says_nothing_there():
    local, _ = fitted(campaign(304))
    pressure = np.array([c.quantity == "pressure" for c in local.layout.channels])
    rows = pressure[local.layout.channel]
    assert not beyond(readings(local), local.residual).any()
    data = data_of(local.layout)
    end = float(data[rows].max()) - 8.0 * local.layout.floor[rows].max()
    problem = local.layout.problem
    pieces = tuple(
        eqx.tree_at(lambda p: p.data, p, jnp.minimum(p.data, end))
        if p.quantity == "pressure"
        else p
        for p in problem.pieces
    )
    layout = lay_out(dataclasses.replace(problem, pieces=pieces))
    residual = local.residual + np.where(rows, np.minimum(data, end) - data, 0.0)
    cut = dataclasses.replace(local, layout=layout, residual=residual)
    expected = data_of(layout) - residual
    step, found = SHEETS["pressure"].step, beyond(readings(cut), residual)
    np.testing.assert_array_equal(found, rows & (expected > end - 0.5 * step))
    assert found.sum() > 50


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("noise", [0.2, 0.3, 1.0])
def test_a_rig_that_holds_below_what_a_model_says_has_not_come_to_the_end_of_a_range(noise, seed):
    """The converter goes on to turn over; a gauge at its end stands still. Steps are 1."""
    rng = np.random.default_rng(seed)
    time = np.arange(600)
    fit = np.minimum(time, 300) / 5.0
    truth = np.where(time > 250, 49.7, time / 5.0)  # it holds, the model does not know
    whole = np.round(truth + noise * rng.standard_normal(time.size))
    cut = np.minimum(np.round(fit + noise * rng.standard_normal(time.size)), 50.0)
    sd = np.full(time.size, np.sqrt(noise**2 + 1 / 12))
    once = np.zeros(time.size, dtype=int)

    def found(data):
        given = Readings(data, once == 0, sd, np.ones(time.size), once, once)
        return beyond(given, data - fit)

    assert not found(whole).any()
    np.testing.assert_array_equal(found(cut), fit > 49.5)


@pytest.mark.slow
def test_a_search_sets_the_same_samples_aside_and_finds_the_noise_of_the_rest():
    plain = campaign(304)
    found, clean = search(spiked(plain), 2, 1), search(plain, 2, 1)
    assert not clean.aside.any()
    told = listed(found.problem, found.aside)
    assert [(one.record, one.quantity, len(one.times)) for one in told] == [
        ("free-run-1", "load", 10), ("free-run-2", "load", 10)
    ]  # fmt: skip
    at = found.problem.parameters.index("noise[load,A]")
    spread = np.sqrt(clean.optima[0].covariance[at, at])
    # a fiftieth fewer samples: the level moves by sqrt(1/50) of its own spread or so
    assert abs(found.optima[0].z[at] - clean.optima[0].z[at]) < spread
    free = np.array([p.base != "noise" for p in found.problem.parameters.sampled])
    moved = (found.optima[0].z - clean.optima[0].z)[free]
    assert np.abs(moved / np.sqrt(np.diag(clean.optima[0].covariance)[free])).max() < 1.0
    assert aside_of(lay_out(found.problem)) == ()  # they are as if never read


@pytest.mark.slow
def test_fit_laws_and_discover_have_one_gap():
    """They end in one optimum by ways of their own, so that gaps agree to a thousandth.

    With the spikes, which both set aside, the gap would be half as large again.
    """
    problem = spiked(campaign(304))
    found = search(problem, 2, 1)
    fit = overall_gap(channels(found, found.optima[0].z[None], 1))
    local = fitted(problem)[0]
    refitted = refined(facts(local, Traces.of(np.zeros((local.residual.size, 0)))).of(local))
    assert abs(gap(refitted) - fit) < 1e-3
    assert abs(fit - 1.0) < 0.1
    assert gap(local) > 1.4


@pytest.mark.slow
def test_what_is_set_aside_and_held_exact_is_told():
    spec = load_spec(find_spec("calibration"))
    problem = spiked(campaign(304))
    layout = lay_out(problem)
    weight = layout.weight.copy()
    weight[25:500:50] = 0.0
    made = taken(spec, problem, aside_of(layout.weighed(weight)))
    [aside] = made["set_aside"]
    assert aside["samples"] == 10
    assert aside["time_s"][:2] == [0.25, 0.75]
    names = {one["name"] for one in made["held_exact"]}
    assert {"S_Pl", "pump-curve", "free-run"} <= names
    held, told = sentences(made)
    assert "S_Pl = " in held
    assert "10 samples of" in told
    assert any(line.startswith("set aside: 10 of") for line in lines(made))


def one_channel(residual: np.ndarray) -> Readings:
    """A channel whose noise was fitted to all that is left."""
    same = np.zeros(len(residual), dtype=int)
    ones = np.ones(len(residual))
    return Readings(residual, ones > 0.0, residual.std() * ones, 0.0 * ones, same, same)


@pytest.mark.parametrize(("every", "found"), [(100, True), (25, True), (15, False), (10, False)])
def test_where_many_samples_stand_off_none_is_a_spike(every, found):
    """One in twenty-five is single; one in ten is what a model lacks, or noise of another law.

    Sizes differ, so that the greatest do not hide the others in the noise level.
    """
    residual = np.random.default_rng(4).standard_normal(1000)
    residual[7::every] += np.geomspace(40.0, 1e4, len(residual[7::every]))
    expected = np.zeros(1000, dtype=bool)
    expected[7::every] = found
    np.testing.assert_array_equal(spikes(one_channel(residual), residual), expected)

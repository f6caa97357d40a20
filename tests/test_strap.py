"""A strap that takes its time: the mean of sudden releases, against diffrax under its force."""

import dataclasses
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from rigs import BASE, NOMINAL, effects, release_problem

from rigid.effects.gradual_release import GradualRelease
from rigid.likelihood.assemble import assemble
from rigid.likelihood.groups import predictions
from rigid.likelihood.problem import Problem
from rigid.physics import full, release
from rigid.physics.rig import build_rig
from rigid.physics.strap import GONE, REACH, edges, gradual
from rigid.records.read import read_records
from rigid.report.taken import taken
from rigid.spec import Spec, parse_spec

EXAMPLE = Path(__file__).parents[1] / "fits" / "calibration.toml"
INTERVAL, SAMPLES, PRELOAD = 1.0 / 1600.0, 64, 6000.0
NOISE = 0.35
"""m/s^2, of one sample of the accelerometer by its sheet."""


RINGING = {"mounting": 0.4, "zeta_mounting": 0.07}
"""An accelerometer that swings on its mounting, its frequency apart."""


def both(duration, begin, end, late, names=BASE, values=NOMINAL) -> tuple[np.ndarray, np.ndarray]:
    """Acceleration (samples, cases) by steps and by diffrax; `late`: first sample, in intervals."""
    cases = [jnp.asarray(x, float) for x in np.broadcast_arrays(duration, begin, end, late)]
    count = len(cases[0])
    rig = build_rig(effects(names), {k: jnp.full(count, v) for k, v in values.items()})
    preload, delay = jnp.full((1, count), PRELOAD), INTERVAL * cases[3][None]
    law = edges(cases[0], cases[1], cases[2])[:, None]
    fast = gradual(release.ring, rig, preload, law, (delay, INTERVAL), SAMPLES + REACH)
    asked = delay - REACH * INTERVAL, INTERVAL
    slow = full.let_go(rig, preload, law, asked, SAMPLES + REACH)
    return np.asarray(fast)[:, 0], np.asarray(slow)[:, 0]


@pytest.mark.slow
@pytest.mark.parametrize("shape", [(0.02, 0.02), (1.0, 1.0), (6.0, 0.05), (0.05, 6.0)])
def test_the_mean_of_sudden_releases_is_the_gradual_one(shape: tuple[float, float]):
    """Half a sd of the noise is what the check `solver` admits; a sample early or late too."""
    durations, late = [1e-4, 4e-4, 2e-3, 3e-3], [0.1, 0.5, 1.3, -0.6]
    fast, slow = both(durations, *shape, late)
    assert np.abs(fast - slow).max() < 0.5 * NOISE
    assert np.sqrt(np.mean((fast - slow) ** 2)) < 0.1 * NOISE
    sudden, _ = both([1e-9] * 4, *shape, late)
    assert np.abs(sudden - slow).max(axis=0).min() > 3.0 * NOISE  # it is no small matter


@pytest.mark.slow
@pytest.mark.parametrize("frequency", [600.0, 1000.0])
def test_what_swings_as_fast_as_it_is_sampled_swings_less_the_slower_a_strap_is(frequency: float):
    """With one sudden release a sample readings would be off by 4.5 and 18 sds of the noise."""
    names = (*BASE, "accelerometer-resonance")
    values = NOMINAL | RINGING | {"f_mounting": frequency}
    fast, slow = both([2e-4, 1e-3, 3e-3], 0.3, 0.3, [0.3, 0.5, -0.6], names, values)
    assert np.abs(fast - slow).max() < 0.03 * NOISE


@pytest.mark.slow
def test_a_strap_that_goes_at_once_is_a_sudden_release():
    fast, _ = both([1e-9, 1e-9], 1.0, 1.0, [0.2, 0.9])
    names = {k: jnp.full(2, v) for k, v in NOMINAL.items()}
    rig = build_rig(effects(BASE), names)
    delay = INTERVAL * jnp.asarray([[0.2, 0.9]])
    swing = release.ring(rig, jnp.full((1, 2), PRELOAD), delay, INTERVAL, SAMPLES)
    np.testing.assert_allclose(fast[REACH:], swing[:, 0], atol=1e-2 * NOISE)
    np.testing.assert_allclose(fast[:REACH], 0.0, atol=1e-2 * NOISE)


@pytest.mark.parametrize(
    ("shape", "quantile"),
    [
        ((1e-4, 1e-4), lambda u: np.log(u / (1.0 - u))),
        ((1.0, 1.0), lambda u: u),
        ((1e3, 1e-4), lambda u: -np.log(1.0 - u)),
    ],
)
def test_the_law_of_a_strap_is_logistic_linear_or_exponential(shape, quantile):
    inner = slice(1, -1)
    found = np.asarray(edges(jnp.asarray([2e-3]), *shape))[inner, 0]
    wide = quantile(0.9) - quantile(0.1)
    expected = 2e-3 * (quantile(GONE[inner]) - quantile(0.2)) / wide
    np.testing.assert_allclose(found, expected, atol=2e-3 * 2e-3)


def spec_with(effect: str = "", vary: str = "") -> Spec:
    """The reference campaign, with an effect more, and what varies."""
    text = EXAMPLE.read_text("utf-8")
    text = text.replace("[model]\neffects = [", f"[model]\nvary = {{{vary}}}\neffects = [{effect}")
    return parse_spec(text, EXAMPLE)


def assembled(spec: Spec) -> Problem:
    return assemble(spec, read_records(spec))


def held_exact(spec: Spec) -> list[str]:
    return [one["name"] for one in taken(spec, assembled(spec), ())["held_exact"]]


def test_straps_take_their_time_where_the_effect_is_in_the_model_and_nowhere_else():
    named = f'"{GradualRelease.name}",'
    plain, gradual = spec_with(), spec_with(named)
    own = spec_with(named, 'release_duration = "record"')
    labels = [set(assembled(spec).parameters.labels) for spec in (plain, gradual, own)]
    shape = {"release_begin", "release_end"}
    leads = {f"release_lead[release-{n},A]" for n in (1, 2)}
    lasting = {f"release_duration[release-{n},A]" for n in (1, 2)}
    assert labels[1] - labels[0] == {"release_duration", *shape, *leads}
    assert labels[2] - labels[0] == lasting | shape | leads
    assert "release" in held_exact(plain)
    assert "release" not in held_exact(gradual)


@pytest.mark.slow
def test_a_strap_that_begins_earlier_lets_go_earlier():
    (group,) = release_problem({}).groups
    group = dataclasses.replace(group, effects=effects((*BASE, GradualRelease.name)))
    (one,) = group.tracks
    own = {"release_duration": 2e-3, "release_begin": 0.3, "release_end": 0.3}
    own |= {f"preload[{one.label}]": PRELOAD, f"release_time[{one.label}]": 15.4 * one.interval}

    def read(lead: float) -> np.ndarray:
        values = NOMINAL | own | {f"release_lead[{one.label}]": lead}
        found = predictions([group], [{k: jnp.asarray([v]) for k, v in values.items()}])
        return np.asarray(found[0]["acceleration"])[:, 0, 0]

    usual, earlier = read(0.0), read(one.interval)
    np.testing.assert_allclose(earlier[:-1], usual[1:], atol=0.1 * NOISE)
    assert np.abs(earlier - usual).max() > 3.0 * NOISE

"""A strap that takes its time: the mean of sudden releases, against diffrax under its force."""

from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from rigs import BASE, NOMINAL, effects

from rigid.likelihood.assemble import assemble
from rigid.likelihood.problem import Problem
from rigid.physics import full, release
from rigid.physics.rig import build_rig
from rigid.physics.strap import GONE, REACH, abrupt, edges, lattice, let_go
from rigid.records.read import read_records
from rigid.report.taken import taken
from rigid.spec import Spec, parse_spec

EXAMPLE = Path(__file__).parents[1] / "fits" / "calibration.toml"
INTERVAL, SAMPLES, PRELOAD = 1.0 / 1600.0, 64, 6000.0
NOISE = 0.35
"""m/s^2, of one sample of the accelerometer by its sheet."""


def both(duration, begin, end, late) -> tuple[np.ndarray, np.ndarray]:
    """Acceleration (samples, cases) by steps and by diffrax; `late`: first sample, in intervals."""
    cases = [jnp.asarray(x, float) for x in np.broadcast_arrays(duration, begin, end, late)]
    count = len(cases[0])
    names = {k: jnp.full(count, v) for k, v in NOMINAL.items()}
    rig = build_rig(effects(BASE), names)
    preload, delay = jnp.full((1, count), PRELOAD), INTERVAL * cases[3][None]
    law = edges(cases[0], cases[1], cases[2])[:, None]
    at = lattice(delay, INTERVAL)
    swing = release.ring(rig, preload, at.delay, INTERVAL, SAMPLES + REACH)
    fast = let_go(swing, abrupt(rig, preload, INTERVAL), at, law, INTERVAL)
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


def spec_with(priors: str) -> Spec:
    """The reference campaign with priors of its own."""
    return parse_spec(f"{EXAMPLE.read_text('utf-8')}\n[priors]\n{priors}\n", EXAMPLE)


def assembled(spec: Spec) -> Problem:
    return assemble(spec, read_records(spec))


def held_exact(spec: Spec) -> list[str]:
    return [one["name"] for one in taken(spec, assembled(spec), ())["held_exact"]]


def test_a_duration_is_inferred_where_a_spec_has_a_prior_for_it_and_nowhere_else():
    law = "{ lognormal = { median = 1e-3, factor = 4.0 } }"
    specs = [
        spec_with(priors)
        for priors in (
            "",
            f'"release_duration[release-2,A]" = {law}',
            f"release_duration = {law}",
        )
    ]
    plain, one, every = map(assembled, specs)
    shape = {"release_begin", "release_end"}
    new = [set(p.parameters.labels) - set(plain.parameters.labels) for p in (one, every)]
    lasting = {f"release_duration[release-{n},A]" for n in (1, 2)}
    assert new == [{"release_duration[release-2,A]", *shape}, lasting | shape]
    assert "release" in held_exact(specs[0])
    assert "release" not in held_exact(specs[2])
    law = next(p.prior for p in every.parameters.sampled if p.base == "release_time")
    wide = law.from_standard(np.array([-9.0, 9.0]))
    assert wide[1] - wide[0] == pytest.approx(3.0 * INTERVAL, rel=1e-3)

"""Evidence and posterior of the stories against closed forms and fine grids."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import logsumexp
from scipy.stats import norm
from test_stories import SPEC, printed_as

from rigid.published.catalogue import CAUSES
from rigid.published.evidence import adapted, evidence, resampled
from rigid.published.running import common_given, log_density


def gaussian(z, centre, sd):
    return np.sum(norm.logpdf(z, centre, sd), axis=1)


def test_evidence_of_a_gaussian_likelihood():
    """Prior N(0, 1), likelihood N(z; c, s): evidence N(c; 0, sqrt(1 + s^2)) in each dimension."""
    centre, sd = np.array([1.5, -0.5, 2.0, 0.0, 1.0, 0.5]), 0.2

    def questions(z):
        return gaussian(z, centre, sd)[None]

    cloud = adapted(questions, 6, 1)
    found = evidence(questions(cloud.z)[0] + cloud.log_ratio)
    exact = np.sum(norm.logpdf(centre, 0.0, np.sqrt(1 + sd**2)))
    assert found.error < 0.08
    assert found.log == pytest.approx(exact, abs=4 * found.error)


def two_modes(z):
    return np.logaddexp(
        np.log(0.5) + gaussian(z, [-1.5, 0.3], [0.15, 0.4]),
        np.log(0.5) + gaussian(z, [2.0, -0.3], [0.1, 0.2]),
    )


def grid():
    x = np.linspace(-6, 6, 1201)
    points = np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2)
    log = two_modes(points) + gaussian(points, 0.0, 1.0) + 2 * np.log(x[1] - x[0])
    return points, log


def test_two_modes_come_out_in_proportion_on_a_fine_grid():
    points, log = grid()
    exact = logsumexp(log)
    share = np.exp(logsumexp(log[points[:, 0] < 0]) - exact)
    cloud = adapted(lambda z: two_modes(z)[None], 2, 3)
    weight = two_modes(cloud.z) + cloud.log_ratio
    found = evidence(weight)
    assert found.log == pytest.approx(exact, abs=4 * found.error)
    picked = cloud.z[resampled(weight, 4000, np.random.default_rng(1))]
    scatter = np.sqrt(share * (1 - share) / found.effective)
    assert np.mean(picked[:, 0] < 0) == pytest.approx(share, abs=4 * scatter)


def test_a_broken_proportion_would_be_seen():
    """Weights without the prior's ratio, a plausible slip, miss the grid by many errors."""
    _, log = grid()
    cloud = adapted(lambda z: two_modes(z)[None], 2, 3)
    broken = evidence(two_modes(cloud.z))
    assert abs(broken.log - logsumexp(log)) > 10 * broken.error


def test_emcee_agrees():
    import emcee

    start = np.random.default_rng(2).standard_normal((64, 1)) * 0.1 + 1.0

    def density(z):
        return gaussian(z, 1.2, 0.3) + gaussian(z, 0.0, 1.0)

    sampler = emcee.EnsembleSampler(64, 1, density, vectorize=True)
    sampler.random_state = np.random.RandomState(3).get_state()
    sampler.run_mcmc(start, 400)
    chain = sampler.get_chain(discard=100, flat=True)[:, 0]
    cloud = adapted(lambda z: gaussian(z, 1.2, 0.3)[None], 1, 5)
    weight = gaussian(cloud.z, 1.2, 0.3) + cloud.log_ratio
    picked = cloud.z[resampled(weight, 4000, np.random.default_rng(1)), 0]
    assert picked.mean() == pytest.approx(chain.mean(), abs=0.03)
    assert picked.std() == pytest.approx(chain.std(), abs=0.03)


def cause(key):
    return next(c for c in CAUSES if c.key == key)


def test_free_running_density_against_quadrature():
    """The common number integrated out by hand: a product of two Gaussians times its prior."""
    published, one = SPEC.published, cause("slow")
    seen = np.log([published.mu_A.value, published.mu_B.value])
    sds = [np.hypot(np.log(1.5), np.hypot(p.sd, p.half_width / np.sqrt(3)) / p.value)
           for p in (published.mu_A, published.mu_B)]  # fmt: skip
    median, factor = one.prior["catalogue"]

    def joint(c):
        return (norm.pdf(c, np.log(median), np.log(factor))
                * norm.pdf(seen[0], c, sds[0]) * norm.pdf(seen[1], c, sds[1]))  # fmt: skip

    exact = np.log(quad(joint, 8.0, 20.0, epsabs=1e-14, limit=200)[0])
    found = log_density(one, "catalogue", np.array([1e-6]), published)[0]
    assert found == pytest.approx(exact, abs=1e-6)
    mean = quad(lambda c: c * joint(c), 8.0, 20.0, epsabs=1e-14, limit=200)[0] / np.exp(exact)
    drawn = common_given(one, "catalogue", np.full(4000, 1e-6), published,
                         np.random.default_rng(1).standard_normal(4000))  # fmt: skip
    assert np.log(drawn).mean() == pytest.approx(mean, abs=4 * 0.3 / np.sqrt(4000))


def test_the_density_of_free_running_integrates_to_one():
    """Over all pairs of prints above the friction of the release, whose Jacobian is in it."""
    published, one, friction = SPEC.published, cause("coulomb"), np.array([5e5])
    # Substituting log(mu - friction) for log mu spreads the points where the density is.
    rest = np.linspace(np.log(1e2), np.log(1e10), 60)
    seen = np.exp(rest) + friction
    step = (rest[1] - rest[0]) * np.exp(rest) / seen
    total = 0.0
    for a, wide in zip(seen, step, strict=True):
        for b, high in zip(seen, step, strict=True):
            changed = published.model_copy(
                update={
                    "mu_A": printed_as(published.mu_A, a),
                    "mu_B": printed_as(published.mu_B, b),
                }
            )
            total += wide * high * np.exp(log_density(one, "indifferent", friction, changed)[0])
    assert total == pytest.approx(1.0, abs=0.01)


def test_friction_of_the_release_cannot_exceed_what_is_printed():
    published = SPEC.published
    found = log_density(cause("coulomb"), "catalogue", np.array([1e3, 2e6]), published)
    assert np.isfinite(found[0])
    assert found[1] < -1e6 or np.isneginf(found[1])

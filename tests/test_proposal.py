"""The mixture over the modes and the weights of the modes."""

import numpy as np
import pytest
from scipy import stats
from scipy.special import logsumexp
from targets import two_modes

from rigid.inference.proposal import MixtureProposal, Mode, mode_weights, pareto_shape
from rigid.io.errors import UnusableResultError

FACTOR = np.array([[1.0, 0.0], [0.7, 0.4]])
OTHER = np.array([[0.3, 0.0], [-0.1, 2.0]])


def mixture():
    modes = (Mode(np.array([1.0, -2.0]), FACTOR, 0.0), Mode(np.array([4.0, 0.0]), OTHER, 0.0))
    return MixtureProposal(modes, np.array([0.3, 0.7]), dof=7.0)


def laid(*modes):
    return MixtureProposal(modes, np.ones(len(modes)))


def test_density_is_that_of_scipy():
    law = mixture()
    z = np.random.default_rng(1).normal(scale=4.0, size=(50, 2))
    parts = [
        stats.multivariate_t(m.mean, m.covariance_factor @ m.covariance_factor.T, df=7.0).logpdf(z)
        for m in law.modes
    ]
    expected = logsumexp(np.array(parts).T + np.log([0.3, 0.7]), axis=1)
    np.testing.assert_allclose(law.log_density(z), expected, rtol=1e-12)


@pytest.mark.parametrize("legacy", [False, True])
def test_draws_have_the_moments_of_the_law(legacy):
    law = mixture()
    rng = np.random.RandomState(3) if legacy else np.random.default_rng(3)
    z = law.sample(rng, 200_000)
    means = np.stack([m.mean for m in law.modes])
    mean = law.weights @ means
    scales = [m.covariance_factor @ m.covariance_factor.T * 7 / 5 for m in law.modes]
    second = sum(
        w * (s + np.outer(m, m)) for w, s, m in zip(law.weights, scales, means, strict=True)
    )
    products = z[:, :, None] * z[:, None, :]
    for draws, expected in ((z, mean), (products, second)):
        error = draws.std(axis=0) / np.sqrt(len(z))
        assert np.all(np.abs(draws.mean(axis=0) - expected) < 4.5 * error)


def test_draws_agree_with_the_density():
    """E[p(z) / g(z)] over draws from g is one for any density p: here a Gaussian inside g."""
    law = mixture()
    z = law.sample(np.random.default_rng(5), 50_000)
    inside = stats.multivariate_normal([2.0, -1.0], [[2.0, 0.0], [0.0, 1.0]])
    ratio = np.exp(inside.logpdf(z) - law.log_density(z))
    assert abs(ratio.mean() - 1.0) < 4 * ratio.std() / np.sqrt(len(z))


def test_weights_are_kept_to_the_last_bit():
    law = mixture()
    again = MixtureProposal(law.modes, law.weights)
    assert again.weights.tobytes() == law.weights.tobytes()
    np.testing.assert_allclose(
        MixtureProposal(law.modes, np.array([3.0, 1.0])).weights, [0.75, 0.25]
    )


def test_points_go_to_the_mode_they_lie_at():
    _, modes = two_modes()
    law = MixtureProposal(modes, np.array([0.5, 0.5]))
    assert list(law.mode_of(np.stack([m.mean for m in modes]))) == [0, 1]
    np.testing.assert_allclose(
        law.responsibilities(law.sample(np.random.default_rng(0), 9)).sum(1), 1
    )


def test_a_wider_law_belongs_to_its_mode():
    _, modes = two_modes()
    wider = tuple(Mode(m.mean, 3.0 * m.covariance_factor, 0.0) for m in modes)
    law = MixtureProposal(modes, np.array([0.4, 0.3, 0.2, 0.1]), 6.0, wider)
    z = law.sample(np.random.default_rng(0), 500)
    shares, by_law = law.shares(z), law.responsibilities(z)
    np.testing.assert_allclose(shares, by_law[:, :2] + by_law[:, 2:])
    assert list(law.mode_of(z)) == list(shares.argmax(axis=1))
    np.testing.assert_allclose(
        law.shared(np.array([0.5, 0.5])).weights, np.array([4, 4.5, 2, 1.5]) / 12
    )
    one = law.alone(1)
    assert (one.modes, one.wider) == (modes[1:], wider[1:])
    np.testing.assert_allclose(one.weights, [0.75, 0.25])
    both = np.stack([law.alone(i).log_density(z) for i in range(2)]) + np.log([[0.6], [0.4]])
    np.testing.assert_allclose(law.log_density(z), logsumexp(both, axis=0))
    with pytest.raises(ValueError, match="wider"):
        MixtureProposal(modes, np.ones(3), 6.0, wider[:1])


@pytest.mark.parametrize("legacy", [False, True])
def test_mode_weights_and_evidence(legacy):
    log_prob, modes = two_modes()
    rng = np.random.RandomState(11) if legacy else np.random.default_rng(11)
    found = mode_weights(log_prob, laid(*modes), rng, 4_000)
    assert np.all(np.abs(found.weights - [0.8, 0.2]) < 3 * found.error)
    assert found.error[0] < 0.01
    assert abs(found.log_evidence) < 0.05  # five of its standard errors, 1/sqrt(8000 kish)
    assert found.kish > 0.3
    assert found.pareto_k < 0.5
    assert found.failed == 0


def test_the_error_of_mode_weights_is_their_scatter():
    log_prob, modes = two_modes()
    runs = [mode_weights(log_prob, laid(*modes), np.random.default_rng(s), 500) for s in range(60)]
    scores = np.array([(r.weights[0] - 0.8) / r.error[0] for r in runs])
    low, high = stats.chi2.ppf([0.0005, 0.9995], 60)
    assert low < np.sum(scores**2) < high


def test_a_mode_found_twice_is_counted_once():
    log_prob, (big, small) = two_modes()
    shifted = Mode(big.mean + 0.1, big.covariance_factor, big.log_posterior)
    found = mode_weights(log_prob, laid(big, shifted, small), np.random.default_rng(2), 4_000)
    assert abs(found.weights[2] - 0.2) < 3 * found.error[2]
    # The plain way, each mode integrated with its own law alone, counts it twice: 0.2 / 1.8.
    plain = [
        np.exp(mode_weights(log_prob, laid(m), np.random.default_rng(2), 4_000).log_evidence)
        for m in (big, shifted, small)
    ]
    assert abs(plain[2] / sum(plain) - 0.2) > 10 * found.error[2]


def test_failed_draws_are_counted_and_left_out():
    log_prob, modes = two_modes()

    def fails_sometimes(z):
        return np.where(z[:, 0] > 6.0, np.nan, log_prob(z))

    found = mode_weights(fails_sometimes, laid(*modes), np.random.default_rng(0), 500)
    assert 400 < found.failed < 600
    # What is left to the failing mode is the tail of its law at the other, eight sd away.
    assert found.weights[1] < 1e-9
    with pytest.raises(UnusableResultError, match="finite posterior"):
        mode_weights(lambda z: np.full(len(z), -np.inf), laid(*modes), np.random.default_rng(0), 50)


def test_pareto_shape_is_found():
    shapes = [
        pareto_shape(stats.genpareto(0.5).rvs(4_000, random_state=seed)) for seed in range(20)
    ]
    # Standard error of k for 190 excesses: (1 + k) / sqrt(190) = 0.11; of the mean of 20: 0.024.
    assert abs(np.mean(shapes) - 0.5) < 4 * 0.024
    assert pareto_shape(np.ones(1_000)) == -np.inf


def test_pareto_shape_warns_of_a_law_that_is_too_narrow():
    rng = np.random.default_rng(4)
    d, scale = 5, 0.4
    mode = Mode(np.zeros(d), scale * np.eye(d), 0.0)
    found = mode_weights(
        lambda z: stats.multivariate_t(np.zeros(d), df=1).logpdf(z), laid(mode), rng, 5_000
    )
    assert found.pareto_k > 0.5
    assert found.kish < 0.1


def test_a_factor_that_is_none_is_refused():
    with pytest.raises(ValueError, match="diagonal"):
        Mode(np.zeros(2), np.zeros((2, 2)), 0.0)
    with pytest.raises(ValueError, match="factor"):
        Mode(np.zeros(3), np.eye(2), 0.0)
    with pytest.raises(ValueError, match="weights"):
        MixtureProposal((Mode(np.zeros(2), np.eye(2), 0.0),), np.array([0.5, 0.5]))

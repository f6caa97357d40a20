"""Weighted draws read as chains: the right posterior, honest sizes, and no answer where none is."""

import numpy as np
import pytest
from test_study import write_cart

import rigid
from rigid.inference import importance, nested, sampling
from rigid.inference.adaptation import drawn
from rigid.inference.convergence import effective_sizes
from rigid.inference.importance import weighed
from rigid.inference.proposal import MixtureProposal, Mode
from rigid.inference.sample import Settings
from rigid.validation.draws import sliced

SETTINGS = Settings(ensembles=4, walkers=8, r_hat=1.01, ess=1500.0, seed=3)
EACH = 256


def of(width: float, dof: float = 6.0):
    """Weighted draws for a standard normal of three, of a law so many times as wide."""
    law = MixtureProposal((Mode(np.zeros(3), width * np.eye(3), 0.0),), np.ones(1), dof)

    def draw(rng, n):
        return drawn(lambda z: -0.5 * np.sum(z**2, axis=1), law, rng, n)

    return draw


def test_draws_are_those_of_the_posterior_and_sizes_those_of_their_weights():
    found = weighed(of(1.6), EACH, SETTINGS)
    assert found is not None
    assert found.converged
    assert found.weighed
    z = found.z.reshape(-1, 3)
    ess = effective_sizes(found.z[..., 0])[0]
    error = 4.0 / np.sqrt(ess)
    np.testing.assert_allclose(z.mean(axis=0), 0.0, atol=error)
    np.testing.assert_allclose(z.var(axis=0), 1.0, atol=error * np.sqrt(2.0))
    np.testing.assert_allclose(found.log_prob.ravel(), -0.5 * np.sum(z**2, axis=1))
    # Repeats count once: as many draws as the error of a weighted mean tells, not as are listed.
    fresh = of(1.6)(np.random.default_rng(1), 65_536)
    weight = fresh.weight / fresh.weight.sum()
    worth = 1.0 / (weight**2 @ fresh.z[:, 0] ** 2) / len(weight) * len(z)
    assert worth < 0.8 * len(z)
    assert ess == pytest.approx(worth, rel=0.15)


def test_draws_that_weights_do_not_mend_are_no_answer(monkeypatch):
    """A law half as wide: the Pareto shape is above the limit however many are drawn."""
    monkeypatch.setattr(importance, "MOST", 6)
    assert weighed(of(0.4, dof=60.0), EACH, SETTINGS) is None


def test_draws_without_any_weight_are_no_answer(monkeypatch):
    monkeypatch.setattr(importance, "MOST", 4)

    def nowhere(rng, n):
        found = of(1.0)(rng, n)
        return found._replace(log_weight=np.full(n, -np.inf))

    assert weighed(nowhere, EACH, SETTINGS) is None


def test_a_fit_by_weights_is_that_by_walkers(tmp_path):
    """Means and sds of both, each known to about 1/sqrt(ESS); a seed gives the same draws again."""
    study = rigid.load(write_cart(tmp_path))
    sampler = study.spec.sampler.model_copy(update={"method": "emcee"})
    chains = rigid.Study(study.spec.model_copy(update={"sampler": sampler}))
    by_walkers, found = chains.fit(quiet=True), study.fit(quiet=True)
    assert found.usable
    assert found.calibrated.draws.weighed
    assert not by_walkers.calibrated.draws.weighed
    one, other = (fit.calibrated.draws.z for fit in (by_walkers, found))
    sizes = [effective_sizes(z[..., 0])[0] for z in (one, other)]
    error = 4.0 * np.sqrt(sum(1.0 / size for size in sizes))
    one, other = (z.reshape(-1, z.shape[-1]) for z in (one, other))
    np.testing.assert_allclose((one.mean(0) - other.mean(0)) / one.std(0), 0.0, atol=error)
    np.testing.assert_allclose(other.std(0) / one.std(0), 1.0, atol=error)
    again = study.fit(quiet=True)
    np.testing.assert_array_equal(again.calibrated.draws.z, found.calibrated.draws.z)
    fewer = found.calibrated.draws.evaluations
    assert fewer < by_walkers.calibrated.draws.evaluations


@pytest.mark.slow
def test_draws_that_are_done_are_not_made_again(tmp_path, monkeypatch):
    study = rigid.load(write_cart(tmp_path))
    out = tmp_path / "out"
    first = study.fit(out, quiet=True)

    def drawn_again(*_):
        raise AssertionError("drawn again")

    monkeypatch.setattr(sampling, "weighed", drawn_again)
    again = study.fit(out, quiet=True, resume=True)
    np.testing.assert_array_equal(again.calibrated.draws.z, first.calibrated.draws.z)
    sampler = study.spec.sampler.model_copy(update={"ess": 1200.0})
    stricter = rigid.Study(study.spec.model_copy(update={"sampler": sampler}))
    with pytest.raises(AssertionError, match="drawn again"):
        stricter.fit(out, quiet=True, resume=True)


@pytest.mark.slow
def test_a_fit_along_the_ridge_is_that_by_weights(tmp_path, monkeypatch):
    """The cart tells one combination of mass and drag to 0.017 prior sds, the other to 0.002."""
    study = rigid.load(write_cart(tmp_path))
    by_weights = study.fit(quiet=True).calibrated
    monkeypatch.setattr(sampling, "LEAST_SHARE", 2.0)
    monkeypatch.setattr(nested, "WIDE", (0.01,))
    found = study.fit(quiet=True).calibrated
    assert found.draws.weighed
    assert found.draws.evaluations % nested.TRIED == 0
    one, other = (done.draws.z for done in (by_weights, found))
    sizes = [effective_sizes(z[..., 0])[0] for z in (one, other)]
    error = 4.0 * np.sqrt(sum(1.0 / size for size in sizes))
    one, other = (z.reshape(-1, z.shape[-1]) for z in (one, other))
    np.testing.assert_allclose((one.mean(0) - other.mean(0)) / one.std(0), 0.0, atol=error)
    np.testing.assert_allclose(other.std(0) / one.std(0), 1.0, atol=error)
    ridge = sliced(found.known, np.random.default_rng(5))
    assert ridge is not None
    assert ridge.good
    assert ridge.by == "conditional modes"
    error = 4.0 / np.sqrt(ridge.ess)
    np.testing.assert_allclose((ridge.mean - one.mean(0)) / one.std(0), 0.0, atol=error)

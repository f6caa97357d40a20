"""Moves, ensembles, the stopping rule."""

from dataclasses import replace
from itertools import pairwise

import emcee
import numpy as np
import pytest
from emcee.moves import DEMove, DESnookerMove, Move
from scipy import stats
from targets import gaussian, two_modes

from rigid.inference import convergence, ensemble, moves, sample
from rigid.inference.moves import IndependenceMove, SnookerMove, padded
from rigid.inference.proposal import MixtureProposal, Mode, mode_weights
from rigid.inference.sample import Settings
from rigid.io.errors import InputError, UnusableResultError

QUICK = Settings(
    ensembles=4, walkers=20, block=50, max_steps=1_000, r_hat=1.01, ess=1_000.0, seed=5
)


def run(log_prob, mix, d, steps, walkers=40, seed=1, start=None):
    """Chain (steps, walkers, d) of one ensemble, begun from a standard normal."""
    state = np.random.RandomState(seed)
    sampler = emcee.EnsembleSampler(walkers, d, log_prob, moves=mix, vectorize=True)
    begin = state.standard_normal((walkers, d)) if start is None else start
    for _ in sampler.sample(emcee.State(begin, random_state=state.get_state()), iterations=steps):
        pass
    return sampler.get_chain()[steps // 10 :]


def off_by(series, truth):
    """Mean of a series over steps against the truth, in standard errors from batch means."""
    batches = series[: len(series) // 30 * 30].reshape(30, -1).mean(axis=1)
    return (batches.mean() - truth) / (batches.std(ddof=1) / np.sqrt(30))


def radius(chain):
    return np.mean(np.sum(chain**2, axis=-1), axis=1)


def standard_normal(z):
    return -0.5 * np.sum(z**2, axis=1)


def off_centre(d):
    return MixtureProposal((Mode(np.full(d, 0.4), 1.3 * np.eye(d), 0.0),), np.ones(1))


class WithoutFactor(IndependenceMove):
    """Broken on purpose: it forgets the Hastings factor."""

    def factors(self, old, new):  # noqa: ARG002
        return np.zeros(len(old))


def test_independence_move_draws_from_the_target():
    chain = run(standard_normal, IndependenceMove(off_centre(3)), 3, 2_000)
    assert abs(off_by(radius(chain), 3.0)) < 4
    assert abs(off_by(chain[..., 0].mean(axis=1), 0.0)) < 4


def test_independence_move_without_its_factor_does_not():
    chain = run(standard_normal, WithoutFactor(off_centre(3)), 3, 2_000)
    assert abs(off_by(radius(chain), 3.0)) > 20


@pytest.mark.parametrize("d", [1, 5])
def test_snooker_move_draws_from_the_target(d):
    chain = run(standard_normal, SnookerMove(), d, 2_000)
    assert abs(off_by(radius(chain), d)) < 4


@pytest.mark.skipif(emcee.__version__ != "3.1.6", reason="mended after 3.1.6; ours may go")
def test_the_snooker_move_of_emcee_does_not():
    chain = run(standard_normal, DESnookerMove(), 5, 1_200)
    assert off_by(radius(chain), 5) < -20


def test_a_walker_on_its_anchor_stays():
    here = np.zeros((4, 2))
    new, factors = SnookerMove().get_proposal(here, [np.zeros((5, 2))], np.random.RandomState(0))
    np.testing.assert_array_equal(new, here)
    assert np.all(factors == -np.inf)


def test_the_mix_of_moves_draws_from_the_target():
    chain = run(standard_normal, moves.mixed(off_centre(5)), 5, 2_000)
    assert abs(off_by(radius(chain), 5)) < 4
    shares = [share for _, share in moves.mixed(off_centre(5))]
    assert sum(shares) == pytest.approx(1.0)


def test_padded_always_sees_one_shape():
    seen = set()

    def log_prob(z):
        seen.add(z.shape)
        return z[:, 0]

    call = padded(log_prob, 4)
    for n in (1, 3, 4, 5, 11):
        z = np.random.default_rng(n).normal(size=(n, 2))
        np.testing.assert_array_equal(call(z), z[:, 0])
    assert seen == {(4, 2)}
    assert call.evaluations == 24
    assert len(call(np.empty((0, 2)))) == 0


def test_padded_counts_failures():
    values = np.array([np.nan, 1.0, np.inf, -np.inf, np.nan])
    call = padded(lambda z: values[z[:, 0].astype(int)], 3)
    out = call(np.arange(5.0)[:, None])
    np.testing.assert_array_equal(out, [-np.inf, 1.0, -np.inf, -np.inf, -np.inf])
    assert call.failed == 3  # what fills up the last batch is not counted, and -inf is an answer


def test_draws_have_the_moments_of_the_target():
    log_prob, proposal, mean, covariance = gaussian()
    draws = sample.sample(log_prob, proposal, QUICK)
    assert draws.converged, draws.says
    z = draws.z
    for i in range(3):
        for values, truth in ((z[..., i], mean[i]), ((z[..., i] - mean[i]) ** 2, covariance[i, i])):
            ess, _ = convergence.effective_sizes(values)
            assert abs(values.mean() - truth) < 4 * values.std() / np.sqrt(ess)
    np.testing.assert_allclose(log_prob(z.reshape(-1, 3)), draws.log_prob.ravel(), rtol=1e-12)
    steps = draws.warmup + z.shape[1]
    # Each walker once a step, and at the start; of those that begin apart, half a block more.
    assert draws.evaluations == 4 * 20 * (steps + 1) + 2 * 20 * 25
    assert draws.failed == 0
    assert np.all((draws.acceptance > 0.2) & (draws.acceptance < 0.9))


def half_of_it(d: int, width: float = 0.1):
    """Two modes alike within a standard normal prior, and a proposal that knows one of them."""
    centres = np.zeros((2, d))
    centres[:, 0] = -1.0, 1.0

    def log_prob(z):
        away = np.sum((z[:, None] - centres) ** 2, axis=2) / width**2
        return np.logaddexp.reduce(-0.5 * away, axis=1)

    known = Mode(centres[0], width * np.eye(d), 0.0)
    return log_prob, MixtureProposal((known,), np.ones(1))


@pytest.mark.parametrize("d", [4, 8])
def test_a_bias_that_all_ensembles_would_share_is_seen(d: int):
    """Those that begin apart find the mode that the proposal misses, and R-hat says so."""
    log_prob, proposal = half_of_it(d)
    settings = replace(QUICK, walkers=64, max_steps=300)
    draws = sample.sample(log_prob, proposal, settings)
    assert not draws.converged
    assert "R-hat of z[0]" in draws.says
    other = (draws.z[..., 0] > 0.0).mean(axis=(1, 2))
    assert np.all(other[1::2] > 0.1)
    again = sample.sample(log_prob, proposal, settings)
    np.testing.assert_array_equal(draws.z, again.z)
    alike = sample.sample(log_prob, proposal, replace(settings, apart=False))
    assert alike.converged  # on half of the answer
    assert np.all(alike.z[..., 0] < 0.0)


def test_ensembles_that_begin_apart_draw_from_the_target_all_the_same():
    log_prob, proposal, mean, covariance = gaussian()
    draws = sample.sample(log_prob, proposal, replace(QUICK, ensembles=6))
    for i in range(3):
        for rows in (draws.z[::2, ..., i], draws.z[1::2, ..., i]):
            ess, _ = convergence.effective_sizes(rows)
            assert abs(rows.mean() - mean[i]) < 4 * rows.std() / np.sqrt(ess)
            assert abs(rows.var() / covariance[i, i] - 1.0) < 4 * np.sqrt(2.0 / ess)


def test_what_is_kept_of_ensembles_that_begin_apart_has_come_to_the_target():
    """A thin target: a walker under way would be hundreds of sds off, which ranks do not see."""
    d, width = 8, 1e-3

    def log_prob(z):
        return -0.5 * np.sum((z / width) ** 2, axis=1)

    proposal = MixtureProposal((Mode(np.zeros(d), width * np.eye(d), 0.0),), np.ones(1))
    for seed in (1, 2, 3):
        settings = replace(QUICK, walkers=64, block=50, ess=500.0, seed=seed)
        draws = sample.sample(log_prob, proposal, settings)
        assert draws.converged
        assert np.abs(draws.z).max() < 7.0 * width
        assert draws.z.std() == pytest.approx(width, rel=0.1)


def test_a_chain_goes_on_while_walkers_are_under_way(monkeypatch):
    """Where nothing brings them in; without the rule it ends with sds many times too wide."""
    d, width = 8, 1e-3

    def log_prob(z):
        return -0.5 * np.sum((z / width) ** 2, axis=1)

    proposal = MixtureProposal((Mode(np.zeros(d), width * np.eye(d), 0.0),), np.ones(1))
    monkeypatch.setattr(ensemble, "SETTLING", 0.0)
    settings = replace(QUICK, walkers=64, block=50, ess=500.0)
    short = sample.sample(log_prob, proposal, replace(settings, max_steps=100))
    assert not short.converged
    assert "still on the way" in short.says
    whole = sample.sample(log_prob, proposal, settings)
    assert whole.converged
    assert whole.z.std() == pytest.approx(width, rel=0.1)
    monkeypatch.setattr(sample, "LATE", np.inf)
    blind = sample.sample(log_prob, proposal, settings)
    assert blind.converged
    assert blind.z.std() > 5.0 * width


def test_modes_get_their_weight_wherever_the_walkers_begin():
    log_prob, modes = two_modes()
    even = MixtureProposal(modes, np.ones(len(modes)))
    weights = mode_weights(log_prob, even, np.random.default_rng(1), 2_000).weights
    settings = replace(QUICK, ess=2_000.0)
    for law in (weights, np.array([0.5, 0.5])):  # the second puts half of the walkers in each
        proposal = MixtureProposal(modes, law)
        draws = sample.sample(log_prob, proposal, settings)
        assert draws.converged, draws.says
        inside = (draws.z[..., 0] < 4.0).astype(float)
        ess, _ = convergence.effective_sizes(inside)
        assert abs(inside.mean() - 0.8) < 3 * np.sqrt(0.16 / ess)


def test_without_the_independence_move_the_modes_keep_what_they_began_with(monkeypatch):
    log_prob, modes = two_modes()
    monkeypatch.setattr(moves, "mixed", lambda _: [(DEMove(), 0.7), (SnookerMove(), 0.3)])
    proposal = MixtureProposal(modes, np.array([0.5, 0.5]))
    draws = sample.sample(log_prob, proposal, replace(QUICK, max_steps=300, apart=False))
    assert not draws.converged
    assert "R-hat" in draws.says
    inside = draws.z[..., 0] < 4.0
    assert abs(inside.mean() - 0.8) > 0.15


def test_the_number_of_threads_changes_nothing(monkeypatch):
    log_prob, proposal, _, _ = gaussian()
    found = []
    for cores in (1, 3):
        monkeypatch.setattr(sample, "cores", lambda cores=cores: cores)
        found.append(sample.sample(log_prob, proposal, replace(QUICK, max_steps=200)))
    assert found[0].z.tobytes() == found[1].z.tobytes()
    other = sample.sample(log_prob, proposal, replace(QUICK, max_steps=200, seed=6))
    assert other.z.tobytes() != found[0].z.tobytes()


def test_the_likelihood_sees_one_shape_only():
    log_prob, proposal, _, _ = gaussian()
    seen = set()

    def watched(z):
        seen.add(z.shape)
        return log_prob(z)

    sample.sample(watched, proposal, replace(QUICK, max_steps=100))
    assert seen == {(10, 3)}


def test_what_is_lacking_is_said_by_name():
    log_prob, proposal, _, _ = gaussian()
    names = ("k_LC", "mu", "kappa")
    draws = sample.sample(
        log_prob,
        proposal,
        replace(QUICK, max_steps=100, ess=1e5),
        lambda z: dict(zip(names, z.T, strict=True)),
    )
    assert not draws.converged
    assert "after 100 steps" in draws.says
    assert "bulk ESS of " in draws.says
    assert any(name in draws.says for name in names)


def test_a_derived_quantity_must_converge_too():
    log_prob, proposal, _, _ = gaussian()
    shapes = set()

    def monitor(z):
        shapes.add(z.shape)
        return {"square": z[:, 0] ** 2, "constant": np.ones(len(z))}

    assert sample.sample(log_prob, proposal, QUICK, monitor).converged
    assert len(shapes) == 1
    draws = sample.sample(
        log_prob, proposal, replace(QUICK, max_steps=200), lambda z: {"bad": z[:, 0] * np.nan}
    )
    assert not draws.converged
    assert "R-hat of bad is inf" in draws.says


def test_progress_is_reported_after_each_block():
    log_prob, proposal, _, _ = gaussian()
    seen = []
    sample.sample(log_prob, proposal, replace(QUICK, max_steps=300, ess=1e5), report=seen.append)
    assert [s.steps for s in seen] == [50, 100, 150, 200, 250, 300]
    assert seen[0].ess is None
    assert seen[1].r_hat > 1.0
    assert seen[-1].ess > 100
    assert seen[-1].ess_name in ("z[0]", "z[1]", "z[2]")
    assert seen[-1].evaluations > seen[0].evaluations
    assert 0.2 < seen[-1].acceptance < 0.9


def test_starts_without_a_posterior_are_drawn_again():
    log_prob, proposal, mean, _ = gaussian()

    def half(z):
        return np.where(z[:, 0] > mean[0], log_prob(z), np.where(z[:, 1] > 0, np.nan, -np.inf))

    draws = sample.sample(half, proposal, QUICK)
    assert draws.converged, draws.says
    assert np.all(draws.z[..., 0] > mean[0])
    assert draws.failed > 0
    with pytest.raises(UnusableResultError, match="finite posterior"):
        sample.sample(lambda z: np.full(len(z), np.nan), proposal, QUICK)


class Still(Move):
    """Leaves the first walker where it is."""

    def __init__(self, inner):
        self.inner = inner

    def propose(self, model, state):
        kept = state.coords[0].copy(), state.log_prob[0]
        state, accepted = self.inner.propose(model, state)
        state.coords[0], state.log_prob[0] = kept
        accepted[0] = False
        return state, accepted


def test_stuck_walkers_are_seen_and_begin_again_after_the_first_block(monkeypatch):
    log_prob, proposal, _, _ = gaussian()
    mixed = moves.mixed
    monkeypatch.setattr(moves, "mixed", lambda p: [(Still(m), share) for m, share in mixed(p)])
    draws = sample.sample(log_prob, proposal, replace(QUICK, max_steps=200))
    assert not draws.converged
    assert "4 walker(s) have not moved" in draws.says
    group = ensemble.Ensemble(log_prob, proposal, sample._layout(QUICK, 3))
    first = group.block(0, None)
    assert not np.any(first.state.coords[0] == first.z[-1, 0])
    np.testing.assert_array_equal(first.state.coords[1:], first.z[-1, 1:])
    np.testing.assert_allclose(first.state.log_prob, log_prob(first.state.coords))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"ensembles": 1}, "ensembles = 1: must be at least 2"),
        ({"walkers": 4}, "walkers = 4: must be at least 8"),
        ({"walkers": 21}, "must be even"),
        ({"block": 5}, "block = 5"),
        ({"max_steps": 60}, "max_steps = 60: must be at least 100"),
    ],
)
def test_settings_that_cannot_work_are_refused(change, says):
    log_prob, proposal, _, _ = gaussian()
    with pytest.raises(InputError, match=says):
        sample.sample(log_prob, proposal, replace(QUICK, **change))


def test_too_few_walkers_for_the_parameters():
    proposal = off_centre(12)
    with pytest.raises(InputError, match=r"at least 24 \(twice the 12 parameters\)"):
        sample.sample(standard_normal, proposal, QUICK)


def test_an_error_of_the_likelihood_comes_through_and_prints_nothing(capsys):
    _, proposal, _, _ = gaussian()

    def fails(z):
        raise RuntimeError("no likelihood today")

    with pytest.raises(RuntimeError, match="today"):
        sample.sample(fails, proposal, QUICK)
    assert capsys.readouterr().out == ""


def test_thinned_draws_end_with_the_last():
    log_prob, proposal, _, _ = gaussian()
    draws = sample.sample(log_prob, proposal, replace(QUICK, max_steps=200, ess=1e5))
    thin = draws.thinned(40)
    assert draws.z.shape[1] == 150
    assert thin.z.shape == (4, 38, 20, 3)
    assert thin.log_prob.shape == (4, 38, 20)
    np.testing.assert_array_equal(thin.z[:, -1], draws.z[:, -1])


# --- the diagnostics ---------------------------------------------------------------------------


def walkers_ar1(phi, shape, seed=0):
    """Independent AR(1) walkers (ensembles, steps, walkers), variance one."""
    rng = np.random.default_rng(seed)
    x = np.empty(shape)
    x[:, 0] = rng.normal(size=(shape[0], shape[2]))
    for t in range(1, shape[1]):
        x[:, t] = phi * x[:, t - 1] + np.sqrt(1 - phi**2) * rng.normal(size=(shape[0], shape[2]))
    return x


def test_r_hat_is_judged_between_ensembles():
    values = walkers_ar1(0.5, (4, 200, 20))
    assert convergence.r_hat(values) < 1.01
    values[0] += 0.5  # one ensemble sits elsewhere
    assert convergence.r_hat(values) > 1.02
    for one in values:  # inside each ensemble, its walkers as chains, nothing is to be seen
        assert convergence.r_hat(one.T[:, :, None]) < 1.02


def test_r_hat_sees_a_drift_because_draws_lie_in_the_order_of_steps():
    values = walkers_ar1(0.5, (4, 200, 20))
    values += np.linspace(-0.5, 0.5, 200)[None, :, None]
    assert convergence.r_hat(values) > 1.02
    wrong = values.transpose(0, 2, 1)[..., None]  # walker by walker: halves hold the same steps
    assert convergence.r_hat(wrong) < 1.01


def test_r_hat_within_modes():
    rng = np.random.default_rng(2)
    modes = (rng.random((4, 200, 20)) < 0.1).astype(np.intp)
    values = rng.normal(size=modes.shape) + 30.0 * modes
    assert convergence.r_hat(values, modes) < 1.01
    values[0] += 0.8 * modes[0]  # within the small mode one ensemble sits elsewhere
    assert convergence.r_hat(values) < 1.01
    assert convergence.r_hat(values, modes) > 1.02


def test_ess_agrees_with_the_truth_when_every_walker_is_a_chain():
    phi, shape = 0.8, (4, 500, 20)
    truth = np.prod(shape) * (1 - phi) / (1 + phi)
    sizes = [convergence.effective_sizes(walkers_ar1(phi, shape, s))[0] for s in range(5)]
    # The integrated time of 80 chains of 500 steps (56 times its length) is known to some 4 %.
    np.testing.assert_allclose(sizes, truth, rtol=0.15)
    flat = walkers_ar1(phi, shape).reshape(4, -1, 1)  # walkers flattened into one chain
    assert convergence.effective_sizes(flat)[0] > 5 * truth


def test_ensemble_means_are_held_against_the_ess():
    odds = [
        convergence.diagnose("x", walkers_ar1(0.5, (8, 200, 20), seed)).spread for seed in range(20)
    ]
    assert min(odds) > 0.001
    assert stats.kstest(odds, "uniform").pvalue > 0.001
    # All walkers of an ensemble swing together: each looks like noise, their mean does not settle.
    # The variance of the means is then (1 + 1/20) / (2/20) = 10 times what the ESS promises.
    together = [
        walkers_ar1(0.5, (8, 200, 20), seed) + walkers_ar1(0.5, (8, 200, 1), 50 + seed)
        for seed in range(5)
    ]
    found = [convergence.diagnose("x", values) for values in together]
    assert sorted(f.spread for f in found)[3] < 1e-4
    assert "further apart" in convergence.lacking(found, 1.1, 100.0)[-1]


def test_constants_and_ensembles_that_stand_still():
    constant = convergence.diagnose("x", np.ones((4, 50, 8)))
    assert constant.r_hat is None
    assert convergence.lacking([constant], 1.01, 100.0) == []
    still = np.broadcast_to(np.arange(4.0)[:, None, None], (4, 50, 8))
    assert convergence.r_hat(still) == np.inf


def test_looks_become_rarer_as_the_chain_grows():
    looks = [n for n in range(200) if sample._time_to_look(n)]
    assert looks[:10] == list(range(2, 12))
    assert all(b <= 1.1 * a + 1 for a, b in pairwise(looks))
    assert len(looks) < 50

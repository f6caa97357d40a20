"""Lines that sensors pick up: their evidence against Gaussian densities, and against a ripple."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal
from test_lines import CHOICE, RIPPLE, campaign

from rigid.discovery.fitted import Fitted
from rigid.discovery.periodic import QUANTILES
from rigid.discovery.pickup import ChannelSamples, spectrum_of, weighing
from rigid.discovery.signatures import Bench, laid_out
from rigid.discovery.turn import weigh
from rigid.effects import CATALOGUE
from rigid.io.cache import Shelf
from rigid.likelihood.problem import Problem
from rigid.localfit.ascent import refined
from rigid.localfit.expansion import Point, expanded
from rigid.localfit.families import families
from rigid.localfit.hypothesis import Hypothesis, start
from rigid.localfit.local import LocalFit
from rigid.localfit.samples import lay_out

PICKUP = CATALOGUE["mains-pickup"]


def test_evidence_of_a_line_is_a_ratio_of_gaussian_densities():
    """At 30 and 70 Hz, which are one at 100 Hz, and at 50 Hz, where sine and cosine are one."""
    rng, count, begin = np.random.default_rng(1), 60, 0.23
    rows, frequencies = np.array([0, 1, 2, *range(5, count)]), np.arange(20.0, 81.0, 5.0)
    weight = rng.uniform(0.5, 2.0, count)
    read = rng.standard_normal(count) / np.sqrt(weight)
    times = 0.01 * rows + begin
    spectrum = spectrum_of(ChannelSamples("angle", rows, times, weight[rows], 0.01), frequencies)
    sizes = np.linspace(0.1, 3.0, len(QUANTILES))
    weights = weighing((spectrum,), sizes)
    found = weights.of_sizes((weight * read)[:, None])[:, :, 0].T - weights.log_mass
    noise = np.diag(1.0 / weight[rows])
    for i in (0, 10, 32):
        for j, frequency in enumerate(frequencies):
            turned = 2.0 * np.pi * frequency * times
            waves = np.stack([np.sin(turned), np.cos(turned)], axis=1)
            with_line = noise + 0.5 * sizes[i] ** 2 * waves @ waves.T
            density = multivariate_normal.logpdf
            ratio = density(read[rows], cov=with_line) - density(read[rows], cov=noise)
            assert found[i, j] == pytest.approx(ratio, rel=1e-6, abs=1e-6)
    np.testing.assert_allclose(found[:, 2], found[:, 10], rtol=1e-6)


def test_what_moves_whole_records_is_no_line():
    """At 100 Hz, sampled at 100 Hz, a line is a constant; at 101.5 Hz it has fifteen turns."""
    rows, frequencies = np.arange(1000), np.arange(99.0, 102.5, 0.5)
    times = 0.01 * (rows + 0.5)
    spectrum = spectrum_of(ChannelSamples("angle", rows, times, np.ones(1000), 0.01), frequencies)
    weights = weighing((spectrum,), np.linspace(0.1, 3.0, len(QUANTILES)))
    found = weights.of_sizes(2.0 * np.ones((1000, 1)))[:, :, 0] - weights.log_mass.T
    np.testing.assert_array_equal(found[:5], 0.0)
    assert np.all(found[5:] < 0.0)
    assert weights.likeliest(2.0 * np.ones(1000), 2).amplitude == 0.0
    turning = np.sin(2.0 * np.pi * 101.5 * times)
    assert weights.of_sizes(turning[:, None])[5].max() > 100.0


def bench_of(problem: Problem) -> tuple[LocalFit, Bench]:
    """A fit of a campaign, and signatures of the effects that may be missing from it."""
    choice = (*CHOICE, PICKUP)
    programs = families(problem, choice)
    noise = np.zeros(sum(p.base == "noise" for p in problem.parameters.sampled))
    w = start(problem, np.zeros(problem.parameters.size), np.zeros((len(problem.sensors), 2)))
    begun = expanded(programs[0], Point(Hypothesis(problem), lay_out(problem), w, noise))
    local = refined(begun, most=40)
    return local, laid_out(Fitted(local, programs), choice, Shelf())


def weighed(problem: Problem) -> dict[str, float]:
    """Log Bayes factors of the effects that may be missing."""
    return dict(weigh(*bench_of(problem), 1).effects)


@pytest.mark.slow
def test_a_line_in_one_record_alone_is_no_more_than_all_channels_of_one_amplitude_explain():
    """Each channel may have an amplitude in the search, and not in the refit."""
    _, bench = bench_of(campaign(4, 0.0, (50.0, 1.5), "free-run-1"))
    (line,) = [one for one in bench.listed if one.effect is PICKUP]
    assert line.log_share == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("frequency", [50.0, 70.0, 78.0])
def test_a_line_in_every_channel_is_no_ripple(frequency):
    """At half the sampling frequency, and where its alias, at 30 and 22 Hz, could be a pump's."""
    found = weighed(campaign(4, 0.0, (frequency, 0.5)))
    assert found["mains-pickup"] > max(found["pump-ripple"], found["piston-leakage"], 0.0) + 10.0


@pytest.mark.slow
def test_a_ripple_is_no_line_of_sensors_and_noise_is_neither():
    found = weighed(campaign(1, 0.05))
    assert found[RIPPLE.name] > found["mains-pickup"] + 10.0
    assert weighed(campaign(2, 0.0))["mains-pickup"] < 2.0

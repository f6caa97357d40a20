"""The law around an optimum from differences of the log-posterior."""

import numpy as np
import pytest

from rigid.inference import curvature
from rigid.inference.coordinates import chart_of
from rigid.inference.curvature import differences, sharpened
from rigid.inference.search import Found, Optimum
from rigid.likelihood.parameters import Parameters
from rigid.likelihood.problem import Problem

SIZE = 5


@pytest.fixture
def precision() -> np.ndarray:
    root = np.random.default_rng(3).standard_normal((SIZE, SIZE))
    return root @ root.T + np.eye(SIZE)


def test_differences_of_a_cubic_are_exact(precision: np.ndarray):
    """Cubic terms cancel in the Hessian; the slope keeps them at one standard deviation."""
    slope, cubic = np.arange(SIZE) - 1.5, 0.3

    def density(z: np.ndarray) -> np.ndarray:
        square = np.einsum("ni,ij,nj->n", z, precision, z)
        return z @ slope - 0.5 * square + cubic * z[:, 0] ** 2 * z[:, 1]

    value, got, bend = differences(density, np.zeros(SIZE), np.eye(SIZE))
    assert value == 0.0
    np.testing.assert_allclose(got, slope, atol=1e-12)
    np.testing.assert_allclose(bend, precision, atol=1e-12)


def found_with(covariance: np.ndarray, z: np.ndarray) -> Found:
    optimum = Optimum(z, np.zeros((1, 2)), covariance, -np.inf, 1, 0.0)
    nothing = Problem((), Parameters((), ()), (), ())
    return Found(nothing, (optimum,), {}, 1, np.zeros(1), np.zeros(0))


@pytest.mark.parametrize("width", [0.2, 1.0, 3.0])
def test_a_wrong_width_and_place_are_mended(precision, width: float, monkeypatch):
    mean = np.linspace(-0.2, 0.2, SIZE)

    def density(_problem, z: np.ndarray) -> np.ndarray:
        return -0.5 * np.einsum("ni,ij,nj->n", z - mean, precision, z - mean)

    monkeypatch.setattr(curvature, "log_density", density)
    covariance = np.linalg.inv(precision)
    before = found_with(width**2 * covariance, np.zeros(SIZE))
    (got,) = sharpened(before, chart_of(before.problem)).optima
    np.testing.assert_allclose(got.covariance, covariance, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(got.z, mean, atol=1e-10)
    assert got.log_posterior == pytest.approx(0.0, abs=1e-12)


def test_a_neighbour_without_a_value_leaves_the_law_as_it_was(precision, monkeypatch):
    monkeypatch.setattr(
        curvature, "log_density", lambda _, z: np.where(z[:, 0] > 0.1, -np.inf, -(z**2).sum(1))
    )
    before = found_with(np.linalg.inv(precision), np.zeros(SIZE))
    assert sharpened(before, chart_of(before.problem)).optima[0] is before.optima[0]

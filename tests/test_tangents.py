"""Slopes along shared directions are those by one number at a time."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from test_lines import campaign

from rigid.inference.newton import is_noise
from rigid.inference.tangents import WIDE, tangents
from rigid.likelihood.groups import predictions


@pytest.mark.slow
def test_numbers_of_two_records_share_a_direction_and_no_slope_is_mixed():
    problem = campaign(1, 0.0)  # two free runs in one group, each with its own flow fraction
    free = np.flatnonzero(~is_noise(problem))
    found = tangents(problem, free)
    labels = [problem.parameters.labels[i] for i in free]
    flows = [labels.index(f"kappa[free-run-{i},A]") for i in (1, 2)]
    first, second = found.entries[0]
    shared = list(first).index(flows[0])
    assert list(second).index(flows[1]) == shared
    assert found.along.shape[1] % WIDE == 0

    def read(z):
        return predictions(problem.groups, [problem.parameters.values(z)])[0]

    def slopes(along):
        z = jnp.zeros(along.shape)
        return jax.jvp(read, (z,), (jnp.asarray(along),))[1]

    together = slopes(found.along[0])
    alone = slopes(np.eye(problem.parameters.size)[free])
    for quantity, series in together.items():
        for track, entries in enumerate(found.entries[0]):
            got = np.zeros((series.shape[0], len(free) + 1))
            got[:, entries] = series[:, track]
            exact = np.asarray(alone[quantity][:, track])
            np.testing.assert_allclose(
                got[:, :-1], exact, rtol=1e-9, atol=1e-9 * np.abs(exact).max()
            )

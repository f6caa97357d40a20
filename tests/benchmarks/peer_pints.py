"""PINTS as its documentation advises: three chains of its adaptive covariance method.

Importing this module needs `pints`.
"""

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
import pints  # pyright: ignore[reportMissingImports]
from campaign import Bench

from rigid.inference.convergence import effective_sizes
from rigid.likelihood.problem import log_posterior

CHAINS = 3


class Posterior(pints.LogPDF):
    """The log-posterior of one point, as PINTS asks for it."""

    def __init__(self, bench: Bench):
        self.bench = bench

    def n_parameters(self) -> int:
        """Length of z."""
        return self.bench.problem.parameters.size

    def __call__(self, z: np.ndarray) -> float:
        """Log-posterior of z (size,)."""
        return float(log_posterior(self.bench.problem, jnp.asarray(z)[None])[0])


@dataclass(frozen=True)
class Pints:
    """Evaluations that an effective sample of the slowest parameter takes."""

    evaluations_each: float
    iterations: int


def measured(bench: Bench) -> Pints:
    """Run it on rigid's fast log-posterior; the first half of each chain is dropped."""
    iterations = bench.choose(600, 20_000)
    covariance = np.cov(bench.draws(2000), rowvar=False)
    controller = pints.MCMCController(
        Posterior(bench),
        CHAINS,
        list(bench.draws(CHAINS)),
        sigma0=covariance,
        method=pints.HaarioBardenetACMC,
    )
    controller.set_max_iterations(iterations)
    controller.set_log_to_screen(False)
    np.random.seed(1)  # noqa: NPY002, PINTS draws from NumPy's global state
    chains = np.asarray(controller.run())[:, iterations // 2 :]
    sizes = [effective_sizes(chains[:, :, i].T[None])[0] for i in range(chains.shape[2])]
    return Pints(CHAINS * chains.shape[1] / min(sizes), iterations)

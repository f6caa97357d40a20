"""How much of a posterior the law over its modes overlooks, by points that it did not draw.

A law fitted to its own draws cannot tell of what none of them has met: weights look even, ensembles
agree, and truths lie elsewhere. The conditional modes of the ridge were found by Newton steps,
whatever the law says. Around them points are drawn and weighed. Where the law covers the posterior
such points weigh against it what its own draws weigh; what weighs more than the greatest of these
has been overlooked.
"""

import numpy as np

from rigid.inference.coordinates import Floats
from rigid.inference.proposal import LogProb, MixtureProposal, Random
from rigid.inference.ridge import Followed, Ridge

EACH = 4
"""Points around each conditional mode."""


def overlooked(
    log_prob: LogProb, law: MixtureProposal, greatest: float, ridge: Ridge, rng: Random
) -> float:
    """Share of the posterior around the conditional modes that draws of a law have not met.

    - `log_prob`: of the coordinates of `ridge.chart`, as `law`. - `greatest`: log weight among the
      draws of the law. Zero where there are no conditional modes.
    """
    if ridge.followed is None:
        return 0.0
    u, log_density = around(ridge.followed, rng)
    at = ridge.chart.straight(ridge.before.standard(u))
    value = np.asarray(log_prob(at), dtype=float)
    value = np.where(np.isfinite(value), value, -np.inf)
    log_weight = value - log_density
    if not np.any(np.isfinite(log_weight)):
        return 0.0
    weight = np.exp(log_weight - log_weight.max())
    return float(weight[value - law.log_density(at) > greatest].sum() / weight.sum())


def around(ridge: Followed, rng: Random) -> tuple[Floats, Floats]:
    """Draw points (n, size) around conditional modes, and how rare they are.

    That is the log of their density up to a constant (n,): of w as it was tried, of all else as it
    is Gaussian there. What is held is drawn as it is around the optimum.
    """
    along = ridge.along
    last = along.wide + along.narrow
    units = rng.standard_normal((len(ridge.modes), EACH, len(ridge.centre)))
    log_density = np.zeros((len(ridge.modes), EACH))
    for i, mode in enumerate(ridge.modes):
        own = units[i, :, along.wide :]
        log_density[i] = ridge.rarity[i] - 0.5 * np.sum(own**2, axis=1)
        log_density[i] -= np.sum(np.log(np.diag(mode.factor)))
        units[i, :, : along.wide] = mode.w
        bent = units[i, :, along.wide : last] @ mode.factor.T
        units[i, :, along.wide : last] = mode.x[: along.narrow] + bent
    points = ridge.centre + units.reshape(-1, len(ridge.centre)) @ along.factor.T
    return points, log_density.ravel()

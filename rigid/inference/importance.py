"""Weighted draws until lots of them agree and hold enough: in the place of chains.

Every lot is drawn and weighed for itself, and resampled systematically in the order in which it was
drawn: a draw stands in a row as often as its weight asks, none or several times. What repeats one
after the other counts once in an effective sample size, as where a walker stays. So tables, R-hat
between lots and the stopping rule are those of chains.

Source: Kitagawa (1996), J. Comput. Graph. Statist. 5, for systematic resampling.
"""

import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from rigid.inference import convergence
from rigid.inference.adaptation import Weighted
from rigid.inference.coordinates import Floats
from rigid.inference.proposal import UNRELIABLE, Random, pareto_shape
from rigid.inference.sample import Draws, Monitor, Settings, components

STREAM = 3
"""Number of this part of a fit among those that draw from its seed."""
ROWS = 32
"""Into how many walkers a lot is parted, one after the other."""
LEAST_STEPS, MOST = 24, 24
"""Steps of each walker before the first look at the draws, since sizes of shorter chains are too
great, and rounds at most."""


Draw = Callable[[Random, int], Weighted]
"""So many weighted draws."""


class Progress(NamedTuple):
    """Draws so far, and the least effective sample size of what is monitored."""

    draws: int
    ess: float


def weighed(
    draw: Draw,
    each: int,
    settings: Settings,
    monitor: Monitor = components,
    report: Callable[[Progress], None] = lambda _: None,
) -> Draws | None:
    """Draw until the stopping rule of chains is met; None where weights do not do.

    - each: draws of every lot in a round, a multiple of ROWS.
    - settings: lots (`ensembles`), `r_hat`, `ess` and seed.
    - monitor: z (n, d) -> quantities (n,) by name that must have converged.
    """
    began, lots = time.perf_counter(), settings.ensembles
    rngs = [np.random.default_rng([settings.seed, STREAM, lot]) for lot in range(lots)]
    parts: list[list[Weighted]] = [[] for _ in rngs]
    for number in range(1, MOST + 1):
        for part, rng in zip(parts, rngs, strict=True):
            part.append(draw(rng, each))
        together = [_joined(part) for part in parts]
        too_short = number * each < LEAST_STEPS * ROWS
        if too_short or min(one.even for one in together) == 0.0:
            report(Progress(lots * number * each, 0.0))
            continue
        chains = [_resampled(one) for one in together]
        z, log_prob = (np.stack(values) for values in zip(*chains, strict=True))
        found = _diagnosed(z, monitor)
        least = convergence.least_ess(found)
        report(Progress(lots * number * each, (least.ess_bulk if least else None) or 0.0))
        logs = np.concatenate([one.log_weight for one in together])
        if pareto_shape(np.exp(logs - logs.max())) >= UNRELIABLE:
            continue
        if not convergence.lacking(found, settings.r_hat, settings.ess):
            return Draws(
                z=z,
                log_prob=log_prob,
                warmup=0,
                acceptance=np.array([one.even for one in together]),
                evaluations=len(logs),
                failed=int(np.sum(~np.isfinite(logs))),
                converged=True,
                says=f"after {len(logs)} weighted draws: converged",
                seconds=time.perf_counter() - began,
                weighed=True,
            )
    return None


def _joined(parts: Sequence[Weighted]) -> Weighted:
    """All rounds of a lot."""
    return Weighted(*(np.concatenate(values) for values in zip(*parts, strict=True)))


def _resampled(lot: Weighted) -> tuple[Floats, Floats]:
    """A lot as ROWS walkers one after the other: z (steps, ROWS, d), log posterior (steps, ROWS).

    How often a draw stands there follows from the weights alone, by the middles of equal shares.
    """
    n = len(lot.log_weight)
    reached = np.cumsum(lot.weight) / lot.weight.sum()
    kept = np.minimum(np.searchsorted(reached, (np.arange(n) + 0.5) / n), n - 1)
    rows = kept.reshape(ROWS, -1).T
    return lot.z[rows], lot.log_prob[rows]


def _diagnosed(z: Floats, monitor: Monitor) -> list[convergence.Diagnosis]:
    seen = monitor(z.reshape(-1, z.shape[-1]))
    return [
        convergence.diagnose(name, np.asarray(values, dtype=float).reshape(z.shape[:3]))
        for name, values in seen.items()
    ]

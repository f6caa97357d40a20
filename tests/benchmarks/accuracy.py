"""Error of the fast ways against the full solve, over draws from prior and posterior."""

import time
from dataclasses import dataclass

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from campaign import Bench
from reference import predictions
from table import Row

from rigid.likelihood.marginal import marginal_likelihood
from rigid.likelihood.problem import Problem, predict

TOLERANCE = 1e-10
COUNT = 0.05985504150390625
"""m/s^2, of the accelerometer; its sheet has no step."""
MOST_DIFFERENCE = 0.1


@dataclass(frozen=True)
class Error:
    """Of one point z: worst error in tenths of a step by quantity, where, and in log-posterior.

    - `value`: the log-likelihood itself. All are nan where the full solve did not end.
    """

    worst: dict[str, tuple[float, str]]
    difference: float
    value: float
    seconds: float

    @property
    def ended(self) -> bool:
        """Whether the full solve came to its end on every record."""
        return bool(np.isfinite(self.difference))


@eqx.filter_jit
def log_likelihood(problem: Problem, series: list, values: dict) -> jnp.ndarray:
    """rigid's own likelihood of simulated readings."""
    return marginal_likelihood(problem.pieces, series, values).value


def error_at(problem: Problem, z: np.ndarray) -> Error:
    """Compare at one point z (size,)."""
    began = time.perf_counter()
    values = problem.parameters.values(jnp.asarray(z)[None])
    exact = predictions(problem, {k: v[0] for k, v in values.items()}, TOLERANCE)
    seconds = time.perf_counter() - began
    fast = predict(problem, jnp.asarray(z)[None])
    worst: dict[str, tuple[float, str]] = {}
    for piece in problem.pieces:
        bar = 0.1 * (piece.sheet.step or COUNT)
        off = np.abs(np.asarray(piece.reading(fast)) - exact[piece.group][piece.quantity])
        size = np.max(off[..., 0] * (np.asarray(piece.weight) > 0), axis=0) / bar
        i = int(np.argmax(size))
        label = problem.groups[piece.group].tracks[piece.tracks[i]].label
        worst[piece.quantity] = max(worst.get(piece.quantity, (0.0, "")), (float(size[i]), label))
    both = [float(log_likelihood(problem, s, values)[0]) for s in (fast, exact)]
    return Error(worst, abs(both[0] - both[1]), both[1], seconds)


def told(errors: list[Error]) -> tuple[float, str]:
    """Worst error of all, and what it is by sensor."""
    by = {q: max(e.worst[q] for e in errors) for q in errors[0].worst}
    said = ", ".join(f"{q} {size:.3g} ({label})" for q, (size, label) in by.items())
    return max(size for size, _ in by.values()), said


def rows(bench: Bench) -> list[Row]:
    """Worst errors over draws from the prior and from the posterior."""
    problem, out = bench.problem, []
    count = bench.choose(2, 12)
    prior = np.random.default_rng(7).standard_normal((count, problem.parameters.size))
    # A flow three times too fast or slow takes a record where no reading of it is: into the bend
    # of the pump's curve, say, to which a record is not laid out that stays far below.
    flows = [p.base in ("kappa", "kappa_tank") for p in problem.parameters.sampled]
    near = np.where(flows, bench.draws(count), prior)
    named = {
        "prior": prior,
        "prior, flows from the posterior": near,
        "posterior": bench.draws(bench.choose(1, 6)),
    }
    for name, points in named.items():
        tried = [error_at(problem, z) for z in points]
        errors = [e for e in tried if e.ended]
        size, said = told(errors)
        seconds = float(np.median([e.seconds for e in errors]))
        against = f"`rigid.physics.full` at {TOLERANCE:g}, {len(errors)} draws from the {name}"
        notes = (
            f"tenths of a step: {said}",
            f"the accelerometer's step is taken as {COUNT:.4f} m/s^2; the full solve took "
            f"{seconds:.3g} s a draw, and did not end at {len(tried) - len(errors)} more",
            "worst by draw: "
            + ", ".join(f"{max(size for size, _ in e.worst.values()):.3g}" for e in errors),
        )
        out.append(
            Row(
                "worst error of a reading, in tenths of its sensor's step",
                against,
                f"{size:.3g}",
                "below 1",
                size < 1.0,
                notes,
            )
        )
        difference = max(e.difference for e in errors)
        out.append(
            Row(
                "difference of the log-posteriors",
                against,
                f"{difference:.3g}",
                f"below {MOST_DIFFERENCE:g}",
                difference < MOST_DIFFERENCE,
                (
                    "difference (log-likelihood) by draw: "
                    + ", ".join(f"{e.difference:.3g} ({e.value:.4g})" for e in errors),
                ),
            )
        )
    return out

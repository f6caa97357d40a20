"""What solves a rig with an effect of a user's own: steps where they hold, diffrax where not.

Steps are known to hold for the effects of the catalogue. An effect of one's own may be stiff, have
corners, or swing within a step; whether steps hold for it is asked before anything is fitted.
"""

import dataclasses
from typing import Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from rigid.inference.newton import is_noise, joined, local
from rigid.inference.reference_check import (
    MOST_SHIFT,
    MOST_STEPS,
    Predictions,
    both_ways,
    compared,
    nothing_solved,
)
from rigid.inference.settled import away_from_top
from rigid.likelihood.effect_lookup import marks
from rigid.likelihood.problem import Problem
from rigid.physics.full import TOLERANCE
from rigid.spec import Spec

FAR = "steps do not hold, so diffrax solves everything, which is slow"
POINTS = 8
"""Points that are solved both ways: the centre of the priors, and draws of them."""


def left_open(spec: Spec, problem: Problem) -> tuple[str, ...]:
    """Effects of the user's own for which the spec leaves open what solves it."""
    stated = spec.solve.method is not None or nothing_solved(problem)
    return () if stated else tuple(marks(problem.effects))


def with_solver(spec: Spec, problem: Problem) -> Spec:
    """Return the spec with the method that solves it stated, and why.

    - `problem`: of the spec, by steps; one of its effects is the user's own.
    """
    rng = np.random.default_rng([spec.sampler.seed, 5])
    z = rng.standard_normal((POINTS, problem.parameters.size))
    z[0] = 0.0
    method, said = _judged(problem, z)
    own = ", ".join(left_open(spec, problem))
    solve = spec.solve.model_copy(update={"method": method})
    return spec.model_copy(
        update={"solve": solve, "why_solver": f"{own} is no effect of the catalogue: {said}"}
    )


def _judged(
    problem: Problem, z: Float[np.ndarray, "points size"]
) -> tuple[Literal["steps", "diffrax"], str]:
    """Return what is to solve a problem, and why in a sentence."""
    values, fast, exact = both_ways(problem, z, TOLERANCE)
    found = dataclasses.replace(compared(problem, values, fast, exact, TOLERANCE), differences=None)
    if found.worst is None:
        return "steps", f"{found.says}, so steps solve everything, unjudged"
    if not found.worst.bars <= MOST_STEPS:
        return "diffrax", f"{found.says}; {FAR}"
    whole = np.all([np.isfinite(s).all((0, 1)) for one in exact for s in one.values()], axis=0)
    shifts = [_shift(problem, z[i], exact, int(i)) for i in np.flatnonzero(whole)]
    shift = float(np.sqrt(np.mean(np.square(shifts))))
    said = f"{found.says}, means by {shift:.2g} posterior sds (limit {MOST_SHIFT:g})"
    if shift <= MOST_SHIFT:
        return "steps", f"{said}; steps hold and solve everything"
    return "diffrax", f"{said}; {FAR}"


def _shift(
    problem: Problem, z: Float[np.ndarray, " size"], exact: Predictions, point: int
) -> float:
    """Posterior sds by which no mean is off, had the records been what diffrax reads at a point.

    The log-posterior by steps then has its top elsewhere than at that point: to first order, by its
    gradient there over its information.
    """
    read = [{q: jnp.asarray(s[..., point : point + 1]) for q, s in g.items()} for g in exact]
    data = [piece.reading(read)[..., 0] for piece in problem.pieces]
    asked = eqx.tree_at(lambda p: [piece.data for piece in p.pieces], problem, data)
    w = joined(problem, z, np.zeros((len(problem.sensors), 2)))
    found = local(asked, jnp.asarray(w), jnp.asarray(z[is_noise(problem)]))
    return away_from_top(np.asarray(found.gradient) - w, np.asarray(found.information))

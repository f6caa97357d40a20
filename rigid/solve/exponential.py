"""Exponential integrator: long steps through oscillations and stiffness.

A step is y + Phi(h) f(y) with Phi(h) = integral of exp(A s) ds from 0 to h and A the Jacobian of
the rig's own equations; it is exact for a linear rig under constant flow. The oil column changes
slowly: f takes its value in the middle of the step, Phi is interpolated between the ends and the
middle of the record's stroke. Source: Hochbruck and Ostermann 2010, Acta Numerica 19, exponential
Rosenbrock methods.

Arrays carry the walkers on their last axis: every operation is elementwise over it.
"""

from collections.abc import Callable, Sequence
from functools import reduce
from operator import add
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from rigid.rig import Rig, Surroundings
from rigid.sensors import readings
from rigid.solve.drive import STRIDE, Plan
from rigid.solve.rest import rest_under

DOUBLINGS = 12
TAYLOR_DEGREE = 8
"""4,096 sub-steps a step keep the Taylor remainder below 1e-11 up to mu = 5e6 N s/m."""


def product(left: Array, right: Array) -> Array:
    """Matrix product over the first two axes, elementwise over the rest."""
    return reduce(add, (left[:, j, None] * right[None, j] for j in range(left.shape[1])))


def apply(matrix: Array, vector: Array) -> Array:
    """Matrix times vector over the first axes, elementwise over the rest."""
    return reduce(add, (matrix[:, j] * vector[j] for j in range(matrix.shape[1])))


def mean_growth(exponent: Array) -> Array:
    """(exp(x) - 1)/x, the mean of exp(s x) over s from 0 to 1; 1 at x = 0."""
    safe = jnp.where(jnp.abs(exponent) < 1e-8, 1.0, exponent)
    return jnp.where(jnp.abs(exponent) < 1e-8, 1.0 + 0.5 * exponent, jnp.expm1(safe) / safe)


def jacobian(rig: Rig, outside: Surroundings, column: Array) -> Array:
    """Derivative of the rates by the state at rest, shape (n, n, *column.shape)."""
    n = len(rig.scales)
    rest = jnp.zeros((n, *jnp.broadcast_shapes(column.shape, rig.column.shape)))

    def rates(flat: Array) -> Array:
        moved = rig.motion(flat, outside, column).rates
        return jnp.stack([jnp.broadcast_to(r, rest.shape[1:]) for r in moved])

    def along(i: Array) -> Array:
        return jax.jvp(rates, (rest,), (rest.at[i].set(1.0),))[1]

    return jnp.moveaxis(jax.vmap(along)(jnp.arange(n)), 0, 1)


def step_matrix(matrix: Array, length: Array | float, scales: Sequence[float]) -> Array:
    """Phi(h), the integral of exp(A s) over s from 0 to h, by Taylor series and doubling.

    - `matrix` (n, n, ...) [1/s]: A. - `length` [s]: h, broadcasts over the trailing axes.
    - `scales` (n,): typical sizes of the states; without them the products overflow the precision.
    """
    shape = (len(scales), 1) + (1,) * (matrix.ndim - 2)
    scale = jnp.asarray(scales).reshape(shape)
    unscale = jnp.moveaxis(scale, 0, 1)
    balanced = matrix * unscale / scale
    small = jnp.asarray(length) / 2**DOUBLINGS
    unit = jnp.eye(len(scales)).reshape((len(scales),) * 2 + (1,) * (matrix.ndim - 2))
    tiny = balanced * small

    def horner(k: Array, series: Array) -> Array:
        return unit + product(tiny, series) / (TAYLOR_DEGREE + 1 - k)

    series = jax.lax.fori_loop(0, TAYLOR_DEGREE, horner, unit + jnp.zeros_like(tiny))
    phi = jax.lax.fori_loop(0, DOUBLINGS, lambda _, p: doubled(balanced, p), series * small)
    return phi * scale / unscale


def doubled(matrix: Array, phi: Array) -> Array:
    """Phi(2h) from Phi(h)."""
    return 2.0 * phi + product(phi, product(matrix, phi))


class Tables(NamedTuple):
    """Step matrices of one group for the current parameters.

    - `low`, `slope`, `bend` (2, n, n, walkers): for short and long steps, coefficients of a
      parabola through the least stroke (0), the middle and the greatest (1).
    - `kinks` (kinks + 1, n, walkers): response to a unit rate of pressure from a switch on.
    """

    low: Array
    slope: Array
    bend: Array
    kinks: Array


class Strokes(NamedTuple):
    """Rough strokes, from the record or a guess; they place interpolation nodes, no more.

    - `low`, `high` [m]: the range of the group.
    - `switch` (tracks, switches) [m]: at each switch of the valve.
    """

    low: Array
    high: Array
    switch: Array


def tables(rig: Rig, outside: Surroundings, plan: Plan, strokes: Strokes) -> Tables:
    """Compute the step matrices for three strokes, both step lengths and every switch."""
    scales = rig.scales
    at_switch = strokes.switch[plan.kink_place[:, 0], plan.kink_place[:, 1]]
    middle = 0.5 * (strokes.low + strokes.high)
    extra = jnp.concatenate([jnp.stack([strokes.low, middle, strokes.high]), at_switch])
    columns = rig.column + extra[:, None]
    lengths = jnp.concatenate([jnp.full(3, plan.interval), jnp.asarray(plan.kink_rest)])
    matrix = jacobian(rig, outside, columns)
    phi = step_matrix(matrix, lengths[:, None], scales)
    short = phi[:, :, :3]
    long = jax.lax.fori_loop(
        0, STRIDE.bit_length() - 1, lambda _, p: doubled(matrix[:, :, :3], p), short
    )
    low, mid, high = jnp.moveaxis(jnp.stack([short, long]), 3, 0)
    none = jnp.zeros((1, len(scales), low.shape[-1]))
    kinks = jnp.concatenate([none, jnp.moveaxis(phi[:, 4, 3:], 1, 0)])
    # The phase of an oscillation over a step turns with the column: a straight line would miss it.
    return Tables(low, 4.0 * mid - 3.0 * low - high, 2.0 * (low + high) - 4.0 * mid, kinks)


def march(
    rig: Rig, contact: Array, fractions: Array, plan: Plan, strokes: Strokes
) -> dict[str, Array]:
    """Simulate a group of slow records from rest.

    - `rig`: parameters of shape (walkers,). - `contact` (walkers,) [N/m]: stiffness of the frame.
    - `fractions` (levels, tracks, walkers): flow fractions; level 0 is the shut valve.
    - `plan`: of the group's drives. - `strokes`: between which Phi is interpolated.

    Returns load [N], stroke [m] and pressure [Pa] at every sample, (samples, tracks, walkers).
    """
    advance = _advancer(rig, contact, fractions, plan, strokes)
    start = jnp.broadcast_to(
        rest_under(rig, 0.0, contact)[:, None], (len(rig.scales), *fractions.shape[1:])
    )
    last, (values, slopes) = jax.lax.scan(advance, start, _steps(plan))
    ending = Surroundings(
        contact,
        0.0,
        fractions[jnp.asarray(plan.levels[-1]), jnp.arange(fractions.shape[1])],
        plan.nodes[-1] * plan.interval,
    )
    rates = jnp.stack(rig.motion(last, ending).rates)
    value, slope = sampled(rig, last, rates, ending)
    return at_samples(
        plan, jnp.concatenate([values, value[None]]), jnp.concatenate([slopes, slope[None]])
    )


def _advancer(
    rig: Rig, contact: Array, fractions: Array, plan: Plan, strokes: Strokes
) -> Callable[[Array, tuple[Array, ...]], tuple[Array, tuple[Array, Array]]]:
    """Return the step of `march`: from a state and what changes to the next, and readings."""
    table = tables(rig, Surroundings(contact), plan, strokes)
    track = jnp.arange(fractions.shape[1])

    def advance(flat: Array, step: tuple[Array, ...]) -> tuple[Array, tuple[Array, Array]]:
        long, level, kink, level_after, begin = step
        length = jnp.where(long, STRIDE, 1) * plan.interval
        stroke = flat[2] - flat[0] + 0.5 * length * (flat[3] - flat[1])
        outside = Surroundings(contact, 0.0, fractions[level, track], begin + 0.5 * length)
        moved = rig.motion(flat, outside, rig.column + stroke)
        rates = jnp.stack(moved.rates)
        place = jnp.clip((stroke - strokes.low) / (strokes.high - strokes.low), -0.5, 1.5)
        index = long.astype(int)
        phi, slope, bend = table.low[index], table.slope[index], table.bend[index]
        new = flat
        for j in range(flat.shape[0]):
            change = slope[:, j, None] + place * bend[:, j, None]
            new = new + (phi[:, j, None] + place * change) * rates[j]

        def kicked(new: Array) -> Array:
            after = outside._replace(flow_fraction=fractions[level_after, track])
            jump = rig.motion(flat, after, rig.column + stroke).rates[4] - rates[4]
            return new + jnp.moveaxis(table.kinks[kink], 0, 1) * jump

        new = jax.lax.cond(jnp.any(kink > 0), kicked, lambda new: new, new)
        return new, sampled(rig, flat, rates, outside)

    return advance


def sampled(rig: Rig, flat: Array, rates: Array, outside: Surroundings) -> tuple[Array, Array]:
    """Load, stroke and pressure (3, tracks, walkers) and how fast they change."""
    return jax.jvp(lambda y: jnp.stack(readings(rig, y, outside)[:3]), (flat,), (rates,))


def _steps(plan: Plan) -> tuple[Array, ...]:
    """Return what changes from step to step, for the scan."""
    after = jnp.concatenate([jnp.zeros(1, int), jnp.asarray(plan.kink_level, dtype=int)])
    kink = jnp.asarray(plan.kink)
    level = jnp.asarray(plan.levels)
    begin = jnp.asarray(plan.nodes[:-1] * plan.interval)
    return jnp.asarray(plan.long), level, kink, jnp.where(kink > 0, after[kink], level), begin


def at_samples(plan: Plan, values: Array, slopes: Array) -> dict[str, Array]:
    """Interpolate node values to the samples by cubic Hermite polynomials."""
    left, length, place = plan.interpolation
    shape = (-1,) + (1,) * (values.ndim - 1)
    u, h = jnp.asarray(place).reshape(shape), jnp.asarray(length).reshape(shape)
    w0, w1 = (1 + 2 * u) * (1 - u) ** 2, u**2 * (3 - 2 * u)
    s0, s1 = u * (1 - u) ** 2 * h, u**2 * (u - 1) * h
    right = left + 1
    at = w0 * values[left] + w1 * values[right] + s0 * slopes[left] + s1 * slopes[right]
    return {name: at[:, i] for i, name in enumerate(("load", "stroke", "pressure"))}

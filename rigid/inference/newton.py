"""Damped Newton steps to an optimum of the exact likelihood, gains and zeros of sensors included.

One evaluation returns the value, the gradient and the information matrix: scores and curvatures
of the samples, carried through the derivatives of the simulation in forward mode, a walker for
each direction (`tangents`). `ScoringSolver` lets optimistix make its damped Newton steps and its
trust region with that, one evaluation a step. The least-squares solvers of optimistix would
linearise residuals, which there are none of where a sample is an interval.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import lineax as lx
import numpy as np
import optimistix as optx
from jax import Array

from rigid.inference.tangents import tangents
from rigid.io.compiled import compiled
from rigid.likelihood.channels import Piece
from rigid.likelihood.groups import predictions
from rigid.likelihood.problem import Problem

MAX_STEPS = 120
CLOSE = 1e-4
"""Converged when the next step promises less than this in log-posterior."""
LONGEST = 3.0
"""Largest change of an entry of z in one step: priors are of unit width."""
SHORTER = 0.4
SMALLEST = 1e-18
"""Inverse damping at which no step will ever be accepted."""
ROUGH = 0.05
"""Steps of a simulation follow its rig, so that the log-posterior jumps by so much from one point
to the next. A step that promises less is judged by its promise."""
PATIENCE = 3
"""Steps that promise that little and lead up, after which the solver ends."""


class Expansion(NamedTuple):
    """The negative log-posterior around a point of (z, standard gains and zeros), noise held.

    - `value`; `gradient` (n,); `information` (n, n): prior included.
    """

    value: Array | float
    gradient: Array | np.ndarray
    information: Array | np.ndarray


def is_noise(problem: Problem) -> np.ndarray:
    """Which entries of z are noise levels (size,)."""
    return np.array([p.base == "noise" for p in problem.parameters.sampled])


def joined(problem: Problem, z: np.ndarray, standard: np.ndarray) -> np.ndarray:
    """One vector of z, its noise levels left out, and gains and zeros (sensors, 2)."""
    return np.concatenate([np.asarray(z)[~is_noise(problem)], np.asarray(standard).ravel()])


@compiled
def split(
    problem: Problem, w: Array | np.ndarray, z_noise: Array | np.ndarray
) -> tuple[Array, Array]:
    """Part the vector into z (size,), noise levels put in, and gains and zeros (sensors, 2)."""
    noisy = is_noise(problem)
    free = np.flatnonzero(~noisy)
    z = jnp.zeros(problem.parameters.size).at[free].set(w[: len(free)])
    return z.at[np.flatnonzero(noisy)].set(z_noise), jnp.asarray(w[len(free) :]).reshape(-1, 2)


@compiled
def local(problem: Problem, w: Array, z_noise: Array) -> Expansion:
    """Expand the negative log-posterior around w; noise levels `z_noise` are held."""
    z, standard = split(problem, w, z_noise)
    free = np.flatnonzero(~is_noise(problem))
    directions = tangents(problem, free)
    base = jnp.broadcast_to(z, directions.along.shape)

    def predict(each: Array) -> list[dict[str, Array]]:
        return predictions(problem.groups, [problem.parameters.values(one) for one in each])

    expected, slopes = jax.jvp(predict, (base,), (jnp.asarray(directions.along),))
    sigmas = problem.parameters.values(z[None])
    # One place more than w has takes what belongs to no number of a track.
    n = len(w)
    value, gradient, information = 0.5 * jnp.sum(w * w), jnp.pad(w, (0, 1)), jnp.eye(n + 1)
    for piece in problem.pieces:
        at = np.array([problem.sensors.index(sensor) for sensor in piece.sensors])
        of_z = directions.entries[piece.group][np.array(piece.tracks)]
        of_sensors = len(free) + 2 * at[:, None] + np.arange(2)
        places = np.concatenate([np.where(of_z < len(free), of_z, n), of_sensors], axis=1)
        seen = piece.reading(expected)[..., 0], piece.reading(slopes)
        found = _of_piece(piece, seen, standard[at], piece.sigma(sigmas)[:, 0])
        value = value + found.value
        gradient = gradient.at[places].add(found.gradient)
        information = information.at[places[:, :, None], places[:, None]].add(found.information)
    return Expansion(value, gradient[:n], information[:n, :n])


def _of_piece(piece: Piece, seen: tuple[Array, Array], standard: Array, sigma: Array) -> Expansion:
    """Expand the negative log-likelihood of the samples of one piece.

    - `seen`: expected readings (samples, tracks) and their slopes along directions (samples,
      tracks, directions). - `standard` (tracks, 2): gains and zeros of its sensors.
    - `sigma` (tracks,): noise.

    Returns the value, and by track the gradient (tracks, directions + 2) and the information along
    directions, then by gain and zero.
    """
    spread = piece.sheet.spread
    gain, zero = standard[:, 0] * spread.gain, standard[:, 1] * spread.zero
    m, slopes = seen
    point = piece.sheet.noise_model(sigma)(piece.data - (1.0 + gain) * m - zero)
    by_zero = jnp.full_like(m, spread.zero)
    own = jnp.stack([spread.gain * m, by_zero], axis=-1)
    design = jnp.concatenate([slopes * (1.0 + gain)[:, None], own], axis=-1)
    bend = -piece.weight * point.curvature
    return Expansion(
        -jnp.sum(piece.weight * point.value),
        -jnp.einsum("st,stj->tj", piece.weight * point.slope, design),
        jnp.einsum("stj,stk->tjk", bend[..., None] * design, design),
    )


class ShortDescent(optx.AbstractDescent):
    """Damped Newton steps, damped further where an entry would change by more than LONGEST."""

    damped: optx.DampedNewtonDescent = optx.DampedNewtonDescent(lx.Cholesky())

    def init(self, y: Array, f_info_struct: Any) -> Any:
        """Make room for an expansion."""
        return self.damped.init(y, f_info_struct)

    def query(self, y: Array, f_info: Any, state: Any) -> Any:
        """Take in the expansion at the point that the next steps start from."""
        return self.damped.query(y, f_info, state)

    def step(self, step_size: Array, state: Any) -> tuple[Array, optx.RESULTS]:
        """Return the step for an inverse damping `step_size`."""

        def too_long(tried: tuple[Array, Array]) -> Array:
            size, step = tried
            return (jnp.max(jnp.abs(step)) > LONGEST) & (size > SMALLEST)

        def shorter(tried: tuple[Array, Array]) -> tuple[Array, Array]:
            size = SHORTER * tried[0]
            return size, self.damped.step(size, state)[0]

        step, result = self.damped.step(step_size, state)
        return jax.lax.while_loop(too_long, shorter, (step_size, step))[1], result


class _State(eqx.Module):
    first: Array
    y_eval: Array
    info: Any
    search: Any
    done: Array
    led_up: Array


class ScoringSolver(optx.AbstractMinimiser):
    """Minimise a function that returns its value and, as aux, its gradient and information.

    A point without a finite value is never accepted, the first excepted: there the solver ends.
    The function may be rough by ROUGH: a strict descent would be caught at one of its jumps, up to
    a standard deviation from the optimum, and count the grains there until its steps are used up
    (the idea is that of Sun and Nocedal 2023, Math. Program. 202).
    """

    descent: ShortDescent = ShortDescent()
    search: optx.ClassicalTrustRegion = optx.ClassicalTrustRegion()
    rtol: float = CLOSE
    atol: float = CLOSE
    norm: Any = optx.max_norm

    # Arguments that neither needs are taken together.
    def init(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, fn: Any, y: Array, args: Any, options: Any, *structs: Any
    ) -> _State:
        """Begin with an expansion of nothing, which the first step replaces."""
        del fn, args, options
        _, aux_struct, _ = structs
        empty = _info(jnp.asarray(jnp.inf), *(jnp.zeros(a.shape) for a in aux_struct))
        search, no = self.search.init(y, empty), jnp.asarray(False)
        return _State(~no, y, empty, search, no, jnp.asarray(0))

    def step(
        self, fn: Any, y: Array, args: Any, options: Any, state: _State, tags: Any
    ) -> tuple[Array, _State, tuple[Array, Array]]:
        """Evaluate where the last step led, accept it or not, and decide on the next."""
        del options, tags
        value, aux = fn(state.y_eval, args)
        there, f = _info(value, *aux), state.info.f
        promise = -self.search.predict_reduction(state.y_eval - y, state.info)
        small = (promise < ROUGH) & (value < f + ROUGH) & ~state.first
        judged = _info(jnp.where(small, jnp.minimum(value, f - promise), value), *aux)
        size, accept, _, search = self.search.step(
            state.first, y, state.y_eval, state.info, judged, state.search
        )
        accept = accept & (jnp.isfinite(value) | state.first)
        y, info = jax.tree.map(
            lambda new, old: jnp.where(accept, new, old), (state.y_eval, there), (y, state.info)
        )
        memory = self.descent.query(y, info, self.descent.init(y, info))
        step, _ = self.descent.step(size, memory)
        settled = (-0.5 * step @ info.grad < CLOSE) & (size >= 1.0)
        led_up = state.led_up + (small & (value >= f))
        stuck = (~accept & (promise < CLOSE)) | (led_up >= PATIENCE) | (size < SMALLEST)
        done = settled | stuck | ~jnp.isfinite(info.f) | args.stay
        state = _State(jnp.asarray(False), y + step, info, search, done, led_up)
        return y, state, (info.grad, info.hessian.as_matrix())

    def terminate(
        self, fn: Any, y: Array, args: Any, options: Any, state: _State, tags: Any
    ) -> tuple[Array, optx.RESULTS]:
        """Tell whether the last step was the last."""
        del fn, y, args, options, tags
        return state.done, optx.RESULTS.successful

    def postprocess(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, fn: Any, y: Array, aux: Any, args: Any, options: Any, *rest: Any
    ) -> tuple[Array, Any, dict[str, Any]]:
        """Hand over value, gradient and information at the end."""
        del fn, aux, args, options
        info = rest[0].info
        return y, Expansion(info.f, info.grad, info.hessian.as_matrix()), {}


def _info(value: Array, gradient: Array, information: Array) -> Any:
    """Put an expansion in the form that optimistix works on."""
    return optx.FunctionInfo.EvalGradHessian(
        value, gradient, lx.MatrixLinearOperator(information, lx.positive_semidefinite_tag)
    )


class _Asked(NamedTuple):
    problem: Problem
    z_noise: Array
    stay: Array


def _expanded(w: Array, args: _Asked) -> tuple[Array, tuple[Array, Array]]:
    problem, z_noise, _ = args
    found = local(problem, w, z_noise)
    return jnp.asarray(found.value), (jnp.asarray(found.gradient), jnp.asarray(found.information))


def descend(problem: Problem, w: np.ndarray, z_noise: np.ndarray) -> tuple[np.ndarray, Expansion]:
    """Lead w to an optimum; returns it and the expansion there, in NumPy.

    The best point so far is returned when the steps are used up.
    """
    return _minimised(problem, w, z_noise, stay=False)


def expanded(problem: Problem, w: np.ndarray, z_noise: np.ndarray) -> Expansion:
    """Expand at w, in NumPy: `local`, by the program of `descend`, so that no other is compiled."""
    return _minimised(problem, w, z_noise, stay=True)[1]


def lower(problem: Problem, w: np.ndarray, z_noise: np.ndarray) -> None:
    """Trace `descend` and lower it, so that only XLA's compiling is left."""
    _led.lower(*_given(problem, w, z_noise, stay=False))


def _given(
    problem: Problem, w: np.ndarray, z_noise: np.ndarray, *, stay: bool
) -> tuple[_Asked, Array]:
    """What a descent is started with."""
    return _Asked(problem, jnp.asarray(z_noise), jnp.asarray(stay)), jnp.asarray(w)


@compiled
def _led(asked: _Asked, w: Array) -> tuple[Array, Expansion, Array]:
    """Lead w to an optimum; returns it, the expansion there, and how many it took."""
    solution = optx.minimise(
        _expanded, ScoringSolver(), w, asked, has_aux=True, max_steps=MAX_STEPS, throw=False
    )
    there: Any = solution.aux  # what `postprocess` handed over
    return solution.value, there, solution.stats["num_steps"]


def _minimised(
    problem: Problem, w: np.ndarray, z_noise: np.ndarray, *, stay: bool
) -> tuple[np.ndarray, Expansion]:
    end, there, _ = _led(*_given(problem, w, z_noise, stay=stay))
    return np.asarray(end), Expansion(
        float(there.value), np.asarray(there.gradient), np.asarray(there.information)
    )

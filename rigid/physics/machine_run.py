"""A machine's runs: marched through by Rosenbrock steps, or by diffrax as the reference."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.physics.full import solved
from rigid.physics.machine import Drive, Machine, Reading, jacobian
from rigid.physics.rosenbrock import step

OF_A_SWING = 1e-6
"""Share of a swing by which a march may err while the swing lasts."""

A_STEP = 1.6e-4
"""Share of it by which a step errs that is 1 radian long; it goes with the fifth power. Measured on
a body on a spring: 600 steps of 0.27 rad."""

COARSEST = 0.5
"""Radians of a swing in a step, at most."""

MOST_STEPS = 64
"""Steps a sample at most; what swings faster dies within a sample, or the reference tells."""


class Drives(eqx.Module):
    """What is done to a machine in several runs, in steps of equal length.

    - `first`, `last` (samples - 1, steps, levels, runs, joints) [-]: what the valve passes of each
      flow fraction where a step begins and where it ends, a straight line between.
    - `begin`, `end`: the same of forces (samples - 1, steps, runs, joints) [N].
    - `interval` [s]: between samples. - `asked`: samples from the beginning on that are asked for;
      from then on everything stands still. None: all.
    """

    first: Array
    last: Array
    begin: Array
    end: Array
    interval: float = eqx.field(static=True)
    asked: Array | None = None

    @property
    def steps(self) -> int:
        """Steps between two samples."""
        return self.first.shape[1]

    @property
    def length(self) -> float:
        """Of a step [s]."""
        return self.interval / self.steps


def steps_a_sample(machine: Machine, interval: float, lasts: float) -> int:
    """Into how many steps a sample is cut, so that what swings is resolved.

    - `machine`: of one walker, each number (1,). - `interval` [s]: between samples.
    - `lasts` [s]: of a run.
    """
    size = len(machine.scales)
    still = Drive(jnp.zeros((len(machine.joints), 1)), jnp.zeros((len(machine.joints), 1)), 0.0)
    at_rest = jacobian(lambda flat: machine.rates(flat, still), jnp.zeros((size, 1)))
    modes = np.linalg.eigvals(np.asarray(at_rest)[..., 0])
    swings = modes[modes.imag > 0.0]
    fast, dies = swings.imag, np.maximum(-swings.real, 1.0 / lasts)
    allowed = (OF_A_SWING * dies / (A_STEP * fast**5)) ** 0.25
    longest = np.minimum(allowed, COARSEST / fast)
    return int(np.clip(np.ceil(interval / np.min(longest, initial=interval)), 1, MOST_STEPS))


def march(machine: Machine, start: Array, fractions: Array, drives: Drives) -> Reading:
    """Readings (samples, joints, runs, walkers) of all runs.

    - `start` (n, runs, walkers). - `fractions` (levels, runs, joints, walkers) [-].
    """

    def drive(open_: Array, force: Array, time: Array) -> Drive:
        flow = jnp.einsum("lrj,lrjw->jrw", open_, fractions)
        return Drive(flow, force.T[:, :, None] + jnp.zeros_like(flow), time)

    def one(state: Array, given: tuple) -> tuple[Array, None]:
        first, last, begin, end, time = given
        ends = drive(first, begin, time), drive(last, end, time + drives.length)
        return step(machine.rates, state, *ends, drives.length), None

    def sample(state: Array, given: tuple) -> tuple[Array, Reading]:
        first, _, begin, _, time = given
        read = machine.read(state, drive(first[0], begin[0], time[0]))
        return jax.lax.cond(time[0] < until, on, lambda state, _: state, state, given), read

    def on(state: Array, given: tuple) -> Array:
        return jax.lax.scan(one, state, given)[0]

    count, steps = drives.first.shape[:2]
    until = drives.interval * (jnp.inf if drives.asked is None else drives.asked - 0.5)
    times = drives.length * jnp.arange(count * steps).reshape(count, steps)
    given = drives.first, drives.last, drives.begin, drives.end, times
    state, series = jax.lax.scan(sample, start, given)
    ended = drive(drives.last[-1, -1], drives.end[-1, -1], jnp.asarray(count * drives.interval))
    final = machine.read(state, ended)
    return Reading(*(jnp.concatenate([a, b[None]]) for a, b in zip(series, final, strict=True)))


def reference(
    machine: Machine, start: Array, fractions: Array, drives: Drives, tolerance: float
) -> Reading:
    """The same by diffrax, run by run and walker by walker; nan where a solve did not end."""
    walkers = fractions.shape[-1]
    machines = jax.tree.map(lambda a: jnp.broadcast_to(a, (*a.shape[:-1], walkers)), machine)
    wide = jnp.broadcast_to(start, (*start.shape[:2], walkers))

    def one(given: tuple[Machine, Array, Array]) -> Reading:
        alone, state, passed = given
        runs = [
            _run(alone, state[:, run], passed[:, run], _of_run(drives, run), tolerance)
            for run in range(start.shape[1])
        ]
        return Reading(*(jnp.stack(parts, axis=2) for parts in zip(*runs, strict=True)))

    each = jax.tree.map(lambda a: jnp.moveaxis(a, -1, 0), (machines, wide, fractions))
    found = jax.lax.map(one, each)
    return jax.tree.map(lambda a: jnp.moveaxis(a, 0, -1), found)


def _of_run(drives: Drives, run: int) -> Drives:
    """What is done in one run alone."""
    return Drives(
        drives.first[..., run, :],
        drives.last[..., run, :],
        drives.begin[..., run, :],
        drives.end[..., run, :],
        drives.interval,
    )


def _run(
    machine: Machine, start: Array, fractions: Array, drives: Drives, tolerance: float
) -> Reading:
    """Readings (samples, joints) of one run; `start` (n,), `fractions` (levels, joints)."""
    count, steps = drives.first.shape[:2]

    def flat(one: Array) -> Array:
        return one.reshape(count * steps, *one.shape[2:])

    first, last, begin, end = map(flat, (drives.first, drives.last, drives.begin, drives.end))

    def now(time: Array) -> Drive:
        number = jnp.clip((time / drives.length).astype(int), 0, count * steps - 1)
        share = time / drives.length - number
        passed = first[number] + share * (last[number] - first[number])
        force = begin[number] + share * (end[number] - begin[number])
        return Drive(jnp.sum(passed * fractions, axis=0), force, time)

    times = drives.interval * jnp.arange(count + 1)
    path = solved(
        lambda time, state: machine.rates(state, now(time)),
        machine.scales,
        start,
        ((times[0], times[-1]), times),
        tolerance,
        drives.interval,
    )
    states = jnp.where(path.ended, path.states, jnp.nan)
    return jax.vmap(lambda state, time: machine.read(state, now(time)))(states, times)

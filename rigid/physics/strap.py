"""How the strap of a release lets go: not at once, but by a law over time with two shape numbers.

The share of the preload that has gone follows a law whose quantile function is
Q(u) ~ (u^a - 1)/a - ((1 - u)^b - 1)/b, `begin` a and `end` b: 0 is a long tail, 1 a corner, more a
jump. a = b = 0 is logistic, a = b = 1 linear, b = 0 with a large a exponential. Source: Freimer,
Kollia, Mudholkar and Lin 1988, Communications in Statistics 17(10), the generalised lambda law.

A rig that swings free is as good as linear, so what a gradual release does is the mean of what
sudden ones do (`rigid.physics.release`) over the instants of the law. Those that are whole samples
apart are had from one simulation. Between them the mean is interpolated, after what a sudden
release does abruptly has been taken out: its jump, and the relaxation just after, which are
averaged exactly.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from rigid.physics.rest import rest_under
from rigid.physics.rig import FREE, Rig
from rigid.physics.sensors import readings

GONE = np.concatenate([[0.0, 0.01, 0.03], np.linspace(0.06, 0.94, 17), [0.97, 0.99, 1.0]])
"""Shares of the preload between which the force falls linearly in time."""
PARTS = np.diff(GONE)
TAIL = 0.002
"""Share at either end of the law that is cut off, where it may be endless."""
ONSET = 0.2
"""Share that has gone at the release time: from there on a release stands out of its record."""
REACH = 16
"""Samples to either side of the release within which the strap lets go."""
GAUSS = 0.5 / 3.0**0.5
"""Places of the two nodes that stand for a bin, from its middle, over its width."""
NARROW = 1e-9
"""Seconds within which a share that goes is taken to go at once."""
LOWEST, HIGHEST = 0.1, 30.0
"""Rates of the relaxation that is averaged exactly, per sample; slower ones need no care, faster
ones are over before a sample sees them."""


def edges(duration: Array, begin: ArrayLike, end: ArrayLike) -> Array:
    """Instants [s] after the release time by which the shares GONE of the preload have gone.

    - `duration` [s]: from 10 to 90 %. - `begin`, `end`: shape numbers a and b, above 0.

    Returns (len(GONE), *duration.shape).
    """
    u = jnp.clip(GONE, TAIL, 1.0 - TAIL).reshape(-1, *(1,) * duration.ndim)

    def quantile(u: ArrayLike) -> Array:
        late, early = jnp.asarray(begin), jnp.asarray(end)
        return (jnp.power(u, late) - 1.0) / late - (jnp.power(1.0 - u, early) - 1.0) / early

    return duration * (quantile(u) - quantile(ONSET)) / (quantile(0.9) - quantile(0.1))


class Lattice(NamedTuple):
    """Sudden releases whole samples apart, one of them at the release time.

    - `delay` [s]: from one of them to the next sample, above 0 and at most an interval. - `number`:
      of samples by which the release time is after the one that the first sample follows.
    """

    delay: Array
    number: Array


def lattice(delay: Array, interval: float) -> Lattice:
    """Lay the lattice; `delay` [s]: from the release time to the first sample, of either sign."""
    whole = jax.lax.stop_gradient(jnp.ceil(delay / interval - 1e-12) - 1.0)
    return Lattice(delay - whole * interval, -whole)


class Abrupt(NamedTuple):
    """What a sudden release does at once: (jump + rise (1 - exp(-rate t))) for t > 0."""

    jump: Array
    rise: Array
    rate: Array

    def sampled(self, time: Array) -> Array:
        """At times after a sudden release [s]."""
        late = jnp.maximum(time, 0.0)
        found = self.jump - self.rise * jnp.expm1(-self.rate * late)
        return jnp.where(time > 0.0, found, 0.0)

    def averaged(self, time: Array, law: Array) -> Array:
        """The mean over a law with `edges` (len(GONE), ...); `time` (times, ...) after the release.

        In each bin it is the difference of the integral at the bin's edges over its width.
        """
        late = jnp.maximum(time - law[:, None], 0.0)  # (edges, times, ...)
        risen = late + jnp.expm1(-self.rate * late) / self.rate
        width = (law[1:] - law[:-1])[:, None]
        narrow, wide = width < NARROW, jnp.maximum(width, NARROW)
        # a bin without width is a step at its first edge
        jump = jnp.where(narrow, late[:-1] > 0.0, (late[:-1] - late[1:]) / wide)
        rise = jnp.where(
            narrow, -jnp.expm1(-self.rate * late[:-1]), (risen[:-1] - risen[1:]) / wide
        )
        return jnp.tensordot(PARTS, self.jump * jump + self.rise * rise, axes=1)


def abrupt(rig: Rig, preload: Array, interval: float) -> Abrupt:
    """What the accelerometer does just after a sudden release under a preload."""
    start = rest_under(rig, preload)

    def read(flat: Array) -> Array:
        return jnp.broadcast_to(readings(rig, flat, FREE).acceleration, preload.shape)

    def slope(flat: Array) -> tuple[Array, Array]:
        rates = rig.motion(flat, FREE).rates
        moved = jnp.stack([jnp.broadcast_to(r, preload.shape) for r in rates])
        return jax.jvp(read, (flat,), (moved,))[1], moved

    first, moved = slope(start)
    _, second = jax.jvp(lambda flat: slope(flat)[0], (start,), (moved,))
    safe = jnp.where(jnp.abs(first) < 1e-6, 1e-6, first)
    rate = jnp.clip(-second / safe, LOWEST / interval, HIGHEST / interval)
    return Abrupt(read(start), first / rate, rate)


Ring = Callable[[Rig, Array, Array, float, int], Array]
"""How a rig swings out after a sudden release; arguments and result as `rigid.physics.release`."""


def releases_of(rig: Rig) -> int:
    """How many sudden releases a sample a gradual one is the mean of."""
    return max((effect.finer for effect in rig.effects), default=1)


def gradual(
    ring: Ring,
    rig: Rig,
    preload: Array,
    law: Array,
    sampled: tuple[Array, float],
    samples: int,
) -> Array:
    """Acceleration when the strap lets go by a law, (samples, tracks, walkers), from REACH before.

    - `ring`: in intervals of which `releases_of` make a sample. - `law`: edges.
    - `sampled`: time of the first sample after the release time (tracks, walkers), interval [s].

    What swings nearly as fast as it is sampled takes more sudden releases.
    """
    finer, (delay, interval) = releases_of(rig), sampled
    step = interval / finer
    at = lattice(delay, step)
    swing = ring(rig, preload, at.delay, step, finer * samples)
    return _let_go(swing, abrupt(rig, preload, step), at, law / step, (step, finer))


def _let_go(
    swing: Array, sudden: Abrupt, at: Lattice, law: Array, steps: tuple[float, int]
) -> Array:
    """Acceleration when the strap lets go by a law, from REACH samples before the first on.

    - `swing` (all steps, tracks, walkers): after a sudden release at the lattice. - `law`: edges,
      in steps. - `steps`: length of one [s], and how many make a sample.
    """
    length, every = steps
    reach = every * REACH
    law = jnp.clip(at.number + law, 2.0 - reach, reach - 2.0)
    middle, half = 0.5 * (law[1:] + law[:-1]), GAUSS * (law[1:] - law[:-1])
    nodes = jnp.concatenate([middle - half, middle + half])
    number = jnp.arange(-reach, reach + 1).reshape(-1, *(1,) * law.ndim)
    taps = jnp.einsum("b,tb...->t...", np.tile(0.5 * PARTS, 2), _kernel(nodes - number))
    early = jnp.arange(-reach, reach + 3, every)[:, None, None]
    late = jnp.arange(3 * reach + 4)[:, None, None]
    exact = sudden.averaged(at.delay + length * early, length * law)
    rough = _mean(sudden.sampled(at.delay + length * late), taps, every)[: len(early)]
    found = _mean(swing, taps, every)[: len(swing) // every]
    return found.at[: len(early)].add(exact - rough)


def _mean(series: Array, taps: Array, every: int) -> Array:
    """Weighted mean of a series (steps, ...) shifted by -reach to reach, from -reach on.

    - `taps` (2 reach + 1, ...): weight of each shift. - `every`: so many steps make a sample.
    """
    reach = len(taps) // 2
    room = ((2 * reach, reach),) + ((0, 0),) * (series.ndim - 1)
    padded, wide = jnp.pad(series, room), len(series) + reach

    def shifted(total: Array, each: tuple[Array, Array]) -> tuple[Array, None]:
        tap, number = each
        there = jax.lax.dynamic_slice_in_dim(padded, 2 * reach - number, wide)
        return total + tap * there[::every], None

    zero = jnp.zeros((-(-wide // every), *taps.shape[1:]))
    return jax.lax.scan(shifted, zero, (taps, jnp.arange(len(taps))))[0]


def _kernel(x: Array) -> Array:
    """Cubic convolution: interpolates, and keeps mean and variance. Source: Keys 1981, IEEE Trans.

    Acoustics, Speech, and Signal Processing 29(6).
    """
    a = jnp.abs(x)
    near = 1.0 + a * a * (1.5 * a - 2.5)
    far = 2.0 + a * (-4.0 + a * (2.5 - 0.5 * a))
    return jnp.where(a < 1.0, near, jnp.where(a < 2.0, far, 0.0))

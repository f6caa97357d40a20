"""The reference for all faster ways: diffrax on the rig's own equations, any rig, any record."""

import diffrax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from rigid.physics.rig import Rig, Surroundings
from rigid.physics.sensors import readings
from rigid.solve.drive import Drive
from rigid.solve.rest import rest_under

TOLERANCE = 1e-8
MAX_STEPS = 2_000_000


def integrate(
    rig: Rig, outside: Surroundings, start: Array, times: Array, tolerance: float = TOLERANCE
) -> Array:
    """States at `times` [s] (first = time of `start`), shape (len(times), n), by Kvaerno5.

    - `rig`: scalar parameters. - `tolerance`: relative; absolute in units of the rig's scales.
    """
    scales = jnp.asarray(rig.scales)

    def field(_time: ArrayLike, scaled: Array, _: None) -> Array:
        return jnp.stack(rig.motion(scaled * scales, outside).rates) / scales

    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(field),
        diffrax.Kvaerno5(),
        times[0],
        times[-1],
        None,
        start / scales,
        saveat=diffrax.SaveAt(ts=times),
        stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance),
        max_steps=MAX_STEPS,
    )
    path = solution.ys
    assert path is not None  # it is what SaveAt(ts) asks for
    return path * scales


def simulate(
    rig: Rig, contact: Array, fractions: Array, drive: Drive, tolerance: float = TOLERANCE
) -> dict[str, Array]:
    """Simulate one slow record: load, stroke, pressure and acceleration, (samples,) each.

    - `contact` [N/m]; `fractions` (levels,): flow fractions, level 0 the shut valve.
    """
    bounds = (drive.first, *drive.switches, np.inf)
    flat = rest_under(rig, 0.0, contact)
    rows = []
    for level, begin, end in zip(drive.levels, bounds[:-1], bounds[1:], strict=True):
        inside = drive.times[(drive.times >= begin) & (drive.times < end)]
        stop = min(end, drive.times[-1])
        if begin > drive.times[-1]:
            break
        times = np.unique([begin, *inside, stop]) if stop > begin else np.array([begin])
        outside = Surroundings(contact, 0.0, fractions[level])
        path = flat[None]
        if len(times) > 1:
            path = integrate(rig, outside, flat, jnp.asarray(times), tolerance)
        rows += [readings(rig, path[i], outside) for i in np.searchsorted(times, inside)]
        flat = path[-1]
    return {name: jnp.stack([getattr(row, name) for row in rows]) for name in rows[0]._fields}


def simulate_release(
    rig: Rig, preload: Array, delay: Array, interval: float, samples: int
) -> Array:
    """Acceleration of the plate after a release [m/s^2], (samples,), as `release.ring`."""
    free = Surroundings()
    times = jnp.concatenate([jnp.zeros(1), delay + interval * jnp.arange(samples)])
    path = integrate(rig, free, rest_under(rig, preload), times)
    return jnp.stack([readings(rig, y, free).acceleration for y in path[1:]])

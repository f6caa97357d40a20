"""Lines that sensors pick up: read beside what the rig does, whatever solves its motion."""

from collections.abc import Mapping

import jax.numpy as jnp
from jax import Array

from rigid.physics.rig import Rig


def with_lines(
    rig: Rig, found: Mapping[str, Array], interval: float, angles: Mapping[str, Array]
) -> dict[str, Array]:
    """Return readings (samples, tracks, walkers) by quantity with all lines in them.

    - `found`: without. - `interval` [s]: between samples.
    - `angles` (tracks, walkers) [rad]: of each quantity's lines at the first sample.
    """
    out = dict(found)
    for effect in rig.effects:
        for quantity, (amplitude, frequency) in effect.lines().items():
            if quantity in out:
                time = interval * jnp.arange(len(out[quantity]))[:, None, None]
                turned = 2.0 * jnp.pi * frequency * time + angles[quantity]
                out[quantity] = out[quantity] + amplitude * jnp.sin(turned)
    return out

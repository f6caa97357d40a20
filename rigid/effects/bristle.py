"""Dry friction as a bristle that bends before it slides; the laws differ in where it slides.

Its share s of the sliding force follows ds/dt = (v - |v| s / r) / z, with r = 1 or a limit that
falls with speed. Sliding steadily it carries r sgn(v). Standing still it keeps its force, hour
after hour: the rate is proportional to the speed, so nothing creeps. Sources: Dahl 1968, Aerospace
Corp. TOR-0158(3107-18)-1, for a constant limit; Canudas de Wit, Olsson, Astrom and Lischinsky 1995,
IEEE Trans. Automatic Control 40(3), eqs. (2)-(4), for one that falls with speed.
"""

from typing import Any

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from rigid.effects.declare import any_size, lognormal, parameter

SPEED_ROUNDING = 1e-7
"""Speed [m/s] below which |v| is rounded off, so that it has a derivative at rest; a plunger that
slides on record is ten thousand times as fast."""


def magnitude(slip: Array) -> Array:
    """|v| with its corner rounded off; 0 at rest."""
    return jnp.sqrt(slip**2 + SPEED_ROUNDING**2) - SPEED_ROUNDING


def share_rate(share: Array, slip: Array, bending: ArrayLike, limit: ArrayLike = 1.0) -> Array:
    """Rate [1/s] of the share of the sliding force that a bristle carries.

    - `share`: now. - `slip` [m/s]. - `bending` [m]: at which it slides. - `limit`: share there.
    """
    return (slip - magnitude(slip) * share / limit) / bending


def stribeck_limit(slip: Array, excess: ArrayLike, speed: ArrayLike) -> Array:
    """Sliding force by speed as a share of that at high speed: 1 + excess exp(-(v/v_S)^2).

    - `excess` [-]: of breaking away. - `speed` [m/s]: v_S, at which it has mostly gone.
    """
    return 1.0 + jnp.asarray(excess) * jnp.exp(-((slip / speed) ** 2))


def sliding_force() -> Any:
    """Declare the force F_C that every law of dry friction has."""
    return parameter(
        "F_C",
        r"F_\mathrm{C}",
        "N",
        any_size(500.0),
        meaning="dry friction while sliding",
        absent=0.0,
    )


def sliding_bending(name: str = "presliding", symbol: str = r"z_\mathrm{C}") -> Any:
    """Declare how far a stiff bristle bends before it slides.

    Below what a stroke sensor of 0.2 mm resolves; in a release it is a spring beside the load
    cell's, and so it matters there whether it is one micrometre or twenty.
    """
    return parameter(
        name,
        symbol,
        "m",
        lognormal(1e-5, 4.0),
        meaning="bending at which dry friction slides",
        sized=False,  # a matter of two surfaces, not of how large a machine is
    )


def stribeck_excess() -> Any:
    """Declare how much more than F_C it takes to break away."""
    return parameter(
        "stribeck_excess",
        r"e_\mathrm{S}",
        "1",
        lognormal(0.5, 2.0),
        meaning="excess of dry friction at rest over that while sliding",
    )


def stribeck_speed() -> Any:
    """Declare the speed at which that excess has mostly gone."""
    return parameter(
        "v_stribeck",
        r"v_\mathrm{S}",
        "m/s",
        lognormal(2e-3, 2.0),
        meaning="speed over which dry friction falls",
    )

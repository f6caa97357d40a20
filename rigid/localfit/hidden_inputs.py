"""Hidden forces and flows: what may be missing where no effect of the catalogue says so.

Each adds a bump of unknown height to one equation, over time or over a state of the rig. At
height 0 they change nothing; what a bump would leave in the records is one forward derivative.
"""

from typing import ClassVar

import jax.numpy as jnp
from jax import Array

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import fixed, parameter

VARIABLES = ("time", "pressure", "stroke", "speed")
"""What a hidden force or flow may follow."""

UNITS = {"time": "s", "pressure": "Pa", "stroke": "m", "speed": "m/s", "load": "N",
         "cylinder speed": "m/s"}  # fmt: skip


def bump(value: Array | float, centre: Array, width: Array) -> Array:
    """Triangle of height 1 at `centre` that falls to 0 at `width` on either side."""
    return jnp.maximum(0.0, 1.0 - jnp.abs(value - centre) / width)


def followed(heights: Array, centre: Array, width: Array, state: State) -> Array:
    """Sum of the bumps over time, pressure, stroke and speed, by their `heights` (4, ...)."""
    seen = (state.time, state.pressure, state.stroke, state.slip)
    return sum(
        (h * bump(v, centre, width) for h, v in zip(heights, seen, strict=True)),
        start=jnp.zeros(()),
    )


class HiddenForce(AbstractEffect):
    """A force between plunger and cylinder [N]."""

    heights: Array = parameter("hidden_force", r"F_?", "N", *[fixed(0.0)] * 4, absent=0.0)
    centre: Array = parameter("hidden_force_centre", r"c_F", "1", fixed(0.0))
    width: Array = parameter("hidden_force_width", r"w_F", "1", fixed(1.0))

    name: ClassVar[str] = "hidden-force"
    equation: ClassVar[str] = "plunger-momentum"
    source: ClassVar[str] = "latent force; Alvarez, Luengo and Lawrence 2009, AISTATS 5, 9-16"
    steady: ClassVar[bool] = True

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the force."""
        return Action(between=followed(self.heights, self.centre, self.width, state))


class HiddenFlow(AbstractEffect):
    """A flow of oil into the chamber [m^3/s], whatever the valve."""

    heights: Array = parameter("hidden_flow", r"q_?", "m^3/s", *[fixed(0.0)] * 4, absent=0.0)
    centre: Array = parameter("hidden_flow_centre", r"c_q", "1", fixed(0.0))
    width: Array = parameter("hidden_flow_width", r"w_q", "1", fixed(1.0))

    name: ClassVar[str] = "hidden-flow"
    equation: ClassVar[str] = "oil-balance"
    source: ClassVar[str] = "latent force; Alvarez, Luengo and Lawrence 2009, AISTATS 5, 9-16"
    steady: ClassVar[bool] = True
    kinds: ClassVar[tuple[str, ...] | None] = ("slow", "release")

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the flow, as a leakage of the other sign."""
        return Action(leakage=-followed(self.heights, self.centre, self.width, state))


class HiddenDrag(AbstractEffect):
    """A force from outside on the cylinder [N] that the load cell does not read."""

    heights: Array = parameter("hidden_drag", r"F_{\mathrm{HC}?}", "N", *[fixed(0.0)] * 2,
                               absent=0.0)  # fmt: skip
    centre: Array = parameter("hidden_drag_centre", r"c_d", "1", fixed(0.0))
    width: Array = parameter("hidden_drag_width", r"w_d", "1", fixed(1.0))

    name: ClassVar[str] = "hidden-drag"
    equation: ClassVar[str] = "cylinder-momentum"
    source: ClassVar[str] = "latent force; Alvarez, Luengo and Lawrence 2009, AISTATS 5, 9-16"
    steady: ClassVar[bool] = True
    kinds: ClassVar[tuple[str, ...] | None] = ("slow", "release")

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the force over time or over the speed of the cylinder."""
        over_time = self.heights[0] * bump(state.time, self.centre, self.width)
        over_speed = self.heights[1] * bump(state.v_cylinder, self.centre, self.width)
        return Action(on_cylinder=over_time + over_speed)


class HiddenSpring(AbstractEffect):
    """A force of the load-cell end on the cylinder [N] that the load cell reads."""

    heights: Array = parameter("hidden_spring", r"F_{\mathrm{LC}?}", "N", *[fixed(0.0)] * 2,
                               absent=0.0)  # fmt: skip
    centre: Array = parameter("hidden_spring_centre", r"c_k", "1", fixed(0.0))
    width: Array = parameter("hidden_spring_width", r"w_k", "1", fixed(1.0))

    name: ClassVar[str] = "hidden-spring"
    equation: ClassVar[str] = "load-cell"
    source: ClassVar[str] = "latent force; Alvarez, Luengo and Lawrence 2009, AISTATS 5, 9-16"
    steady: ClassVar[bool] = True
    kinds: ClassVar[tuple[str, ...] | None] = ("slow", "release")

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the force over time or over the displacement of the cylinder."""
        over_time = self.heights[0] * bump(state.time, self.centre, self.width)
        over_place = self.heights[1] * bump(state.x_cylinder, self.centre, self.width)
        return Action(load_cell=over_time + over_place)


BY_KIND: dict[str, type[AbstractEffect]] = {
    "force": HiddenForce,
    "drag": HiddenDrag,
    "flow": HiddenFlow,
    "spring": HiddenSpring,
}
"""By what they add."""

HIDDEN = tuple(BY_KIND.values())

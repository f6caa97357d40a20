"""Hidden forces and flows: what may be missing where no effect of the catalogue says so.

Each adds a bump of unknown height to one equation, over time or over a state of the rig. At
height 0 they change nothing; what a bump would leave in the records is one forward derivative.
"""

import dataclasses
from collections.abc import Callable, Iterator
from typing import ClassVar, cast

import equinox as eqx
import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.declare import fixed, parameter
from rigid.effects.placed import placed
from rigid.likelihood.problem import Problem
from rigid.physics.machine import LOAD_CELL


@dataclasses.dataclass(frozen=True)
class Abscissa:
    """What something hidden goes by: its name, SI unit and symbol in formulas."""

    name: str
    unit: str
    symbol: str = "y"


@dataclasses.dataclass(frozen=True)
class Followed(Abscissa):
    """What a hidden force or flow goes by.

    - `of`: gives it from the state of the rig. - `turns`: whether it changes its sign.
    """

    of: Callable[[State], Array | float] = lambda state: state.time
    turns: bool = False


TIME = Followed("time", "s", "t")
PRESSURE = Followed("pressure", "Pa", "p", lambda state: state.pressure)
STROKE = Followed("stroke", "m", "x", lambda state: state.stroke)
SPEED = Followed("speed", "m/s", "v", lambda state: state.slip, turns=True)
CYLINDER_SPEED = Followed("cylinder speed", "m/s", "v", lambda state: state.v_cylinder, turns=True)
LOAD = Followed("load", "m", "x", lambda state: state.x_cylinder, turns=True)
"""The load, as the displacement of the cylinder that goes with it."""


def bump(value: ArrayLike, centre: ArrayLike, width: ArrayLike) -> Array:
    """Triangle of height 1 at `centre` that falls to 0 at `width` on either side."""
    return jnp.maximum(0.0, 1.0 - jnp.abs(jnp.subtract(value, centre)) / width)


class AbstractHiddenInput(AbstractEffect):
    """A bump of one force or flow.

    - `heights`: over each of `followed`; `centre`, `width`: of the bump; declared in that order.
    - `acts`: entry of `Action` that it adds to, with its `sign`.
    - `at_a_joint`: what it is at a joint of a machine, in words.
    """

    heights: eqx.AbstractVar[Array]
    centre: eqx.AbstractVar[Array]
    width: eqx.AbstractVar[Array]

    followed: eqx.AbstractClassVar[tuple[Followed, ...]]
    at_a_joint: ClassVar[str]
    acts: ClassVar[str] = "between"
    sign: ClassVar[float] = 1.0
    source: ClassVar[str] = "latent force; Alvarez, Luengo and Lawrence 2009, AISTATS 5, 9-16"
    steady: ClassVar[bool] = True

    def size(self, state: State) -> Array:
        """Sum of the bumps over all that it may follow.

        They are worked out side by side: programs that hold them run up to 30 % faster so.
        """
        values = (one.of(state) for one in self.followed)
        followed = jnp.stack(jnp.broadcast_arrays(*values, self.heights[0])[:-1])
        heights, across = self.heights, followed.ndim - self.heights.ndim
        heights = heights.reshape(heights.shape[:1] + (1,) * across + heights.shape[1:])
        return jnp.sum(heights * bump(followed, self.centre, self.width), axis=0)

    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:  # noqa: ARG002
        """Return the force or flow."""
        return Action()._replace(**{self.acts: self.sign * self.size(state)})


class HiddenForce(AbstractHiddenInput):
    """A force between plunger and cylinder [N]."""

    heights: Array = parameter("hidden_force", r"F_?", "N", *[fixed(0.0)] * 4, absent=0.0)
    centre: Array = parameter("hidden_force_centre", r"c_F", "1", fixed(0.0))
    width: Array = parameter("hidden_force_width", r"w_F", "1", fixed(1.0))

    name: ClassVar[str] = "hidden-force"
    equation: ClassVar[str] = "plunger-momentum"
    phrase: ClassVar[str] = "hidden force on the plunger"
    at_a_joint: ClassVar[str] = "hidden force"
    followed: ClassVar[tuple[Followed, ...]] = (TIME, PRESSURE, STROKE, SPEED)


class HiddenFlow(AbstractHiddenInput):
    """A flow of oil into the chamber [m^3/s], whatever the valve."""

    heights: Array = parameter("hidden_flow", r"q_?", "m^3/s", *[fixed(0.0)] * 4, absent=0.0)
    centre: Array = parameter("hidden_flow_centre", r"c_q", "1", fixed(0.0))
    width: Array = parameter("hidden_flow_width", r"w_q", "1", fixed(1.0))

    name: ClassVar[str] = "hidden-flow"
    equation: ClassVar[str] = "oil-balance"
    phrase: ClassVar[str] = "hidden flow into the chamber"
    at_a_joint: ClassVar[str] = "hidden flow into the oil"
    followed: ClassVar[tuple[Followed, ...]] = (TIME, PRESSURE, STROKE, SPEED)
    kinds: ClassVar[tuple[str, ...] | None] = ("slow", "release")
    acts: ClassVar[str] = "leakage"
    sign: ClassVar[float] = -1.0


class HiddenDrag(AbstractHiddenInput):
    """A force from outside on the cylinder [N] that the load cell does not read."""

    heights: Array = parameter("hidden_drag", r"F_{\mathrm{HC}?}", "N", *[fixed(0.0)] * 2,
                               absent=0.0)  # fmt: skip
    centre: Array = parameter("hidden_drag_centre", r"c_d", "1", fixed(0.0))
    width: Array = parameter("hidden_drag_width", r"w_d", "1", fixed(1.0))

    name: ClassVar[str] = "hidden-drag"
    equation: ClassVar[str] = "cylinder-momentum"
    phrase: ClassVar[str] = "hidden force on the cylinder"
    at_a_joint: ClassVar[str] = "hidden force on what is behind"
    followed: ClassVar[tuple[Followed, ...]] = (TIME, CYLINDER_SPEED)
    kinds: ClassVar[tuple[str, ...] | None] = ("slow", "release")
    acts: ClassVar[str] = "on_cylinder"


class HiddenSpring(AbstractHiddenInput):
    """A force of the load-cell end on the cylinder [N] that the load cell reads."""

    heights: Array = parameter("hidden_spring", r"F_{\mathrm{LC}?}", "N", *[fixed(0.0)] * 2,
                               absent=0.0)  # fmt: skip
    centre: Array = parameter("hidden_spring_centre", r"c_k", "1", fixed(0.0))
    width: Array = parameter("hidden_spring_width", r"w_k", "1", fixed(1.0))

    name: ClassVar[str] = "hidden-spring"
    equation: ClassVar[str] = "load-cell"
    phrase: ClassVar[str] = "hidden force of the load-cell end"
    at_a_joint: ClassVar[str] = "hidden force of the load cell"
    followed: ClassVar[tuple[Followed, ...]] = (TIME, LOAD)
    kinds: ClassVar[tuple[str, ...] | None] = ("slow", "release")
    acts: ClassVar[str] = "load_cell"


HIDDEN: tuple[type[AbstractHiddenInput], ...] = (
    HiddenForce,
    HiddenDrag,
    HiddenFlow,
    HiddenSpring,
)


def at_joint(effect: type[AbstractHiddenInput], joint: str) -> type[AbstractHiddenInput]:
    """Return a hidden force or flow as it acts at a joint of a machine; "" for the rig."""
    return cast(type[AbstractHiddenInput], placed(effect, joint)) if joint else effect


def hidden_of(problem: Problem) -> tuple[type[AbstractHiddenInput], ...]:
    """Return what may be hidden from a problem: in the rig, or at the joints of a machine."""
    if not problem.places:
        return HIDDEN
    return tuple(at_joint(effect, joint) for effect, joint, _ in at_joints(problem))


def at_joints(
    problem: Problem,
) -> Iterator[tuple[type[AbstractHiddenInput], str, tuple[Followed, ...]]]:
    """Yield hidden forces and flows with the joint at which each is looked for, and over what.

    A force between two ends is the same at all joints between them, unless it goes with the
    pressure of the oil there; one on the end behind is left out where a joint to the ground has it.
    """
    places = problem.places
    ways = [place.way for place in places]
    cells = {effect.place for effect in problem.effects if effect.equation == LOAD_CELL}
    for number, place in enumerate(places):
        if place.way not in ways[:number]:
            yield HiddenForce, place.name, HiddenForce.followed
        elif place.oil:
            yield HiddenForce, place.name, (PRESSURE,)
        if place.oil:
            yield HiddenFlow, place.name, HiddenFlow.followed
        others = [*ways, *(one.way_behind for one in places[:number])]
        if any(place.behind) and place.way_behind not in others:
            yield HiddenDrag, place.name, HiddenDrag.followed
        if place.name in cells:
            yield HiddenSpring, place.name, HiddenSpring.followed

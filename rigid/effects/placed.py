"""Effects of another machine: the same physics, its numbers of other sizes, or those of a joint."""

import dataclasses
import math
from collections.abc import Iterable, Iterator
from functools import cache
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from rigid.effects.base import PLUNGER, AbstractEffect, State
from rigid.effects.declare import ParameterInfo, PriorDescription
from rigid.io.structure import MADE
from rigid.kinds import KINDS

MACHINE = "machine"
"""The trait of records of a machine that a spec puts together."""


class Scales(NamedTuple):
    """What is usual in a machine: force [N], stroke [m], speed [m/s] and pressure [Pa]."""

    force: float
    stroke: float
    speed: float
    pressure: float


RIG = Scales(force=6e4, stroke=0.2, speed=0.025, pressure=136e5)
"""Of the rig that the catalogue's priors are sized for: a frame's load, a free run's travel."""

POWERS = {
    "N": (1, 0, 0, 0),
    "N/m": (1, -1, 0, 0),
    "N/m^2": (1, -2, 0, 0),
    "N/m^3": (1, -3, 0, 0),
    "N/s": (1, -1, 1, 0),
    "N s/m": (1, 0, -1, 0),
    "m": (0, 1, 0, 0),
    "m/s": (0, 0, 1, 0),
    "m^2": (1, 0, 0, -1),
    "m^3/(s Pa)": (1, 0, 1, -2),
    "Pa s/m^3": (-1, 0, -1, 2),
}
"""By unit, how a number goes with force, stroke, speed and pressure. What is not here is the same
in every machine: moduli of oil, shares, times of sensors and of friction with memory."""

UNSCALED = "factor"
"""Argument of a prior that is a share."""

IN_OIL = ("oil-balance", "pump")
"""Equations that a joint has where there is oil."""

ANYWHERE = (PLUNGER, "cylinder-momentum", "load-cell", "sensor")
"""Equations that every joint has."""


def placed(
    effect: type[AbstractEffect],
    place: str,
    shared: frozenset[str] = frozenset(),
    usual: Scales = RIG,
) -> type[AbstractEffect]:
    """Return an effect as it acts at a joint of a machine; one class for the same arguments.

    - `shared`: names of numbers that are the same at all joints; others are the joint's own.
    - `usual`: in this machine, which the catalogue's priors go with.
    """
    return _placed(effect, place, shared, usual)


@cache
def _placed(
    effect: type[AbstractEffect], place: str, shared: frozenset[str], usual: Scales
) -> type[AbstractEffect]:
    infos = tuple(
        dataclasses.replace(info, place="" if info.name in shared else place)
        for info in _sized(effect, usual)
    )

    def parameters(_: type[AbstractEffect]) -> tuple[ParameterInfo, ...]:
        return infos

    def acts_in(_: type[AbstractEffect], kind: str) -> bool:
        return MACHINE in KINDS[kind].traits()

    labels = {info.name: info.labels[0] for info in infos}
    own: dict[str, Any] = {
        "__module__": effect.__module__,
        "__doc__": effect.__doc__,
        MADE: (_placed, (effect, place, shared, usual)),
        "name": f"{effect.name} at {place}",
        "place": place,
        "origin": effect,
        "threshold": None if effect.threshold is None else labels[effect.threshold],
        "parameters": classmethod(parameters),
        "acts_in": classmethod(acts_in),
    }
    made: Any = type(effect)  # what makes such classes
    return made(effect.__name__, (effect,), own)


def sized(effect: type[AbstractEffect], usual: Scales) -> type[AbstractEffect]:
    """Return an effect whose priors go with what is usual; one class for the same arguments."""
    return effect if usual == RIG else _resized(effect, usual)


@cache
def _resized(effect: type[AbstractEffect], usual: Scales) -> type[AbstractEffect]:
    infos = tuple(_sized(effect, usual))

    def parameters(_: type[AbstractEffect]) -> tuple[ParameterInfo, ...]:
        return infos

    own: dict[str, Any] = {
        "__module__": effect.__module__,
        "__doc__": effect.__doc__,
        MADE: (_resized, (effect, usual)),
        "origin": effect,
        "parameters": classmethod(parameters),
    }
    made: Any = type(effect)  # what makes such classes
    return made(effect.__name__, (effect,), own)


def _sized(effect: type[AbstractEffect], usual: Scales) -> Iterator[ParameterInfo]:
    """Numbers of an effect, their priors for a machine of other sizes than the rig."""
    for info in effect.parameters():
        priors = tuple(_scaled(prior, info.unit, usual) for prior in info.priors)
        yield dataclasses.replace(info, priors=priors) if info.sized else info


def _scaled(prior: PriorDescription, unit: str, usual: Scales) -> PriorDescription:
    """Return a prior for a machine of other sizes than the rig."""
    powers = POWERS.get(unit, (0, 0, 0, 0))
    times = math.prod((a / b) ** p for a, b, p in zip(usual, RIG, powers, strict=True))
    scaled = {k: v if k == UNSCALED else times * v for k, v in prior.arguments.items()}
    return PriorDescription(prior.law, scaled)


def origin(effect: type[AbstractEffect]) -> type[AbstractEffect]:
    """Return what an effect is, wherever it acts."""
    return getattr(effect, "origin", effect)


@cache
def answers_to_pressure(effect: type[AbstractEffect]) -> bool:
    """Whether what an effect pushes changes with the oil pressure."""
    one = jnp.ones(())
    built = effect.build({label: one for label in effect.labels()})
    own = tuple(one for _ in effect.scales)

    def push(pressure: Array) -> tuple[Array, ...]:
        still = 0.0 * one
        state = State(still, still, one, one, pressure, one, area=one)
        action = built(state, own)
        return tuple(jnp.asarray(a) for a in (action.between, action.on_plunger, *action.rates))

    slopes = jax.jvp(push, (one,), (one,))[1]
    return any(float(slope) != 0.0 for slope in slopes)


def cannot_act(effect: type[AbstractEffect], oil: bool) -> str:
    """Return why an effect cannot act at a joint, in a clause; empty where it can.

    - `oil`: whether there is oil at the joint.
    """
    if effect.equation in IN_OIL and not oil:
        return f"is of the {effect.equation}, and there is no oil at this joint"
    if effect.kinds is not None and not KINDS["run"].traits() & set(effect.kinds):
        return f"acts in records of kind {' or '.join(effect.kinds)} alone"
    if effect.equation not in (*ANYWHERE, *IN_OIL):
        return f"is of the {effect.equation}, which a machine has not"
    if effect.delays is not AbstractEffect.delays:
        return "delays time stamps, which runs cannot have yet"
    if effect.beat is not None:
        return "beats with the rig's pump"
    return ""


def those_at(
    effects: Iterable[type[AbstractEffect]], place: str
) -> tuple[type[AbstractEffect], ...]:
    """Return the effects that act at a joint."""
    return tuple(e for e in effects if e.place == place)

"""A machine of bodies and joints: Newton's law for each body, a balance of oil at each joint.

A joint lies between two bodies, or a body and the ground. What acts there sees it as the rig: the
body behind it is the cylinder, the body ahead the plunger, and the oil between pushes them apart.
So every effect of the catalogue acts at a joint as it does in the rig, eqs. (2)-(13), and the rig
itself is one joint. A chamber on the rod side is a joint with its ends the other way round.

Bodies move along one axis, and where they have moments of inertia they tilt about two others, by
angles so small that a place (x, y) of a body moves by z + y tilt_x - x tilt_y. All counts from the
machine at rest, under its own weight.

A flat state is (n, ...): coordinates, their rates, pressures where there is oil, then the effects'
own states, joint by joint. Later axes broadcast over runs and walkers.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jax import Array

from rigid.effects.base import AbstractEffect, Action, Distortion, Seen, State

LENGTH, ANGLE, SPEED, PRESSURE = 1e-4, 1e-4, 1e-2, 1e5
"""Typical sizes of a state [m, rad, m/s or rad/s, Pa], in which the reference measures errors."""

LOAD_CELL = "load-cell"


class Drive(NamedTuple):
    """What is done to a machine at an instant, from outside.

    - `flow` (joints, ...) [-]: what each valve passes. - `force` (joints, ...) [N]: on the body
      ahead of each joint. - `time` [s]: since the run began. - `apart` (joints, ...) [N]: pushes
      the ends of each joint apart; None: nothing does.
    """

    flow: Array
    force: Array
    time: Array | float
    apart: Array | None = None


class Joint(eqx.Module):
    """What lies between two bodies.

    - `behind`, `ahead`: by how much either end moves for each coordinate. - `area` [m^2],
      `column` [m]: of the oil at rest; None where there is none. - `effects`: what acts here.
    """

    behind: tuple[float, ...] = eqx.field(static=True)
    ahead: tuple[float, ...] = eqx.field(static=True)
    area: Array | None
    column: Array | None
    effects: tuple[AbstractEffect, ...]

    @property
    def states(self) -> int:
        """How many states of their own the effects here have."""
        return sum(len(effect.scales) for effect in self.effects)

    @property
    def has_load_cell(self) -> bool:
        """Whether an effect here gives way behind the body behind."""
        return any(effect.equation == LOAD_CELL for effect in self.effects)


class Reading(NamedTuple):
    """What ideal sensors read at each joint, (joints, ...).

    - `load` [N]: in the load cell behind the joint; where there is none, what pushes the ends
      apart. - `stroke` [m]: of the body ahead over the one behind. - `pressure` [Pa]: of the oil,
      0 where there is none. - `acceleration` [m/s^2], `position` [m]: of the body ahead.
    """

    load: Array
    stroke: Array
    pressure: Array
    acceleration: Array
    position: Array


class _Push(NamedTuple):
    """What happens at one joint: on which ends it pushes, how its oil fills, what is seen."""

    behind: Array
    ahead: Array
    filling: Array | None
    load: Array | float
    own: tuple[Array, ...]
    distortion: Distortion


class Machine(eqx.Module):
    """Bodies and joints.

    - `inertias`: mass [kg] or moment of inertia [kg m^2] of each coordinate.
    """

    inertias: tuple[Array, ...]
    joints: tuple[Joint, ...]
    tilts: tuple[bool, ...] = eqx.field(static=True)

    @property
    def scales(self) -> tuple[float, ...]:
        """Typical size of each entry of the flat state."""
        places = tuple(ANGLE if tilt else LENGTH for tilt in self.tilts)
        oil = tuple(PRESSURE for joint in self.joints if joint.area is not None)
        own = tuple(s for joint in self.joints for e in joint.effects for s in e.scales)
        return (*places, *(SPEED for _ in self.tilts), *oil, *own)

    def rates(self, flat: Array, drive: Drive) -> Array:
        """Rates (n, ...) of a flat state (n, ...)."""
        return self._moved(flat, drive)[0]

    def read(self, flat: Array, drive: Drive) -> Reading:
        """What ideal sensors read of a flat state (n, ...)."""
        rates, pushes, pressures = self._moved(flat, drive)
        count, none = len(self.tilts), jnp.zeros_like(flat[0])
        columns = []
        for joint, push, pressure in zip(self.joints, pushes, pressures, strict=True):
            ahead = _along(joint.ahead, flat[:count])
            beside = push.distortion
            columns.append((
                push.load + beside.load,
                ahead - _along(joint.behind, flat[:count]) + beside.stroke,
                pressure + beside.pressure,
                _along(joint.ahead, rates[count : 2 * count]) + beside.acceleration,
                ahead,
            ))  # fmt: skip
        rows = zip(*columns, strict=True)
        return Reading(*(jnp.stack([one + none for one in row]) for row in rows))

    def _moved(self, flat: Array, drive: Drive) -> tuple[Array, list[_Push], list[Array]]:
        """Rates, what happens at each joint, and the pressure there."""
        count = len(self.tilts)
        at, speeds = flat[:count], flat[count : 2 * count]
        place, oil = 2 * count, iter(range(2 * count, flat.shape[0]))
        pressures = [flat[next(oil)] if j.area is not None else 0.0 * flat[0] for j in self.joints]
        place += sum(joint.area is not None for joint in self.joints)
        pushes, forces = [], [jnp.zeros_like(flat[0]) for _ in range(count)]
        for number, joint in enumerate(self.joints):
            own = flat[place : place + joint.states]
            place += joint.states
            push = self._push(number, joint, (at, speeds, pressures[number], own), drive)
            pushes.append(push)
            for i in range(count):
                forces[i] = forces[i] + joint.behind[i] * push.behind + joint.ahead[i] * push.ahead
        turned = [force / inertia for force, inertia in zip(forces, self.inertias, strict=True)]
        filled = [push.filling for push in pushes if push.filling is not None]
        moved = [*speeds, *turned, *filled, *(rate for push in pushes for rate in push.own)]
        none = jnp.zeros_like(flat[0])
        return jnp.stack([rate + none for rate in moved]), pushes, pressures

    def _push(
        self, number: int, joint: Joint, now: tuple[Array, Array, Array, Array], drive: Drive
    ) -> _Push:
        """What happens at one joint; `now`: coordinates, their rates, pressure, own states."""
        at, speeds, pressure, flat = now
        parted, place = [], 0
        for effect in joint.effects:
            parted.append(tuple(flat[place + i] for i in range(len(effect.scales))))
            place += len(effect.scales)
        roots = [e.root(own) for e, own in zip(joint.effects, parted, strict=True)]
        root = next((r for r in roots if r is not None), (0.0, 0.0))
        behind, ahead = _along(joint.behind, at), _along(joint.ahead, at)
        column = 0.0 if joint.column is None else joint.column
        state = State(
            x_cylinder=behind,
            v_cylinder=_along(joint.behind, speeds),
            x_plunger=ahead,
            v_plunger=_along(joint.ahead, speeds),
            pressure=pressure,
            column=column + ahead - behind,
            x_root=root[0],
            v_root=root[1],
            area=0.0 if joint.area is None else joint.area,
            flow_fraction=drive.flow[number],
            time=drive.time,
        )
        actions = [e(state, own) for e, own in zip(joint.effects, parted, strict=True)]
        held = sum((a.load_cell for a in actions), start=0.0)
        apart = state.area * pressure + sum((a.between for a in actions), start=0.0)
        apart = apart if drive.apart is None else apart + drive.apart[number]
        inflow = drive.flow[number] * sum((a.inflow for a in actions), start=0.0)
        seen = [Seen(state, own, held if joint.has_load_cell else apart, inflow) for own in parted]
        told = list(zip(joint.effects, actions, seen, strict=True))
        sensed = [effect.sense(s) for effect, _, s in told]
        return _Push(
            behind=held + sum((a.on_cylinder for a in actions), start=0.0) - apart,
            ahead=apart + sum((a.on_plunger for a in actions), start=0.0) + drive.force[number],
            filling=None if joint.area is None else _filling(actions, state, inflow),
            load=held if joint.has_load_cell else apart,
            own=tuple(rate for effect, action, s in told for rate in effect.rates(action, s)),
            distortion=Distortion(*(sum(p) for p in zip(*sensed, strict=True)))
            if sensed
            else Distortion(),
        )


def _filling(actions: Sequence[Action], state: State, inflow: Array | float) -> Array:
    """Rate of the pressure [Pa/s], eq. (21): what flows in, less what the moving ends make room."""
    compliance = state.area * state.column * sum((a.compliance for a in actions), start=0.0)
    return (
        inflow - sum((a.leakage for a in actions), start=0.0) - state.area * state.slip
    ) / compliance


def _along(row: tuple[float, ...], coordinates: Array) -> Array:
    """How far an end has moved; `coordinates` (count, ...)."""
    moved = [share * one for share, one in zip(row, coordinates, strict=True) if share]
    return sum(moved, jnp.zeros_like(coordinates[0]))


def jacobian(rates: Callable[[Array], Array], flat: Array) -> Array:
    """Derivatives (n, n, ...) of rates, which the first axis counts, by a flat state (n, ...)."""
    size, later = flat.shape[0], (1,) * (flat.ndim - 1)

    def column(direction: Array) -> Array:
        along = jnp.broadcast_to(direction.reshape(size, *later), flat.shape)
        return jax.jvp(rates, (flat,), (along,))[1]

    return jax.vmap(column, out_axes=1)(jnp.eye(size))

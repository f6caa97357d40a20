"""Masses and effects put together: the equations of motion of one cylinder, eqs. (2)-(13)."""

from collections.abc import Mapping
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jax import Array

from rigid.effects.base import (
    AbstractEffect,
    Action,
    Distortion,
    Seen,
    State,
    Strap,
    delays_of,
)

CORE_SCALES = (1e-4, 1e-1, 1e-4, 1e-1, 1e6)
"""Typical size of x_HC [m], v_HC [m/s], x_Pl [m], v_Pl [m/s] and p [Pa] in this rig."""


class Surroundings(NamedTuple):
    """What the rig meets outside itself.

    - `contact_stiffness` [N/m]: of a frame in its way, 0 where the plate is free.
    - `force` [N]: on the plate, positive toward the ice (a compressive load is negative).
    - `flow_fraction` [-]: kappa, what the valve passes of the pump's flow; negative to the tank.
    - `time` [s]: since the record began, or since the release.
    - `pump_angle` [rad]: by which the pump's beat was ahead then.
    - `between` [N]: pushes plunger and cylinder apart beside what the effects do.
    """

    contact_stiffness: Array | float = 0.0
    force: Array | float = 0.0
    flow_fraction: Array | float = 0.0
    time: Array | float = 0.0
    pump_angle: Array | float = 0.0
    between: Array | float = 0.0


FREE = Surroundings()
"""Nothing in the way and the valve shut."""


class Motion(NamedTuple):
    """How the rig moves on from a state.

    - `rates`: of the flat state. - `load` [N]: in the load-cell end.
    - `distortion`: what the sensors read beside the truth.
    """

    rates: tuple[Array, ...]
    load: Array | float
    distortion: Distortion

    @property
    def plunger_acceleration(self) -> Array:
        """Acceleration of plunger and plate [m/s^2]."""
        return self.rates[3]


class Rig(eqx.Module):
    """One cylinder with its plunger and half of the indentation plate.

    - `cylinder_mass`: M_HC - M_Pl [kg], as eq. (2) has it.
    - `plunger_mass`: M_Pl + M_Fl/2 [kg], as eq. (3) has it.
    - `area`: S_Pl [m^2].
    - `column`: L_0, the oil column at zero stroke [m].
    - `effects`: what acts on the rig.
    """

    cylinder_mass: Array
    plunger_mass: Array
    area: Array
    column: Array
    effects: tuple[AbstractEffect, ...]

    @property
    def scales(self) -> tuple[float, ...]:
        """Typical size of each entry of the flat state."""
        return CORE_SCALES + tuple(s for e in self.effects for s in e.scales)

    @property
    def steady(self) -> bool:
        """Whether step matrices made at rest serve everywhere (see `AbstractEffect`)."""
        return all(effect.steady for effect in self.effects)

    def own(self, flat: Array | tuple) -> list[tuple[Array, ...]]:
        """Part the effects' own states from a flat state, one tuple an effect."""
        out, at = [], len(CORE_SCALES)
        for effect in self.effects:
            out.append(tuple(flat[at + i] for i in range(len(effect.scales))))
            at += len(effect.scales)
        return out

    def state(
        self,
        flat: Array | tuple,
        column: Array | None = None,
        outside: Surroundings = FREE,
    ) -> State:
        """Unpack a flat state; `column` [m] freezes the oil column there."""
        x_hc, v_hc, x_pl, v_pl, pressure = (flat[i] for i in range(5))
        if column is None:
            column = self.column + x_pl - x_hc
        roots = [e.root(own) for e, own in zip(self.effects, self.own(flat), strict=True)]
        x_root, v_root = next((r for r in roots if r is not None), (0.0, 0.0))
        return State(
            x_hc, v_hc, x_pl, v_pl, pressure, column, x_root, v_root, self.area,
            outside.contact_stiffness, outside.flow_fraction, outside.time, outside.pump_angle,
        )  # fmt: skip

    def actions(self, flat: Array | tuple, state: State) -> list[Action]:
        """Return what each effect does."""
        return [e(state, own) for e, own in zip(self.effects, self.own(flat), strict=True)]

    @eqx.filter_jit
    def motion(
        self, flat: Array | tuple, outside: Surroundings, column: Array | None = None
    ) -> Motion:
        """Return the rates of a flat state, eqs. (2), (3), (7), (21) with signs put right.

        - `flat`: x_HC, v_HC, x_Pl, v_Pl, p, then the effects' own states; any trailing shape.
        - `outside`: frame, force and valve.
        - `column` [m]: freezes the oil column; left out, it follows the stroke.
        """
        state = self.state(flat, column, outside)
        actions = self.actions(flat, state)
        inflow, compliance = self._oil(actions, state)
        between = self.area * state.pressure + outside.between + sum(a.between for a in actions)
        load = sum(a.load_cell for a in actions)
        external = (
            outside.force
            - outside.contact_stiffness * state.x_plunger
            + sum(a.on_plunger for a in actions)
        )
        held = load + sum(a.on_cylinder for a in actions)
        filling = inflow - sum(a.leakage for a in actions)
        rates = (
            state.v_cylinder,
            (held - between) / self.cylinder_mass,
            state.v_plunger,
            (between + external) / self.plunger_mass,
            (filling - self.area * state.slip) / compliance,
        )
        seen = [Seen(state, own, load, inflow, rates[3]) for own in self.own(flat)]
        told = list(zip(self.effects, actions, seen, strict=True))
        distortions = [effect.sense(s) for effect, _, s in told]
        return Motion(
            rates + tuple(r for effect, action, s in told for r in effect.rates(action, s)),
            load,
            Distortion(*(sum(parts) for parts in zip(*distortions, strict=True))),
        )

    @eqx.filter_jit
    def flow(self, flat: Array | tuple, outside: Surroundings, column: Array) -> Array:
        """Return what the oil that the valve passes adds to the rate of pressure [Pa/s]."""
        state = self.state(flat, column, outside)
        inflow, compliance = self._oil(self.actions(flat, state), state)
        return inflow / compliance

    def yielding(self, flat: Array | tuple, outside: Surroundings, column: Array) -> Array:
        """Return the oil that a pascal more takes in [m^3/Pa]."""
        state = self.state(flat, column, outside)
        return self._oil(self.actions(flat, state), state)[1]

    def _oil(self, actions: list[Action], state: State) -> tuple[Array | float, Array]:
        """Flow that the valve passes [m^3/s], and oil that a pascal more takes in [m^3/Pa]."""
        inflow = state.flow_fraction * sum(a.inflow for a in actions)
        return inflow, self.area * state.column * sum(a.compliance for a in actions)

    def delays(self) -> dict[str, Array]:
        """By how much [s] the time stamps of each quantity lag, for those that do."""
        return delays_of(self.effects)

    def strap(self) -> Strap | None:
        """How straps let go, by the first effect that says so; None: at once."""
        return next((law for e in self.effects if (law := e.strap()) is not None), None)

    def averaging(self) -> tuple[Array, Array] | None:
        """Share of a reading that is a mean, over what part of a sampling interval; None: none."""
        means = (effect.averaging() for effect in self.effects)
        return next((mean for mean in means if mean is not None), None)

    def friction(self, omega: Array) -> Array:
        """Complex friction coefficient mu(omega) of all effects together [N s/m]."""
        return friction_of(self.effects, omega)


def friction_of(effects: tuple[AbstractEffect, ...], omega: Array) -> Array:
    """Complex friction coefficient mu(omega) of effects together [N s/m]; a rig need not be."""
    none = jnp.zeros_like(omega, dtype=complex)
    return sum((effect.friction(omega) for effect in effects), start=none)


def build_rig(
    effects: tuple[type[AbstractEffect], ...], values: Mapping[str, Array | float]
) -> Rig:
    """Make a rig from flat values: masses `M_HC`, `M_Pl`, `M_Fl`, `S_Pl`, `L_0` and the effects'.

    Values may carry a trailing axis (walkers) as long as all broadcast.
    """
    return Rig(
        cylinder_mass=jnp.asarray(values["M_HC"] - values["M_Pl"]),
        plunger_mass=jnp.asarray(values["M_Pl"] + 0.5 * values["M_Fl"]),
        area=jnp.asarray(values["S_Pl"]),
        column=jnp.asarray(values["L_0"]),
        effects=tuple(effect.build(values) for effect in effects),
    )


def acting(
    effects: tuple[type[AbstractEffect], ...], kind: str
) -> tuple[type[AbstractEffect], ...]:
    """Return the effects that act in records of a kind."""
    return tuple(e for e in effects if e.acts_in(kind))

"""A machine of a spec as a smoother sees it: loads at some joints, flows at others."""

from collections.abc import Collection, Mapping, Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.effects import AbstractEffect
from rigid.effects.placed import those_at
from rigid.likelihood.machine import Layout
from rigid.physics.machine import Drive, Machine
from rigid.smoothing.field import Setup
from rigid.smoothing.inputs import Inputs
from rigid.smoothing.plant import AbstractPlant, Rough


class At(eqx.Module):
    """At which joints, by number, what drives a machine drives it, and where it is read.

    - `loads`, `flows`, `forces`, `commands`: joints. `forces` and `commands` also say which of what
      was recorded they are. - `channels`: quantity and joint, or RECORDED and which of them.
    - `oil`: of each flow, the entry of the state that is the pressure there.
    """

    loads: tuple[int, ...] = eqx.field(static=True)
    flows: tuple[int, ...] = eqx.field(static=True)
    forces: tuple[tuple[int, int], ...] = eqx.field(static=True)
    commands: tuple[tuple[int, int], ...] = eqx.field(static=True)
    channels: tuple[tuple[str, int], ...] = eqx.field(static=True)
    oil: tuple[int, ...] = eqx.field(static=True)


class MachinePlant(AbstractPlant):
    """One draw of a machine.

    - `passes` (commands,): what each valve passes at a command of 1.
    """

    machine: Machine
    passes: Array
    inputs: Inputs = eqx.field(static=True)
    at: At

    @property
    def scales(self) -> tuple[float, ...]:
        """As the machine's."""
        return self.machine.scales

    @property
    def balanced(self) -> tuple[int, ...]:
        """Pressures where flows are sought."""
        return self.at.oil

    def point(self, at: Rough) -> Array:
        """Return bodies and oil where they are on the path; what effects add is at rest."""
        told = jnp.concatenate([at.place, at.speed, at.pressure])
        return jnp.concatenate([told, jnp.zeros(len(self.scales) - len(told))])

    def rates(self, flat: Array, straight: Array, flows: Array) -> Array:
        """Return the rates of a flat state (n,)."""
        return self.machine.rates(flat, self._drive(straight, flows))

    def read(self, flat: Array, straight: Array, flows: Array) -> Array:
        """Return what sensors read, and what was recorded as it is."""
        read, loads = self.machine.read(flat, self._drive(straight, flows)), len(self.at.loads)
        return jnp.stack([
            straight[loads + which] if quantity == RECORDED else getattr(read, quantity)[which]
            for quantity, which in self.at.channels
        ])  # fmt: skip

    def displaced(self, flat: Array) -> Array:
        """Return by how much the ends of each joint under a load have come closer."""
        joints = [self.machine.joints[number] for number in self.at.loads]
        rows = jnp.array([np.subtract(j.behind, j.ahead) for j in joints])
        return rows @ flat[: rows.shape[1]]

    def _drive(self, straight: Array, flows: Array) -> Drive:
        """What is done from outside."""
        none, loads = jnp.zeros(len(self.machine.joints)), len(self.at.loads)
        flow, force = none.at[jnp.asarray(self.at.flows, int)].set(flows), none
        for number, (which, joint) in enumerate(self.at.commands):
            flow = flow.at[joint].set(self.passes[number] * straight[loads + which])
        for which, joint in self.at.forces:
            force = force.at[joint].set(straight[loads + which])
        apart = none.at[jnp.asarray(self.at.loads, int)].set(straight[:loads])
        return Drive(flow, force, 0.0, apart)


RECORDED = "recorded"
"""Stands for the quantity of a channel that was recorded, not read."""


def _at(layout: Layout, setup: Setup) -> At:
    """Number the joints of a setup."""
    inputs, names = setup.inputs, [place.name for place in layout.places]
    oil = [place.name for place in layout.places if place.oil]
    first = 2 * len(layout.coordinates)

    def done(quantity: str) -> tuple[tuple[int, int], ...]:
        return tuple(
            (which, names.index(one.place))
            for which, one in enumerate(inputs.recorded)
            if one.quantity == quantity
        )

    channels = [
        (RECORDED, setup.recorded.index(number))
        if number in setup.recorded
        else (one.quantity, names.index(one.place))
        for number, one in enumerate(setup.channels)
    ]
    return At(
        loads=tuple(names.index(name) for name in inputs.loads),
        flows=tuple(names.index(name) for name in inputs.flows),
        forces=done("force"),
        commands=done("command"),
        channels=tuple(channels),
        oil=tuple(first + oil.index(name) for name in inputs.flows),
    )


def acting(
    effects: Sequence[type[AbstractEffect]], layout: Layout, setup: Setup
) -> tuple[type[AbstractEffect], ...]:
    """Return what acts in a test: all but what stands in the spec where a load is sought."""
    here = (p.name for p in layout.places if p.name not in setup.inputs.loads)
    return tuple(effect for name in here for effect in those_at(effects, name))


def numbers(effects: Sequence[type[AbstractEffect]], layout: Layout) -> tuple[str, ...]:
    """Labels of the numbers that a machine is made of."""
    oil = [place.name for place in layout.places if place.oil]
    return (
        *(one.inertia for one in layout.coordinates),
        *(f"{name}[{place}]" for place in oil for name in ("area", "column")),
        *dict.fromkeys(label for effect in effects for label in effect.labels()),
    )


def passed(known: Collection[str], setup: Setup) -> tuple[str, ...]:
    """Labels of what valves pass at a command of 1, those that a posterior knows."""
    commands = (one.place for one in setup.inputs.recorded if one.quantity == "command")
    return tuple(label for place in commands if (label := f"kappa[{place}]") in known)


def plants(
    layout: Layout,
    effects: Sequence[type[AbstractEffect]],
    setup: Setup,
    values: Mapping[str, Array],
    size: int,
) -> MachinePlant:
    """Return draws of a machine on the last axis.

    - `effects`: that act in the test. - `values` (size,) by label.
    """
    commands = [one.place for one in setup.inputs.recorded if one.quantity == "command"]
    passes = [values.get(f"kappa[{place}]", jnp.ones(size)) for place in commands]
    return MachinePlant(
        machine=layout.build(effects, values),
        passes=jnp.stack(passes) if passes else jnp.zeros((0, size)),
        inputs=setup.inputs,
        at=_at(layout, setup),
    )

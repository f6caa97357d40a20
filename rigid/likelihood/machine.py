"""How a machine of a spec is put together: its coordinates, its joints, what acts at them."""

import dataclasses
from collections.abc import Iterable, Iterator, Mapping, Sequence

import jax.numpy as jnp
from jax import Array

from rigid.effects import CATALOGUE, AbstractEffect
from rigid.effects.base import PLUNGER
from rigid.effects.placed import RIG, Scales, answers_to_pressure, cannot_act, placed, those_at
from rigid.io.errors import InputError
from rigid.physics.machine import Joint, Machine
from rigid.spec.base import Known
from rigid.spec.machine import MachineSpec


@dataclasses.dataclass(frozen=True)
class Coordinate:
    """One way in which a body moves: along the axis, or a tilt about `axis` "x" or "y"."""

    body: str
    axis: str = ""

    @property
    def name(self) -> str:
        """In labels: the body, or "plate tilt x"."""
        return f"{self.body} tilt {self.axis}" if self.axis else self.body

    @property
    def inertia(self) -> str:
        """Label of its mass or moment of inertia."""
        return f"inertia_{self.axis}[{self.body}]" if self.axis else f"mass[{self.body}]"

    def share(self, body: str, at: tuple[float, float]) -> float:
        """By how much a place x, y of a body moves along the axis for it."""
        if body != self.body:
            return 0.0
        return {"": 1.0, "x": at[1], "y": -at[0]}[self.axis]


Way = frozenset[tuple[float, ...]]
"""How something moves with the coordinates, one direction or the other taken for positive."""


def either_way(moved: Iterable[float]) -> Way:
    """Return the way of what moves so much for each coordinate."""
    once = tuple(moved)
    return frozenset((once, tuple(-one for one in once)))


@dataclasses.dataclass(frozen=True)
class Place:
    """A joint by name: how its ends move with the coordinates, and whether there is oil."""

    name: str
    behind: tuple[float, ...]
    ahead: tuple[float, ...]
    oil: bool

    @property
    def way(self) -> Way:
        """How its ends move apart with the coordinates, one end or the other taken for ahead."""
        return either_way(a - b for a, b in zip(self.ahead, self.behind, strict=True))

    @property
    def way_behind(self) -> Way:
        """How its end behind moves, over the ground."""
        return either_way(self.behind)


@dataclasses.dataclass(frozen=True)
class Layout:
    """How a machine is put together, without a number.

    - `steps`: that a march takes between two samples.
    """

    coordinates: tuple[Coordinate, ...]
    places: tuple[Place, ...]
    steps: int = 1

    def build(
        self, effects: Sequence[type[AbstractEffect]], values: Mapping[str, Array]
    ) -> Machine:
        """Return the machine of values by label, (walkers,) each."""
        joints = []
        for place in self.places:
            area, column = (
                jnp.asarray(values[f"{name}[{place.name}]"]) if place.oil else None
                for name in ("area", "column")
            )
            acting = tuple(e.build(values) for e in those_at(effects, place.name))
            joints.append(Joint(place.behind, place.ahead, area, column, acting))
        return Machine(
            tuple(jnp.asarray(values[c.inertia]) for c in self.coordinates),
            tuple(joints),
            tuple(bool(c.axis) for c in self.coordinates),
        )


def lay_out(spec: MachineSpec) -> Layout:
    """Return how a machine is put together."""
    coordinates = []
    for name, body in spec.bodies.items():
        axes = ("",) if body.inertia is None else ("", "x", "y")
        coordinates += [Coordinate(name, axis) for axis in axes]
    places = [
        Place(
            name,
            tuple(c.share(joint.between[0], joint.at) for c in coordinates),
            tuple(c.share(joint.between[1], joint.at) for c in coordinates),
            joint.oil,
        )
        for name, joint in spec.joints.items()
    ]
    return Layout(tuple(coordinates), tuple(places))


def at_joints(
    spec: MachineSpec, chosen: Mapping[str, type[AbstractEffect]], where: str
) -> tuple[type[AbstractEffect], ...]:
    """Return the effects of all joints, each at its own.

    - `chosen`: by the name in the spec. - `where`: heads the message.

    Raises InputError for effects that cannot act where they are named, oil without compliance, and
    shared numbers that nothing has.
    """
    problems, out = [], []
    for name, joint in spec.joints.items():
        here = [chosen[one] for one in joint.effects]
        for effect in here:
            if why := cannot_act(effect, joint.oil):
                problems.append(f"{where} joints {name}: '{effect.name}' {why}; leave it out here")
        if joint.oil and not any(e.equation == "oil-balance" for e in here):
            problems.append(
                f"{where} joints {name}: there is oil, and nothing says how it gives way; add "
                "'oil-compressibility' to its effects"
            )
        out += [placed_in(spec, effect, name) for effect in here]
    known = {info.name for effect in chosen.values() for info in effect.parameters()}
    problems += [
        f"{where} shared: no effect here has a number '{one}'; there are {', '.join(sorted(known))}"
        for one in spec.shared
        if one not in known
    ]
    if problems:
        raise InputError("\n".join(problems))
    return tuple(out)


def placed_in(spec: MachineSpec, effect: type[AbstractEffect], joint: str) -> type[AbstractEffect]:
    """Return an effect at a joint; one of the user's own has its priors as they stand."""
    usual = scales_of(spec) if CATALOGUE.get(effect.name) is effect else RIG
    return placed(effect, joint, frozenset(spec.shared), usual)


def everywhere(
    spec: MachineSpec, effects: Iterable[type[AbstractEffect]]
) -> tuple[type[AbstractEffect], ...]:
    """Return effects at each joint at which they can act and differ from the same elsewhere.

    What pushes two bodies at one place is the same at all joints between them there, unless it goes
    with the oil pressure; it is looked for at the first.
    """
    seen, out = set(), []
    for effect, place in able(spec, effects):
        if effect.equation == PLUNGER and not answers_to_pressure(effect):
            if (effect, place.way) in seen:
                continue
            seen.add((effect, place.way))
        out.append(placed_in(spec, effect, place.name))
    return tuple(out)


def able(
    spec: MachineSpec, effects: Iterable[type[AbstractEffect]]
) -> Iterator[tuple[type[AbstractEffect], Place]]:
    """Effects, each with every joint at which it can act."""
    places = lay_out(spec).places
    for effect in effects:
        yield from ((effect, place) for place in places if not cannot_act(effect, place.oil))


def scales_of(spec: MachineSpec) -> Scales:
    """Return what is usual in a machine."""
    areas = [joint.area.value for joint in spec.joints.values() if joint.area is not None]
    pressure = spec.usual.pressure
    if pressure is None:
        pressure = spec.usual.force / max(areas) if areas else RIG.pressure
    return Scales(spec.usual.force, spec.usual.stroke, spec.usual.speed, pressure)


def constants(spec: MachineSpec) -> Iterator[tuple[str, str, str, str, Known]]:
    """What a machine is made of: body or joint, name, TeX, unit and value."""
    for name, body in spec.bodies.items():
        yield name, "mass", r"M", "kg", body.mass
        for axis, inertia in zip("xy", body.inertia or (), strict=False):
            yield name, f"inertia_{axis}", rf"J_{axis}", "kg m^2", inertia
    for name, joint in spec.joints.items():
        if joint.area is not None:
            yield name, "area", r"S", "m^2", joint.area
        if joint.column is not None:
            yield name, "column", r"L_0", "m", joint.column

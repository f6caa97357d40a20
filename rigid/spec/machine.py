"""A machine that a spec puts together: bodies, and the joints between them."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, model_validator

from rigid.io.errors import quoted
from rigid.kinds import kinds_with
from rigid.spec.base import POSITIVE, Known, Real, Value, uncertain, within
from rigid.spec.record import Name, RecordSpec
from rigid.spec.sentences import unknown

GROUND = "ground"
"""What does not move."""

OF_A_MACHINE = kinds_with("machine")
"""Kinds of records that a machine has."""

SHARE = 0.03
"""Relative sd of a mass or a moment of inertia where a spec states none."""

COLUMN_SHARE = 0.02
"""Of an oil column."""

Mass = Annotated[Known, uncertain(SHARE), POSITIVE, within(1e-6, 1e9, "kg")]
Inertia = Annotated[Known, uncertain(SHARE), POSITIVE, within(1e-9, 1e12, "kg m^2")]


def _two(given: Any) -> Any:
    """Refuse what is no list of two."""
    if not isinstance(given, (list, tuple)) or len(given) != 2:
        raise ValueError(f"must be a list of two, as in [0.4, -0.3]; found {quoted(given)}")
    return given


class BodySpec(Value):
    """One body: its `mass` [kg], and where it may tilt its moments of `inertia` [kg m^2].

    - `inertia`: about the axes x and y through its centre of mass.
    """

    mass: Mass
    inertia: Annotated[tuple[Inertia, Inertia], BeforeValidator(_two)] | None = None


class JointSpec(Value):
    """What lies between two bodies.

    - `between`: the body behind and the body ahead of it; "ground" does not move. - `at` [m]: the
      place x, y in plan, from the centres of mass. - `area` [m^2], `column` [m]: of the oil that
      pushes them apart, where there is oil. - `effects`: what acts here, by name.
    """

    between: Annotated[tuple[Name, Name], BeforeValidator(_two)]
    at: Annotated[tuple[Real, Real], BeforeValidator(_two)] = (0.0, 0.0)
    area: Annotated[Known, uncertain(0.0), POSITIVE, within(1e-8, 10.0, "m^2")] | None = None
    column: Annotated[Known, uncertain(COLUMN_SHARE), POSITIVE, within(1e-4, 100.0, "m")] | None = (
        None
    )
    effects: tuple[str, ...] = ()

    @model_validator(mode="after")
    def consistent(self) -> "JointSpec":
        """Refuse oil without its column, and a joint between a body and itself."""
        says = []
        if (self.area is None) != (self.column is None):
            here, missing = ("area", "column") if self.column is None else ("column", "area")
            says.append(
                f"{here} stands without {missing}; oil between two bodies has both, leave both out "
                "where there is none"
            )
        if self.between[0] == self.between[1]:
            says.append(f"between: both ends are {quoted(self.between[0])}; name two bodies")
        if twice := [name for name in self.effects if self.effects.count(name) > 1]:
            says.append(f"effects: {quoted(twice[0])} stands twice; name it once")
        if says:
            raise ValueError("\n".join(says))
        return self

    @property
    def oil(self) -> bool:
        """Whether there is oil between the bodies."""
        return self.area is not None


class UsualSpec(Value):
    """How large forces [N], strokes [m] and speeds [m/s] usually are in a machine.

    - `pressure` [Pa]: None: the force over the largest area.
    """

    force: Annotated[Real, Field(gt=0.0)]
    stroke: Annotated[Real, Field(gt=0.0)]
    speed: Annotated[Real, Field(gt=0.0)]
    pressure: Annotated[Real, Field(gt=0.0)] | None = None


class MachineSpec(Value):
    """Bodies and joints by name.

    - `usual`: sizes that built-in priors of effects go with.
    - `shared`: numbers of effects that are the same at all joints, such as `k_oil`; others are each
      joint's own.
    """

    bodies: Annotated[Mapping[Name, BodySpec], Field(min_length=1)]
    joints: Annotated[Mapping[Name, JointSpec], Field(min_length=1)]
    usual: UsualSpec
    shared: tuple[str, ...] = ()

    @model_validator(mode="after")
    def consistent(self) -> "MachineSpec":
        """Refuse joints of bodies that are not there, and bodies that no joint holds."""
        if says := [*self._faults()]:
            raise ValueError("\n".join(says))
        return self

    def _faults(self) -> Iterator[str]:
        if GROUND in self.bodies:
            yield f"bodies: '{GROUND}' is what does not move; give the body another name"
        known = [*self.bodies, GROUND]
        held = {body for joint in self.joints.values() for body in joint.between}
        for name, joint in self.joints.items():
            for body in joint.between:
                if body not in known:
                    yield f"joints {name} between: {unknown('body', body, known)}"
        for body in self.bodies:
            if body not in held:
                yield f"bodies {body}: no joint is at it; name it in the `between` of one"


def effects_of(joints: Any) -> list[str] | None:
    """Names of the effects at all joints, of a table as TOML has it; None where it is malformed."""
    if not isinstance(joints, Mapping):
        return None
    names: list[str] = []
    for joint in joints.values():
        listed = joint.get("effects", ()) if isinstance(joint, Mapping) else ()
        if not isinstance(listed, (list, tuple)):
            return None
        names += [name for name in listed if isinstance(name, str)]
    return list(dict.fromkeys(names))


def run_faults(machine: MachineSpec | None, records: tuple[RecordSpec, ...]) -> Iterator[str]:
    """Say which runs have no machine, and what records ask of it that it does not have."""
    if machine is None:
        for r in records:
            if r.kind in OF_A_MACHINE:
                yield (
                    f"records: {quoted(r.name)} is a {r.kind}, and no machine is stated; write "
                    "[machine.bodies] and [machine.joints], or another kind"
                )
        return
    for r in records:
        where = f"records: {quoted(r.name)} on cylinder {r.cylinder}"
        if r.kind not in OF_A_MACHINE:
            yield f"{where} is a {r.kind}; records of a [machine] are runs and tests"
        elif r.cylinder not in machine.joints:
            yield f"{where}: {unknown('joint', r.cylinder, [*machine.joints])}"
        elif "pressure" in r.channels and not machine.joints[r.cylinder].oil:
            yield f"{where} reads a pressure, but there is no oil at this joint; state its area"
    starts: dict[str, str | None] = {}
    for r in records:
        if starts.setdefault(r.name, r.start) != r.start:
            yield (
                f"records: {quoted(r.name)} starts in two ways; one name is one run of the whole "
                "machine, write the same `start` at all its joints"
            )

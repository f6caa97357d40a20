"""The models of friction that are compared, and the model without any of them.

They are compared in the rig, or at one joint of a machine that the spec puts together.

All stand on viscous friction. Dry friction comes beside what the spec's model has of it: a constant
coefficient, or one with memory where the spec names `frequency-dependent-friction`. One program
simulates all of dry friction: Stribeck's model is that of bristles without damping, whose bending
is that of stiff ones, Coulomb's is Stribeck's without excess.
"""

import dataclasses
from collections.abc import Mapping

from rigid.effects import CATALOGUE, AbstractEffect
from rigid.effects.placed import RIG, Scales, sized
from rigid.io.errors import InputError
from rigid.likelihood.machine import placed_in
from rigid.likelihood.priors import AbstractPrior
from rigid.localfit.candidates import priors_of, quiet_values
from rigid.spec import Spec
from rigid.spec.machine import MachineSpec
from rigid.spec.sentences import unknown

VISCOUS, MEMORY = "viscous-friction", "frequency-dependent-friction"
COULOMB, STRIBECK = "coulomb-friction", "stribeck-friction"
BRISTLES, SEAL = "lugre-friction", "pressure-dependent-friction"
BENDING, PRESLIDING = "z_bristle", "presliding"
"""Bending at which bristles slide, of those that bend visibly and of stiff ones."""
NAMES = (VISCOUS, MEMORY, COULOMB, STRIBECK, BRISTLES, SEAL)
WORDS = {
    VISCOUS: "constant viscous",
    MEMORY: "memory",
    COULOMB: "Coulomb",
    STRIBECK: "Stribeck",
    BRISTLES: "LuGre",
    SEAL: "pressure-dependent",
}
WITHIN = {VISCOUS: (), COULOMB: (VISCOUS,), STRIBECK: (VISCOUS, COULOMB), SEAL: (VISCOUS,),
          BRISTLES: (VISCOUS, COULOMB, STRIBECK), MEMORY: (VISCOUS,)}  # fmt: skip
"""Laws that each becomes where some of its numbers take a limit."""


@dataclasses.dataclass(frozen=True)
class Place:
    """Where models are compared: in the rig, a body that was measured, or at a joint of a machine.

    - `usual`: sizes of the body, which priors go with.
    """

    machine: MachineSpec | None = None
    joint: str = ""
    usual: Scales = RIG

    @property
    def oil(self) -> bool:
        """Whether there is oil, whose pressure a friction can go with."""
        return self.machine is None or self.machine.joints[self.joint].oil

    def named(self, spec: Spec) -> tuple[str, ...]:
        """Names of the effects that a spec has here."""
        if self.machine is None:
            return spec.model.effects
        return self.machine.joints[self.joint].effects

    def effect(self, name: str) -> type[AbstractEffect]:
        """Return an effect of the catalogue as it acts here."""
        effect = CATALOGUE[name]
        if self.machine is None:
            return sized(effect, self.usual)
        return placed_in(self.machine, effect, self.joint)

    def labels(self, name: str) -> tuple[str, ...]:
        """Labels that the numbers of an effect have here."""
        return self.effect(name).labels()

    def label(self, number: str) -> str:
        """Return the label that a number of friction has here."""
        own = self.machine is not None and number not in self.machine.shared
        return f"{number}[{self.joint}]" if own else number


def place_of(spec: Spec, joint: str | None) -> Place:
    """Return where models of friction are compared.

    - `joint`: of the spec's machine; None: the only one that rubs.

    Raises InputError for a joint that is not there, or where it must be said which one is meant.
    """
    if spec.machine is None:
        if joint is not None:
            raise InputError(f"{spec.path}: there is no [machine]; leave --joint out")
        return Place()
    joints = spec.machine.joints
    if joint is None:
        rubs = [name for name, one in joints.items() if {*one.effects} & {*NAMES}]
        if len(rubs) != 1:
            told = f"joints that rub are {', '.join(rubs)}" if rubs else "no joint rubs in it"
            raise InputError(
                f"{spec.path} [machine]: {told}; say with --joint where friction models are "
                "compared"
            )
        joint = rubs[0]
    if joint not in joints:
        raise InputError(f"--joint: {unknown('joint', joint, [*joints])}")
    return Place(spec.machine, joint)


@dataclasses.dataclass(frozen=True)
class FrictionModel:
    """One model of friction.

    - `name`: that of its effect. - `memory`: whether a coefficient with memory is part of it.
    - `dry`: what stands for it in the program of dry friction, None for viscous models.
    - `held`: numbers of the program, by label, that the model has at a value. - `given`: priors of
      numbers of the program that are the model's own. - `calls`: what the model calls numbers that
      the program has under another label. - `place`: where it acts.
    """

    name: str
    memory: bool
    dry: type[AbstractEffect] | None = None
    held: Mapping[str, float] = dataclasses.field(default_factory=dict)
    given: Mapping[str, AbstractPrior] = dataclasses.field(default_factory=dict)
    calls: Mapping[str, str] = dataclasses.field(default_factory=dict)
    place: Place = Place()

    @property
    def words(self) -> str:
        """Name for tables."""
        beside = " beside memory" if self.memory and self.dry is not None else ""
        return WORDS[self.name] + beside

    @property
    def effects(self) -> tuple[str, ...]:
        """Effects of friction that a spec of this model names."""
        memory = (MEMORY,) if self.memory else ()
        return (VISCOUS, *memory, *((self.name,) if self.dry is not None else ()))

    def contains(self, other: "FrictionModel") -> bool:
        """Whether another model is a limit of this one."""
        if self.name == other.name or other.memory > self.memory:
            return False
        simpler = VISCOUS if other.dry is None else other.name
        return other.name == VISCOUS or simpler in WITHIN[self.name]


def without_friction(spec: Spec, place: Place) -> Spec:
    """Return the spec with viscous friction and memory as its only friction there.

    A coefficient that varies by kind of record is no model but a stopgap for one; it goes.
    """
    if place.machine is not None:
        return with_friction(spec, place, (VISCOUS, MEMORY))
    model = spec.model
    names = {info.name for one in NAMES for info in CATALOGUE[one].parameters()}
    changes = {
        "effects": _rubbing(model.effects, (VISCOUS, MEMORY)),
        "candidates": tuple(dict.fromkeys((*(model.candidates or ()), *NAMES))),
        "vary": {k: v for k, v in model.vary.items() if k not in names},
        "only": {k: v for k, v in model.only.items() if k not in NAMES},
    }
    return spec.model_copy(update={"model": model.model_copy(update=changes)})


def with_friction(spec: Spec, place: Place, names: tuple[str, ...]) -> Spec:
    """Return the spec of a machine with some effects as the only friction at a joint."""
    assert place.machine is not None
    joint = place.machine.joints[place.joint]
    bare = joint.model_copy(update={"effects": _rubbing(joint.effects, names)})
    joints = {**place.machine.joints, place.joint: bare}
    machine = place.machine.model_copy(update={"joints": joints})
    every = tuple(dict.fromkeys(name for one in joints.values() for name in one.effects))
    model = spec.model.model_copy(update={"effects": every})
    return spec.model_copy(update={"machine": machine, "model": model})


def _rubbing(effects: tuple[str, ...], names: tuple[str, ...]) -> tuple[str, ...]:
    """Names of effects with some as the only friction among them."""
    kept = [name for name in effects if name not in NAMES or name in names]
    return tuple(dict.fromkeys((*kept, *names)))


def models(
    spec: Spec, given: Mapping[str, AbstractPrior], place: Place
) -> tuple[FrictionModel, ...]:
    """List the models for a spec, the simplest first.

    - `given`: priors that go before the effects' own, by label.
    """
    memory = MEMORY in place.named(spec)
    still = quiet_values(place.effect(MEMORY))
    none = {} if memory else still
    bending = place.label(PRESLIDING)
    stiff = priors_of(place.effect(COULOMB), given)[bending][1]

    def dry(name: str, program: str, held: Mapping[str, float]) -> FrictionModel:
        fixed = none | {place.label(number): value for number, value in held.items()}
        return FrictionModel(name, memory, place.effect(program), fixed, place=place)

    def of_bristles(name: str, held: Mapping[str, float]) -> FrictionModel:
        """A model of stiff bristles in the program of those that bend."""
        model, own = dry(name, BRISTLES, held), place.label(BENDING)
        if stiff.known:
            fixed = dict(model.held) | {own: float(stiff.from_standard(0.0))}
            return dataclasses.replace(model, held=fixed)
        return dataclasses.replace(model, given={own: stiff}, calls={own: bending})

    undamped = {"bristle_time": 0.0}
    return (
        FrictionModel(VISCOUS, False, None, still, place=place),
        FrictionModel(MEMORY, True, place=place),
        of_bristles(COULOMB, undamped | {"stribeck_excess": 0.0, "v_stribeck": 1.0}),
        of_bristles(STRIBECK, undamped),
        dry(BRISTLES, BRISTLES, {}),
        *((dry(SEAL, SEAL, {}),) if place.oil else ()),
    )


def amplitude_labels(model: FrictionModel, given: Mapping[str, AbstractPrior]) -> tuple[str, ...]:
    """Labels of the numbers that bring a model in beside viscous friction."""
    effects = [model.place.effect(name) for name in model.effects if name != VISCOUS]
    return tuple(
        label
        for effect in effects
        for label, (info, _) in priors_of(effect, given).items()
        if info.absent is not None
    )

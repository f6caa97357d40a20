"""The models of friction that are compared, and the model without any of them.

All stand on viscous friction. Dry friction comes beside what the spec's model has of it: a constant
coefficient, or one with memory where the spec names `frequency-dependent-friction`. One program
simulates all of dry friction: Stribeck's model is that of bristles of the rig's presliding bending
without damping, Coulomb's is Stribeck's without excess.
"""

import dataclasses
from collections.abc import Mapping

from rigid.effects import CATALOGUE, AbstractEffect
from rigid.likelihood.priors import AbstractPrior
from rigid.likelihood.problem import Problem
from rigid.localfit.candidates import priors_of, quiet_values
from rigid.spec import Spec

VISCOUS, MEMORY = "viscous-friction", "frequency-dependent-friction"
COULOMB, STRIBECK = "coulomb-friction", "stribeck-friction"
BRISTLES, SEAL = "lugre-friction", "pressure-dependent-friction"
NAMES = (VISCOUS, MEMORY, COULOMB, STRIBECK, BRISTLES, SEAL)
WORDS = {
    VISCOUS: "constant viscous",
    MEMORY: "memory",
    COULOMB: "Coulomb",
    STRIBECK: "Stribeck",
    BRISTLES: "LuGre",
    SEAL: "pressure-dependent",
}
DRY = (CATALOGUE[BRISTLES], CATALOGUE[SEAL])
"""What the program of dry friction holds."""
WITHIN = {VISCOUS: (), COULOMB: (VISCOUS,), STRIBECK: (VISCOUS, COULOMB), SEAL: (VISCOUS,),
          BRISTLES: (VISCOUS, COULOMB, STRIBECK), MEMORY: (VISCOUS,)}  # fmt: skip
"""Laws that each becomes where some of its numbers take a limit."""


@dataclasses.dataclass(frozen=True)
class FrictionModel:
    """One model of friction.

    - `name`: that of its effect. - `memory`: whether a coefficient with memory is part of it.
    - `dry`: what stands for it in the program of dry friction, None for viscous models.
    - `held`: numbers of the program, by label, that the model has at a value.
    """

    name: str
    memory: bool
    dry: type[AbstractEffect] | None = None
    held: Mapping[str, float] = dataclasses.field(default_factory=dict)

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


def without_friction(spec: Spec) -> Spec:
    """Return the spec with viscous friction and memory as its only friction, everywhere alike.

    A coefficient that varies by kind of record is no model but a stopgap for one; it goes.
    """
    model = spec.model
    kept = [name for name in model.effects if name not in NAMES or name in (VISCOUS, MEMORY)]
    names = {info.name for one in NAMES for info in CATALOGUE[one].parameters()}
    changes = {
        "effects": tuple(dict.fromkeys((*kept, VISCOUS, MEMORY))),
        "candidates": tuple(dict.fromkeys((*(model.candidates or ()), *NAMES))),
        "vary": {k: v for k, v in model.vary.items() if k not in names},
        "only": {k: v for k, v in model.only.items() if k not in NAMES},
    }
    return spec.model_copy(update={"model": model.model_copy(update=changes)})


def models(spec: Spec, problem: Problem) -> tuple[FrictionModel, ...]:
    """List the models for a spec, the simplest first; `problem` is that of `without_friction`."""
    memory = MEMORY in spec.model.effects
    still = quiet_values(CATALOGUE[MEMORY])
    none = {} if memory else still
    numbers = (*problem.parameters.sampled, *problem.parameters.known)
    bending = next(p for p in numbers if p.label == "presliding")
    stiff = {"z_bristle": float(bending.prior.from_standard(0.0)), "bristle_time": 0.0}
    plain = stiff | {"stribeck_excess": 0.0, "v_stribeck": 1.0}
    return (
        FrictionModel(VISCOUS, False, None, still),
        FrictionModel(MEMORY, True),
        FrictionModel(COULOMB, memory, DRY[0], none | plain),
        FrictionModel(STRIBECK, memory, DRY[0], none | stiff),
        FrictionModel(BRISTLES, memory, DRY[0], none),
        FrictionModel(SEAL, memory, DRY[1], none),
    )


def amplitude_labels(model: FrictionModel, given: Mapping[str, AbstractPrior]) -> tuple[str, ...]:
    """Labels of the numbers that bring a model in beside viscous friction."""
    effects = [CATALOGUE[name] for name in model.effects if name != VISCOUS]
    return tuple(
        label
        for effect in effects
        for label, (info, _) in priors_of(effect, given).items()
        if info.absent is not None
    )

"""What acts on the rig, one physical cause a file."""

from rigid.effects.base import AbstractEffect, Action, ParameterInfo, PriorDescription, State
from rigid.effects.frequency_dependent_friction import FrequencyDependentFriction
from rigid.effects.load_cell_spring import LoadCellSpring
from rigid.effects.oil_compressibility import OilCompressibility
from rigid.effects.pump_curve import PumpCurve
from rigid.effects.viscous_friction import ViscousFriction

CATALOGUE: dict[str, type[AbstractEffect]] = {
    effect.name: effect
    for effect in (
        LoadCellSpring,
        OilCompressibility,
        ViscousFriction,
        PumpCurve,
        FrequencyDependentFriction,
    )
}

__all__ = [
    "CATALOGUE",
    "AbstractEffect",
    "Action",
    "ParameterInfo",
    "PriorDescription",
    "State",
]

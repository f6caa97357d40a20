"""What acts on the rig, one physical cause a file."""

from rigid.effects.base import AbstractEffect, Action, State
from rigid.effects.clock_offset import ClockOffset
from rigid.effects.constant_force import ConstantForce
from rigid.effects.coulomb_friction import CoulombFriction
from rigid.effects.declare import ParameterInfo, PriorDescription
from rigid.effects.direction_dependent_viscosity import DirectionDependentViscosity
from rigid.effects.effective_area import EffectiveArea
from rigid.effects.entrained_air import EntrainedAir
from rigid.effects.free_root_plate import FreeRootPlate
from rigid.effects.frequency_dependent_friction import FrequencyDependentFriction
from rigid.effects.hose_pressure_drop import HosePressureDrop
from rigid.effects.load_cell_drift import LoadCellDrift
from rigid.effects.load_cell_spring import LoadCellSpring
from rigid.effects.load_cell_stiffening import LoadCellStiffening
from rigid.effects.lugre_friction import LuGreFriction
from rigid.effects.oil_compressibility import OilCompressibility
from rigid.effects.piston_leakage import PistonLeakage
from rigid.effects.pressure_dependent_friction import PressureDependentFriction
from rigid.effects.pump_curve import PumpCurve
from rigid.effects.pump_ripple import PumpRipple
from rigid.effects.pump_stage_switch import PumpStageSwitch
from rigid.effects.return_spring import ReturnSpring
from rigid.effects.seating_slack import SeatingSlack
from rigid.effects.stribeck_friction import StribeckFriction
from rigid.effects.stroke_sensor_lag import StrokeSensorLag
from rigid.effects.valve_event import ValveEvent
from rigid.effects.viscous_friction import ViscousFriction

CATALOGUE: dict[str, type[AbstractEffect]] = {
    effect.name: effect
    for effect in (
        LoadCellSpring,
        OilCompressibility,
        ViscousFriction,
        PumpCurve,
        CoulombFriction,
        StribeckFriction,
        LuGreFriction,
        FrequencyDependentFriction,
        PressureDependentFriction,
        ReturnSpring,
        EffectiveArea,
        PistonLeakage,
        EntrainedAir,
        HosePressureDrop,
        PumpStageSwitch,
        PumpRipple,
        ValveEvent,
        LoadCellStiffening,
        FreeRootPlate,
        SeatingSlack,
        StrokeSensorLag,
        LoadCellDrift,
        ClockOffset,
        ConstantForce,
        DirectionDependentViscosity,
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

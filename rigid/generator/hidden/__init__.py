"""Causes to hide in a campaign: every effect that can be missing, and forms no catalogue has.

Each is written down a second time here, where possible with another functional form than that of
the model which is to find it.
"""

from collections.abc import Sequence

import numpy as np

from rigid.generator.core import Run
from rigid.generator.hidden.base import Hidden
from rigid.generator.hidden.dry import Coulomb, LuGre, PressureDependent, Stribeck
from rigid.generator.hidden.flow import (
    PumpSlip,
    Ripple,
    ShutLeakage,
    StageSwitch,
    ValveDribble,
    ValveEvent,
)
from rigid.generator.hidden.forces import (
    BackwardViscosity,
    ConstantForce,
    Memory,
    ReturnSpring,
    RoughBore,
)
from rigid.generator.hidden.oil import Air, EffectiveArea, Leakage, OilStiffening
from rigid.generator.hidden.sensing import (
    Averaging,
    ClockOffset,
    GaugeJump,
    GaugeLag,
    HoseDrop,
    LoadCreep,
    LoadDrift,
    LoadHysteresis,
    Mounting,
    Pickup,
    StrokeLag,
    StrokeWave,
    Warming,
)
from rigid.generator.hidden.structure import (
    GradualRelease,
    GuideDrag,
    RootPlate,
    Slack,
    Stiffening,
)


def _by_name(*causes: type[Hidden]) -> dict[str, type[Hidden]]:
    return {cause.name: cause for cause in causes}


CATALOGUED = _by_name(
    *(Coulomb, Stribeck, LuGre, Memory, PressureDependent, ReturnSpring),
    *(EffectiveArea, Leakage, Air, HoseDrop, StageSwitch, PumpSlip, Ripple, ValveEvent),
    *(Stiffening, RootPlate, Slack, StrokeLag, LoadDrift, ClockOffset),
    *(ConstantForce, BackwardViscosity),
    *(ShutLeakage, GaugeLag, LoadCreep, LoadHysteresis, Warming, Mounting),
    *(GradualRelease, Pickup, Averaging),
)
OUTSIDE = _by_name(
    *(RoughBore, GuideDrag, OilStiffening, ValveDribble, GaugeJump, StrokeWave),
)
HIDDEN = CATALOGUED | OUTSIDE


def hide(name: str, rng: np.random.Generator, runs: Sequence[Run]) -> Hidden:
    """Draw a cause by name, at its typical amplitude.

    - rng: of its other numbers; runs: those of the campaign, one of which it may be confined to

    Raises ValueError for a name that is none of HIDDEN.
    """
    if name not in HIDDEN:
        raise ValueError(f"nothing is called '{name}' here; known are {', '.join(HIDDEN)}")
    return HIDDEN[name].drawn(rng, runs)


__all__ = ["CATALOGUED", "HIDDEN", "OUTSIDE", "Hidden", "hide"]

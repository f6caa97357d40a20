"""Populations of campaigns: with nothing missing, and with something hidden."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from . import causes as c
from .plant import Cause
from .sensors import Chain

Draw = Callable[[np.random.Generator], Cause]


@dataclass(frozen=True)
class Population:
    """How the campaigns of a population are made.

    - hidden: draws the cause; nearest: its name in the catalogue, None where it has none
    - strap: (shortest, longest duration [s], law) of the release; grid: it falls on a sample
    - durations: factor of all records; scale: of the pump; intake: at atmospheric density
    - frame: stiffness of the frame over the stated one; tolerance: of the solver
    """

    hidden: Draw | None = None
    nearest: str | None = None
    chain: Chain = field(default_factory=Chain)
    strap: tuple[float, float, str] = (0.0, 0.0, "logistic")
    grid: bool = False
    durations: float = 1.0
    scale: float = 1.0
    intake: bool = False
    frame: float = 1.0
    tolerance: float = 1e-8
    rate: float = 100.0


NULLS = {
    "plain": Population(),
    "coloured": Population(chain=Chain(colour=(0.3, 0.6))),
    "strongly-coloured": Population(chain=Chain(colour=(0.6, 0.95))),
    "two-time-scales": Population(chain=Chain(colour=(0.3, 0.6), slow=0.3)),
    "heavy-tails": Population(chain=Chain(tails=4.0)),
    "growing-noise": Population(chain=Chain(growing=1.0)),
    "spikes": Population(chain=Chain(spikes=0.005)),
    "jitter": Population(chain=Chain(jitter=0.05)),
    "coarse-converter": Population(chain=Chain(step=2.0)),
    "cutting-converter": Population(chain=Chain(cut=True)),
    "loose-solver": Population(tolerance=1e-5),
    "short-records": Population(durations=0.5),
    "release-on-a-sample": Population(chain=Chain(window=0.1, place=0.5), grid=True),
    "release-on-a-sample-coloured": Population(
        chain=Chain(window=0.1, place=0.5, colour=(0.7, 0.85)), grid=True
    ),
    "pump-scale": Population(scale=1.02),
    "pump-statement": Population(scale=1.64 / 1.68),
    "frame-stiffness": Population(frame=1.06),
}
"""Nothing is missing that a name of the catalogue stands for. `pump-statement`: q_min of the
paper's (1) over that of (22)."""


def _about(rng: np.random.Generator, value: float) -> float:
    """Log-uniform, from half to twice a value."""
    return float(value * 2.0 ** rng.uniform(-1.0, 1.0))


def _ramp(rng: np.random.Generator) -> Cause:
    start = float(rng.uniform(1.0, 4.0))
    end = start + float(rng.uniform(1.5, 3.0))
    return c.ValveRamp(start, end, _about(rng, 0.08), float(rng.random()))


def _drift(rng: np.random.Generator) -> Cause:
    return c.Drift(_about(rng, 600.0), 15.0, tuple(map(float, rng.standard_normal(6))))


def _loop(rng: np.random.Generator) -> Cause:
    sign = float(rng.choice((-1.0, 1.0)))
    return c.HystereticCell(sign * _about(rng, 100.0), _about(rng, 6e-4))


CATALOGUED: dict[str, tuple[str, Draw]] = {
    "dry": ("coulomb-friction", lambda r: c.DryFriction(_about(r, 2500.0))),
    "dahl": ("coulomb-friction", lambda r: c.Dahl(_about(r, 2500.0), 2e8)),
    "orifice": ("piston-leakage", lambda r: c.OrificeLeak(_about(r, 4e-15), _about(r, 2e-11))),
    "air": ("entrained-air", lambda r: c.DissolvingAir(_about(r, 4e-3))),
    "hose": ("hose-pressure-drop", lambda r: c.HoseDrop(_about(r, 1e14))),
    "stage": ("pump-stage-switch", lambda r: c.StageSwitch(_about(r, 136e5))),
    "ripple": ("pump-ripple", lambda r: c.Ripple(_about(r, 0.05), float(r.uniform(3.0, 20.0)))),
    "valve-ramp": ("valve-event", _ramp),
    "stiffening": ("load-cell-stiffening", lambda r: c.Stiffening(_about(r, 0.08))),
    "free-root": ("free-root-plate", lambda r: c.FreeRoot(_about(r, 400.0), 4e8, 4e4)),
    "slack": ("seating-slack", lambda r: c.Slack(_about(r, 3e-4))),
    "stroke-lag": ("stroke-sensor-lag", lambda r: c.Lag("stroke", _about(r, 0.03))),
    "drift": ("load-cell-drift", _drift),
    "return": ("return-spring", lambda r: c.Standing(_about(r, 1500.0))),
    "mounting-resonance": (
        "accelerometer-resonance",
        lambda r: c.Lag("acceleration", _about(r, 6e-4), 0.1),
    ),
    "creeping-cell": ("load-cell-creep", lambda r: c.CreepingCell(_about(r, 0.01), _about(r, 2.0))),
    "hysteretic-cell": ("load-cell-hysteresis", _loop),
    "shut-valve-leak": ("shut-valve-leakage", lambda r: c.ShutValveLeak(_about(r, 8e-15))),
    "lagging-gauge": ("pressure-gauge-lag", lambda r: c.Lag("pressure", _about(r, 0.03))),
    "warming": ("temperature-drift", lambda r: c.Warming(_about(r, 800.0), _about(r, 1e5), 4.0)),
}
OUTSIDE: dict[str, Draw] = {
    "square-friction": lambda r: c.Cubic(_about(r, 3e7)),
    "tight-place": lambda r: c.StrokeBump(_about(r, 2500.0), float(r.uniform(0.01, 0.05)), 8e-3),
}
STRAPS = {"slow": "logistic", "linear": "linear", "exponential": "exponential"}
POPULATIONS = (
    NULLS
    | {name: Population(draw, nearest) for name, (nearest, draw) in CATALOGUED.items()}
    | {name: Population(draw) for name, draw in OUTSIDE.items()}
    | {
        f"{name}-strap": Population(nearest="gradual-release", strap=(1e-3, 4e-3, law))
        for name, law in STRAPS.items()
    }
    | {
        "averaging-converter": Population(
            nearest="sample-averaging", chain=Chain(window=0.8, place=0.5)
        ),
        "intake-density": Population(nearest="pump-slip", intake=True),
        "hum": Population(nearest="mains-pickup", chain=Chain(hum=0.7), rate=80.0),
        "clock": Population(
            nearest="clock-offset", chain=Chain(late=(("pressure", 0.02), ("load", 0.02)))
        ),
    }
)

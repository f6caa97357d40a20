"""What may differ from campaign to campaign of a study."""

from dataclasses import dataclass, replace

import numpy as np

from rigid.generator.core import Piece
from rigid.generator.draw import Secret, Truth
from rigid.generator.hidden import Hidden
from rigid.generator.sensors import Flaws
from rigid.generator.simulate import acting, simulate


@dataclass(frozen=True)
class Conditions:
    """What may differ from campaign to campaign of a study; the defaults change nothing.

    - noise_correlation: AR(1) coefficient of the slow channels' noise, in [0, 1)
    - hidden: pieces of physics to hide, named in the truth alone
    - clock: a seed for lengths and valve times alone, so that many campaigns share them
    - noise_factor: of all sensors' noise, which no spec tells
    - step_factor: of the steps of the slow channels' converters, which no spec tells
    - outliers: share of the samples that a spike has hit
    - saturated: share of the frame records' samples for which the gauge's range is too short
    - tolerance: of the solver, relative error a step
    - wide_friction: whether the friction is drawn as widely as a fit's own priors allow
    - memory: whether the friction has any; else it is mu_inf alone, constant
    """

    noise_correlation: float = 0.0
    hidden: tuple[Piece, ...] = ()
    clock: int | None = None
    noise_factor: float = 1.0
    step_factor: float = 1.0
    outliers: float = 0.0
    saturated: float = 0.0
    tolerance: float | None = None
    wide_friction: bool = False
    memory: bool = True

    def __post_init__(self) -> None:
        """Refuse what makes no sense."""
        for name in ("noise_correlation", "outliers", "saturated"):
            value = getattr(self, name)
            if not 0.0 <= value < 1.0:
                raise ValueError(f"{name} is {value}; it has to lie in [0, 1)")
        for name in ("noise_factor", "step_factor"):
            value = getattr(self, name)
            if not value > 0.0:
                raise ValueError(f"{name} is {value}; it has to be above 0")


NOMINAL = Conditions()

NO_BRANCH = 1e-3
"""Coefficient of a branch of memory [N s/m] that is as good as none; 0 would have no rate."""

NULLS = {
    "coloured-noise": Conditions(noise_correlation=0.6),
    "outliers": Conditions(outliers=0.005),
    "adc-step": Conditions(step_factor=2.0),
    "saturation": Conditions(saturated=0.01),
    "noise-level": Conditions(noise_factor=2.0),
    "loose-solver": Conditions(tolerance=1e-5),
}
"""Conditions under which no physics is missing though records are not as the sheets have them."""


def under(truth: Truth, conditions: Conditions) -> Truth:
    """Give the truth of a campaign as its conditions make it."""
    sensors = {}
    for name, sensor in truth.sensors.items():
        steps = 1.0 if name.startswith("acceleration") else conditions.step_factor
        noise = conditions.noise_factor * sensor.noise
        sensors[name] = replace(sensor, noise=noise, step=steps * sensor.step)
    truth = replace(truth, sensors=sensors)
    if not conditions.memory:
        truth = replace(truth, friction=replace(truth.friction, mu_1=NO_BRANCH, mu_2=NO_BRANCH))
    secrets = tuple(secret(truth, piece) for piece in conditions.hidden)
    flaws = Flaws(conditions.outliers, tolerance=conditions.tolerance)
    if conditions.saturated > 0.0:
        tops = _tops(truth, conditions.hidden, conditions.saturated)
        flaws = replace(flaws, tops=tops)
    return replace(truth, hidden=secrets, flaws=flaws)


def secret(truth: Truth, piece: Piece, strength: float | None = None) -> Secret:
    """Say what is hidden, for the truth."""
    if not isinstance(piece, Hidden):
        return Secret(type(piece).__name__)
    where = [f"{run.name},{run.cylinder}" for run in truth.runs if acting(truth, run, (piece,))]
    return Secret(piece.name, piece.equation, piece.law, piece.parameters(), tuple(where), strength)


def _tops(truth: Truth, hidden: tuple[Piece, ...], share: float) -> dict[str, float]:
    """Reading of each gauge [Pa] above which its frame records spend a share of their samples."""
    seen: dict[str, list[np.ndarray]] = {}
    for run in truth.runs:
        if run.kind == "frame":
            name = f"pressure,{run.cylinder}"
            values = simulate(truth, run, hidden).values["pressure"]
            seen.setdefault(name, []).append(truth.sensors[name].reading(values))
    return {
        name: float(np.quantile(np.concatenate(parts), 1.0 - share)) for name, parts in seen.items()
    }

"""What the figures show: frozen values, computed elsewhere, SI or with the unit they name.

They live beside the plots, not in the report, so that a figure can be drawn without a page.
"Quantiles" are always the 5, 25, 50, 75 and 95 % ones, in this order, along the first axis.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Complex, Float, Int

QUANTILES = (5, 25, 50, 75, 95)


@dataclass(frozen=True, eq=False)
class ChannelFit:
    """One sensor of one record beside what the posterior says it should have read.

    - record, cylinder, kind: of the record; kind is frame, release, free-run, field or motion
    - quantity: load, stroke, pressure, acceleration or force
    - unit: of `data` and `quantiles`; an SI unit gets a prefix in the figure ("N" -> "kN")
    - quantiles: of the noiseless reading, gain and zero of the sensor included
    - residual: one step ahead, over the noise on the sensor's sheet
    - valve: (time [s] from which, "open" | "shut" | "tank"), the first at the record's start;
      empty where there is none
    - gap: RMS residual over the sheet's noise; 1 is a sensor as good as its sheet
    - correlation_time: of the fitted noise [s]; 0 where the noise model takes it for white
    - autocorrelation: at lags from 1 on, of readings less the median and of `residual`
    """

    record: str
    cylinder: str
    kind: str
    quantity: str
    unit: str
    time: Float[np.ndarray, " n"]
    data: Float[np.ndarray, " n"]
    quantiles: Float[np.ndarray, "5 n"]
    residual: Float[np.ndarray, " n"]
    valve: tuple[tuple[float, str], ...]
    gap: float
    correlation_time: float
    autocorrelation: Float[np.ndarray, "2 lags"]


@dataclass(frozen=True, eq=False)
class FrictionCurve:
    """Friction over frequency: dissipative part, storage part and magnitude.

    - frequency: [Hz], rising
    - dissipative: Re mu [N s/m]
    - storage: k_omega = -omega Im mu [N/m]
    - magnitude, prior_magnitude: |mu| [N s/m]
    - informed: False where the posterior is no narrower than the prior
    - excited: (label, lowest, highest [Hz]) of what the records excite
    - published: (frequency [Hz] or None for "at rest", |mu| [N s/m], label)
    """

    frequency: Float[np.ndarray, " m"]
    dissipative: Float[np.ndarray, "5 m"]
    storage: Float[np.ndarray, "5 m"]
    magnitude: Float[np.ndarray, "5 m"]
    prior_magnitude: Float[np.ndarray, "5 m"]
    informed: Bool[np.ndarray, " m"]
    excited: tuple[tuple[str, float, float], ...] = ()
    published: tuple[tuple[float | None, float, str], ...] = ()


@dataclass(frozen=True, eq=False)
class ParameterDraws:
    """Posterior draws of a few parameters, for the corner figure.

    - symbols: TeX without dollar signs
    - units: SI
    - values: one row a parameter, one column a draw
    - marks: published value of each parameter, or None
    """

    symbols: tuple[str, ...]
    units: tuple[str, ...]
    values: Float[np.ndarray, "parameters draws"]
    marks: tuple[float | None, ...]


@dataclass(frozen=True, eq=False)
class Trace:
    """How one parameter moved while it was sampled.

    - step: number of each step shown
    - means: mean over the walkers of each ensemble [unit]
    - kept_from: first step that enters the posterior
    - ranks: how many draws of each ensemble fall in each bin of the overall rank
    """

    symbol: str
    unit: str
    step: Int[np.ndarray, " steps"]
    means: Float[np.ndarray, "ensembles steps"]
    kept_from: int
    ranks: Int[np.ndarray, "ensembles bins"]


@dataclass(frozen=True, eq=False)
class Roots:
    """Roots of equation (14) in the complex plane, dimensionless (y = omega / omega_0).

    - paths: the roots as the damping grows from nothing, in any order within a step
    - damping_range: dimensionless epsilon at both ends of the paths
    - undamped: the roots without damping
    - marks: (label, roots) for published values of mu
    - posterior: (label, roots) for draws of the posterior, any number, or None
    """

    paths: Complex[np.ndarray, "roots m"]
    damping_range: tuple[float, float]
    undamped: Complex[np.ndarray, " roots"]
    marks: tuple[tuple[str, Complex[np.ndarray, " k"]], ...] = ()
    posterior: tuple[str, Complex[np.ndarray, " draws"]] | None = None


@dataclass(frozen=True, eq=False)
class HiddenShown:
    """A hidden force, flow or distortion against what explains it best.

    - `variable`, `variable_unit`, `name`, `unit`. - `place`, `mean`, `sd` (n,).
    - `formula`: values (n,) of the simplest formula that fits, and its `words`; None: none does.
    - `groups`: names of the places where these are no numbers: kinds of records, quantities; then
      the formula is what the model has there, and `model` says it.
    """

    variable: str
    variable_unit: str
    name: str
    unit: str
    place: Float[np.ndarray, " n"]
    mean: Float[np.ndarray, " n"]
    sd: Float[np.ndarray, " n"]
    formula: Float[np.ndarray, " n"] | None
    words: str
    groups: tuple[str, ...] = ()
    model: str = ""

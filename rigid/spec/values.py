"""What a spec says, as frozen values. SI, once the record readers have converted units."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

Position = Literal["open", "shut", "tank"]
Kind = Literal["frame", "release", "free-run", "field"]
Quantity = Literal["time", "load", "stroke", "pressure", "acceleration"]


class Value(BaseModel):
    """Base of all parts of a spec: immutable, unknown keys refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Known(Value):
    """A number with its uncertainty (1 sd), in SI; an sd of 0 is exact."""

    value: float
    sd: Annotated[float, Field(ge=0.0)] = 0.0


def _known(given: Any) -> Any:
    """Take a plain number as exactly known."""
    return {"value": given} if isinstance(given, (int, float)) else given


Number = Annotated[Known, BeforeValidator(_known)]

YOUNG = 200e9  # Pa; paper, after eq. (16)
BEAM_AREA = (0.13 + 2 * 0.06) * 0.006  # m^2; S_B = (b + 2 w) h, eq. (15), "Calibration experiments"
FRAME_LENGTH = 2.1  # m; L_f, same place
FRAME_SHARE = 0.03  # sd; table of uncertainties
BEAMS = {"two-per-cylinder": 2, "two-shared": 1}
"""Beams that carry one cylinder's load: the factor 2 of eq. (15), or half of it if both cylinders
press on the same two beams."""


def _relative(value: float, share: float) -> Known:
    return Known(value=value, sd=share * value)


class RigSpec(Value):
    """Constants of the rig; masses [kg], area [m^2], moduli and pressures [Pa], lengths [m].

    Defaults: paper, eq. (1), and L_0 of the modal analysis; uncertainties as documented in
    docs/spec.md.
    """

    M_HC: Number = _relative(60.0, 0.03)
    M_Pl: Number = _relative(10.0, 0.03)
    M_Fl: Number = _relative(200.0, 0.03)
    S_Pl: Number = Known(value=44.2e-4)
    k_oil: Number = _relative(2e9, 0.05)
    L_0: Number = _relative(0.20, 0.02)
    p_max: Number = Known(value=700e5)
    k_frame: Number | None = None
    frame_beams: Literal["two-per-cylinder", "two-shared"] = "two-per-cylinder"

    @property
    def frame_stiffness(self) -> Known:
        """Stiffness of the calibration frame against one cylinder [N/m], from eq. (15)."""
        if self.k_frame is not None:
            return self.k_frame
        beams = BEAMS[self.frame_beams]
        return _relative(beams * YOUNG * BEAM_AREA / FRAME_LENGTH, FRAME_SHARE)

    @property
    def known(self) -> dict[str, Known]:
        """All constants by their symbol."""
        names = ("M_HC", "M_Pl", "M_Fl", "S_Pl", "k_oil", "L_0", "p_max")
        return {name: getattr(self, name) for name in names} | {"k_frame": self.frame_stiffness}


class ModelSpec(Value):
    """What acts on the rig: names of effects; what a parameter varies by; candidates to discover."""

    effects: tuple[str, ...] = (
        "load-cell-spring",
        "oil-compressibility",
        "viscous-friction",
        "pump-curve",
    )
    candidates: tuple[str, ...] | None = None
    vary: Mapping[str, Literal["kind", "cylinder", "record"]] = {}


class LawSpec(Value):
    """A prior law by name with its arguments."""

    law: str
    arguments: Mapping[str, float]

    @model_validator(mode="before")
    @classmethod
    def one_law(cls, given: Any) -> Any:
        """Read `{ lognormal = { median = 6e7, factor = 2.0 } }` or `{ fixed = 700e5 }`."""
        if not isinstance(given, Mapping) or len(given) != 1:
            raise ValueError("a prior is one law, as in { lognormal = { median = 6e7, factor = 2 } }")
        (law, arguments), *_ = given.items()
        if isinstance(arguments, (int, float)):
            arguments = {"value": arguments}
        return {"law": law, "arguments": arguments}


class SensorSpec(Value):
    """A sensor's sheet: converter `step`, `noise` of a sample before it, spread of gain and zero.

    `range`: least and greatest value it can show. All SI, gain_sd without unit.
    """

    step: Annotated[float, Field(ge=0.0)]
    noise: Annotated[float, Field(gt=0.0)]
    gain_sd: Annotated[float, Field(gt=0.0)]
    zero_sd: Annotated[float, Field(gt=0.0)]
    range: tuple[float, float]


G = 9.80665
PSI = 6894.757
SHEETS: dict[str, dict[str, Any]] = {
    # Steps: paper, "Construction of the hydraulic rig". Gain, zero, noise: docs/spec.md.
    "load": {"step": 295.0, "noise": 147.5, "gain_sd": 1e-3, "zero_sd": 100.0, "range": (-3.3e5, 3.3e5)},
    "stroke": {"step": 2.2e-4, "noise": 5.5e-5, "gain_sd": 1e-3, "zero_sd": 1.2e-4, "range": (-0.01, 0.4)},
    "pressure": {"step": 5 * PSI, "noise": 5 * PSI / 3, "gain_sd": 1e-3, "zero_sd": 0.25e5, "range": (-1e5, 750e5)},
    "acceleration": {"step": 0.0, "noise": 0.35, "gain_sd": 1e-2, "zero_sd": 0.05, "range": (-200 * G, 200 * G)},
}  # fmt: skip


class SensorsSpec(Value):
    """Sheets of the four kinds of sensor; what a spec leaves out keeps the defaults."""

    load: SensorSpec = SensorSpec(**SHEETS["load"])
    stroke: SensorSpec = SensorSpec(**SHEETS["stroke"])
    pressure: SensorSpec = SensorSpec(**SHEETS["pressure"])
    acceleration: SensorSpec = SensorSpec(**SHEETS["acceleration"])

    @model_validator(mode="before")
    @classmethod
    def completed(cls, given: Any) -> Any:
        """Fill what a sheet leaves out."""
        if not isinstance(given, Mapping):
            return given
        return {
            name: SHEETS[name] | sheet if name in SHEETS and isinstance(sheet, Mapping) else sheet
            for name, sheet in given.items()
        }

    def __getitem__(self, quantity: str) -> SensorSpec:
        """Sheet of a quantity."""
        return getattr(self, quantity)


class ChannelSpec(Value):
    """Where a channel stands in a file: `column` by name or number from 1, its `unit`.

    SI value = (number * scale or factor of the unit) + offset.
    """

    column: str | int
    unit: str
    scale: float | None = None
    offset: float = 0.0


class Stretch(Value):
    """A position of the valve until a time [s] of the record."""

    until: float = math.inf
    position: Position

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=True)


class RecordSpec(Value):
    """One cylinder in one measured run."""

    name: Annotated[str, Field(pattern=r"^[^\[\],/]+$")]
    kind: Kind
    cylinder: Annotated[str, Field(pattern=r"^[^\[\],/]+$")] = "A"
    file: Path
    channels: Mapping[Quantity, ChannelSpec]
    valve: tuple[Stretch, ...] = ()
    preload: Number | None = None
    release_time: Number | None = None
    fit: bool = True
    accept: tuple[str, ...] = ()
    rows: tuple[int, int] | None = None

    @model_validator(mode="before")
    @classmethod
    def defaults(cls, given: Any) -> Any:
        """Fill what depends on the kind: the valve's programme and whether to fit."""
        if not isinstance(given, Mapping):
            return given
        release = given.get("kind") == "release"
        valve = ({"position": "shut" if release else "open"},)
        return {"valve": valve, "fit": given.get("kind") != "field"} | dict(given)

    @model_validator(mode="after")
    def consistent(self) -> "RecordSpec":
        """Refuse a record without a time, a release without preload, a valve that goes back."""
        if "time" not in self.channels:
            raise ValueError("channels needs an entry 'time'")
        if len(self.channels) < 2:
            raise ValueError("channels names no quantity beside time")
        if self.kind == "release" and self.preload is None:
            raise ValueError("a release needs its preload, as in { value = 6000.0, sd = 60.0 } (N)")
        times = [s.until for s in self.valve]
        if any(b <= a for a, b in zip(times, times[1:], strict=False)):
            raise ValueError("valve: each `until` must lie after the one before")
        return self


class SamplerSpec(Value):
    """How long and how wide to sample; `walkers` 0 chooses by the number of parameters."""

    seed: int = 1
    ensembles: Annotated[int, Field(ge=2)] = 4
    walkers: Annotated[int, Field(ge=0)] = 0
    starts: Annotated[int, Field(ge=1)] = 16
    r_hat: Annotated[float, Field(gt=1.0)] = 1.01
    ess: Annotated[float, Field(gt=0.0)] = 1000.0
    max_steps: Annotated[int, Field(ge=100)] = 20000
    block: Annotated[int, Field(ge=10)] = 100


class BandsSpec(Value):
    """Where the posterior lies that bands are made from."""

    posterior: Path


class SpecBody(Value):
    """The spec as its file has it."""

    title: str = ""
    simulated: bool = False
    rig: RigSpec = RigSpec()
    model: ModelSpec = ModelSpec()
    priors: Mapping[str, LawSpec] = {}
    sensors: SensorsSpec = SensorsSpec()
    records: tuple[RecordSpec, ...] = ()
    bands: BandsSpec | None = None
    sampler: SamplerSpec = SamplerSpec()


class Spec(SpecBody):
    """A spec read from `path`; `text` is the file as it stands."""

    path: Path
    text: str

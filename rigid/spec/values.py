"""What a spec says, as frozen values. SI, once the record readers have converted units."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from rigid.spec.base import POSITIVE, Flag, Known, Real, Value, Whole, uncertain
from rigid.spec.record import RecordSpec

YOUNG = 200e9  # Pa; paper, after eq. (16)
BEAM_AREA = (0.13 + 2 * 0.06) * 0.006  # m^2; S_B = (b + 2 w) h, eq. (15), "Calibration experiments"
FRAME_LENGTH = 2.1  # m; L_f, same place
FRAME_SHARE = 0.03  # sd; table of uncertainties
BEAMS = {"two-per-cylinder": 2, "two-shared": 1}
"""Beams that carry one cylinder's load: the factor 2 of eq. (15), or half of it if both cylinders
press on the same two beams."""


MASS_SHARE, OIL_SHARE, COLUMN_SHARE = 0.03, 0.05, 0.02
"""Relative sds where a spec states none; docs/spec.md, table of uncertainties."""


def _relative(value: float, share: float) -> Known:
    return Known(value=value, sd=share * value)


class RigSpec(Value):
    """Constants of the rig; masses [kg], area [m^2], moduli and pressures [Pa], lengths [m].

    Defaults: paper, eq. (1), and L_0 of the modal analysis; uncertainties as documented in
    docs/spec.md.
    """

    M_HC: Annotated[Known, uncertain(MASS_SHARE), POSITIVE] = _relative(60.0, MASS_SHARE)
    M_Pl: Annotated[Known, uncertain(MASS_SHARE), POSITIVE] = _relative(10.0, MASS_SHARE)
    M_Fl: Annotated[Known, uncertain(MASS_SHARE), POSITIVE] = _relative(200.0, MASS_SHARE)
    S_Pl: Annotated[Known, uncertain(0.0), POSITIVE] = Known(value=44.2e-4)
    k_oil: Annotated[Known, uncertain(OIL_SHARE), POSITIVE] = _relative(2e9, OIL_SHARE)
    L_0: Annotated[Known, uncertain(COLUMN_SHARE), POSITIVE] = _relative(0.20, COLUMN_SHARE)
    p_max: Annotated[Known, uncertain(0.0), POSITIVE] = Known(value=700e5)
    k_frame: Annotated[Known, uncertain(FRAME_SHARE), POSITIVE] | None = None
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
    """What acts on the rig.

    - `effects`: by name. - `only`: effects that act in one kind, cylinder or record alone.
    - `vary`: what a parameter varies by. - `candidates`: what may be missing.
    """

    effects: tuple[str, ...] = (
        "load-cell-spring",
        "oil-compressibility",
        "viscous-friction",
        "pump-curve",
    )
    only: Mapping[str, str] = {}
    candidates: tuple[str, ...] | None = None
    vary: Mapping[str, Literal["kind", "cylinder", "record"]] = {}

    @model_validator(mode="after")
    def once(self) -> "ModelSpec":
        """Refuse an effect that is named twice."""
        twice = [name for name in self.effects if self.effects.count(name) > 1]
        if twice:
            raise ValueError(f"effects: '{twice[0]}' stands twice; name it once")
        return self


class LawSpec(Value):
    """A prior law by name with its arguments."""

    law: str
    arguments: Mapping[str, Real]

    @model_validator(mode="before")
    @classmethod
    def one_law(cls, given: Any) -> Any:
        """Read `{ lognormal = { median = 6e7, factor = 2.0 } }` or `{ fixed = 700e5 }`."""
        if isinstance(given, LawSpec) or (isinstance(given, Mapping) and "law" in given):
            return given
        if not isinstance(given, Mapping) or len(given) != 1:
            raise ValueError(
                "a prior is one law, as in { lognormal = { median = 6e7, factor = 2 } }"
            )
        (law, arguments), *_ = given.items()
        if not isinstance(arguments, Mapping):
            arguments = {"value": arguments}
        return {"law": law, "arguments": arguments}


def _pair(given: Any) -> Any:
    """Refuse what is no list of two."""
    if not isinstance(given, (list, tuple)) or len(given) != 2:
        raise ValueError("must be two numbers, as in [-3.3e5, 3.3e5]")
    return given


class SensorSpec(Value):
    """A sensor's sheet: converter `step`, `noise` of a sample before it, spread of gain and zero.

    `range`: least and greatest value it can show. All SI, gain_sd without unit.
    """

    step: Annotated[Real, Field(ge=0.0)]
    noise: Annotated[Real, Field(gt=0.0)]
    gain_sd: Annotated[Real, Field(gt=0.0)]
    zero_sd: Annotated[Real, Field(gt=0.0)]
    range: Annotated[tuple[Real, Real], BeforeValidator(_pair)]

    @model_validator(mode="after")
    def ordered(self) -> "SensorSpec":
        """Refuse a range that is empty."""
        if not self.range[0] < self.range[1]:
            raise ValueError("range: the first number must be below the second")
        return self


G = 9.80665
PSI = 6894.757
SHEETS: dict[str, dict[str, Any]] = {
    # Steps: paper, "Construction of the hydraulic rig". Gain, zero, noise: docs/spec.md.
    "load": {
        "step": 295.0,
        "noise": 295.0 / 2,
        "gain_sd": 1e-3,
        "zero_sd": 100.0,
        "range": (-3.3e5, 3.3e5),
    },
    "stroke": {
        "step": 0.22e-3,
        "noise": 0.22e-3 / 4,
        "gain_sd": 1e-3,
        "zero_sd": 0.12e-3,
        "range": (-0.01, 0.4),
    },
    "pressure": {
        "step": 5 * PSI,
        "noise": 5 * PSI / 3,
        "gain_sd": 1e-3,
        "zero_sd": 0.25e5,
        "range": (-1e5, 750e5),
    },
    "acceleration": {
        "step": 0.0,
        "noise": 0.35,
        "gain_sd": 1e-2,
        "zero_sd": 0.05,
        "range": (-200 * G, 200 * G),
    },
}


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
            name: {**SHEETS[name], **sheet}
            if name in SHEETS and isinstance(sheet, Mapping)
            else sheet
            for name, sheet in given.items()
        }

    def __getitem__(self, quantity: str) -> SensorSpec:
        """Sheet of a quantity."""
        return getattr(self, quantity)


class SamplerSpec(Value):
    """How long and how wide to sample; `walkers` 0 chooses by the number of parameters."""

    seed: Annotated[Whole, Field(ge=0)] = 1
    ensembles: Annotated[Whole, Field(ge=2)] = 4
    walkers: Annotated[Whole, Field(ge=0, multiple_of=2)] = 0
    starts: Annotated[Whole, Field(ge=1)] = 16
    r_hat: Annotated[Real, Field(gt=1.0)] = 1.01
    ess: Annotated[Real, Field(gt=0.0)] = 1000.0
    max_steps: Annotated[Whole, Field(ge=100)] = 20000
    block: Annotated[Whole, Field(ge=10)] = 100

    @model_validator(mode="after")
    def two_blocks(self) -> "SamplerSpec":
        """Refuse a chain of a single block: the first one is warm-up."""
        if self.max_steps < 2 * self.block:
            raise ValueError(
                f"max_steps is {self.max_steps}; it must be at least two blocks, {2 * self.block}"
            )
        return self


class BandsSpec(Value):
    """Where the posterior lies that bands are made from."""

    posterior: Path


class SpecBody(Value):
    """The spec as its file has it."""

    title: str = ""
    simulated: Flag = False
    rig: RigSpec = RigSpec()
    model: ModelSpec = ModelSpec()
    priors: Mapping[str, LawSpec] = {}
    sensors: SensorsSpec = SensorsSpec()
    records: tuple[RecordSpec, ...] = ()
    bands: BandsSpec | None = None
    sampler: SamplerSpec = SamplerSpec()

    @model_validator(mode="after")
    def told_apart(self) -> "SpecBody":
        """Refuse a record that stands twice, and one name for runs of two kinds."""
        seen: set[tuple[str, str]] = set()
        kinds: dict[str, str] = {}
        for r in self.records:
            if (r.name, r.cylinder) in seen:
                raise ValueError(
                    f"records: '{r.name}' on cylinder {r.cylinder} stands twice; "
                    "give one of them another name"
                )
            seen.add((r.name, r.cylinder))
            if kinds.setdefault(r.name, r.kind) != r.kind:
                raise ValueError(
                    f"records: '{r.name}' is a {kinds[r.name]} on one cylinder and a {r.kind} on "
                    "another; one name is one run, give one of them another name"
                )
        return self


class Spec(SpecBody):
    """A spec read from `path`; `text` is the file as it stands."""

    path: Path
    text: str

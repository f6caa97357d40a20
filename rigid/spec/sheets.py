"""What the sheets of the sensors say, and what they say where a spec is silent."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from rigid.spec.base import Real, Value


def _pair(given: Any) -> Any:
    """Refuse what is no list of two."""
    if not isinstance(given, (list, tuple)) or len(given) != 2:
        raise ValueError("must be two numbers, as in [-3.3e5, 3.3e5]")
    return given


def _none_required(schema: dict[str, Any]) -> None:
    """Tell of a JSON Schema that what a file leaves out is filled from SHEETS."""
    del schema["required"]


class SensorSpec(Value):
    """A sensor's sheet: converter `step`, `noise` of a sample before it, spread of gain and zero.

    `range`: least and greatest value it can show. All SI, gain_sd without unit.
    """

    step: Annotated[Real, Field(ge=0.0)]
    noise: Annotated[Real, Field(gt=0.0)]
    gain_sd: Annotated[Real, Field(ge=0.0)]
    zero_sd: Annotated[Real, Field(ge=0.0)]
    range: Annotated[tuple[Real, Real], BeforeValidator(_pair)]

    model_config = ConfigDict(json_schema_extra=_none_required)

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
    "load": dict(step=295.0, noise=295.0 / 2, gain_sd=1e-3, zero_sd=100.0, range=(-3.3e5, 3.3e5)),
    "stroke": dict(
        step=0.22e-3, noise=0.22e-3 / 4, gain_sd=1e-3, zero_sd=0.12e-3, range=(-0.01, 0.4)
    ),
    "pressure": dict(
        step=5 * PSI, noise=5 * PSI / 3, gain_sd=1e-3, zero_sd=0.25e5, range=(-1e5, 750e5)
    ),
    "acceleration": dict(
        step=0.0, noise=0.35, gain_sd=1e-2, zero_sd=0.05, range=(-200 * G, 200 * G)
    ),
}
OTHER_SHEETS: dict[str, dict[str, Any]] = {
    # Of machines that are not known here: a spec has to state the rest.
    "force": {"step": 0.0, "range": (-1e9, 1e9)},
    # A position of a motion enters as it was read; only its range is looked at.
    "position": {"step": 0.0, "noise": 1e-6, "gain_sd": 0.0, "zero_sd": 0.0, "range": (-1e3, 1e3)},
    # A command is given, not measured.
    "command": {"step": 0.0, "noise": 1e-9, "gain_sd": 0.0, "zero_sd": 0.0, "range": (-1e3, 1e3)},
}


class SensorsSpec(Value):
    """Sheets of the sensors; what a spec leaves out keeps the defaults, but `force` has none."""

    load: SensorSpec = SensorSpec(**SHEETS["load"])
    stroke: SensorSpec = SensorSpec(**SHEETS["stroke"])
    pressure: SensorSpec = SensorSpec(**SHEETS["pressure"])
    acceleration: SensorSpec = SensorSpec(**SHEETS["acceleration"])
    position: SensorSpec = SensorSpec(**OTHER_SHEETS["position"])
    command: SensorSpec = SensorSpec(**OTHER_SHEETS["command"])
    force: SensorSpec | None = None

    @model_validator(mode="after")
    def behind_the_low_pass(self) -> "SensorsSpec":
        """Refuse a converter step of the force: filtered, its readings are no codes any more."""
        if self.force is not None and self.force.step > 0.0:
            raise ValueError(
                "force: step: the low-pass of a motion leaves none; leave it out, it counts as "
                "noise of step/sqrt(12)"
            )
        return self

    @model_validator(mode="before")
    @classmethod
    def completed(cls, given: Any) -> Any:
        """Fill what a sheet leaves out."""
        if not isinstance(given, Mapping):
            return given
        known = SHEETS | OTHER_SHEETS
        return {
            name: {**known[name], **sheet}
            if name in known and isinstance(sheet, Mapping)
            else sheet
            for name, sheet in given.items()
        }

    def __getitem__(self, quantity: str) -> SensorSpec:
        """Sheet of a quantity; the force's is there wherever a record reads one."""
        return self.stated[quantity]

    @property
    def stated(self) -> dict[str, SensorSpec]:
        """The sheets that there are, by quantity."""
        sheets = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: sheet for name, sheet in sheets.items() if sheet is not None}

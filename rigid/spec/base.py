"""What all parts of a spec are made of: frozen values and strict numbers."""

import math
from collections.abc import Mapping
from functools import partial
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

from rigid.io.errors import quoted

LARGEST = 1e30
"""Of any number in a spec, SI."""

Real = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST)]
"""A number; neither a text that looks like one nor true or false."""
Whole = Annotated[int, Field(strict=True)]
Flag = Annotated[bool, Field(strict=True)]


class Value(BaseModel):
    """Base of all parts of a spec: immutable, unknown keys refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Known(Value):
    """A number with its uncertainty (1 sd), in SI; an sd of 0 is exact."""

    value: Real
    sd: Annotated[Real, Field(ge=0.0)] = 0.0


def is_number(given: Any) -> bool:
    """Whether TOML gave a number; true and false are none, though Python counts them in.

    Nor is a whole number that no float can hold.
    """
    if isinstance(given, int):
        return not isinstance(given, bool) and abs(given) <= LARGEST
    return isinstance(given, float)


def is_finite(given: Any) -> bool:
    """Whether TOML gave a finite number."""
    return is_number(given) and math.isfinite(given)


def _known(given: Any, share: float = 0.0) -> Any:
    """Take a number whose sd is not stated as uncertain by a `share` of it."""
    if is_number(given):
        given = {"value": given}
    if isinstance(given, Mapping) and "sd" not in given and is_finite(given.get("value")):
        return {**given, "sd": share * abs(given["value"])}
    if not isinstance(given, (Mapping, Known)):
        raise ValueError(
            "must be a number, or one with its sd, { value = ..., sd = ... }; "
            f"found {quoted(given)}"
        )
    return given


def _positive(known: Known) -> Known:
    if known.value <= 0.0:
        raise ValueError(f"must be above 0; found {known.value:g}")
    return known


def within(low: float, high: float, unit: str) -> AfterValidator:
    """Refuse a number outside a physical range, and an sd that is larger than the number."""

    def check(known: Known) -> Known:
        if not low <= known.value <= high:
            raise ValueError(f"must lie between {low:g} and {high:g} {unit}; found {known.value:g}")
        if known.sd > known.value:
            raise ValueError(
                f"sd must be at most the value itself, {known.value:g} {unit}; found {known.sd:g}"
            )
        return known

    return AfterValidator(check)


def uncertain(share: float) -> BeforeValidator:
    """Mark a number whose sd is `share` of it where a spec states none."""
    return BeforeValidator(partial(_known, share=share), json_schema_input_type=float | Known)


POSITIVE = AfterValidator(_positive)
Number = Annotated[Known, BeforeValidator(_known, json_schema_input_type=float | Known)]
"""A number that is exact where a spec states no sd."""

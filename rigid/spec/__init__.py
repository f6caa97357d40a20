"""A fit as its user states it: TOML in, frozen values out."""

from rigid.spec.read import find_spec, load_spec
from rigid.spec.values import (
    BandsSpec,
    ChannelSpec,
    Known,
    LawSpec,
    ModelSpec,
    RecordSpec,
    RigSpec,
    SamplerSpec,
    SensorSpec,
    Spec,
    Stretch,
)

__all__ = [
    "BandsSpec",
    "ChannelSpec",
    "Known",
    "LawSpec",
    "ModelSpec",
    "RecordSpec",
    "RigSpec",
    "SamplerSpec",
    "SensorSpec",
    "Spec",
    "Stretch",
    "find_spec",
    "load_spec",
]

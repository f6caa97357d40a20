"""A fit as its user states it: TOML in, frozen values out."""

from rigid.spec.base import Known
from rigid.spec.published import Printed, PublishedSpec
from rigid.spec.read import find_spec, load_spec, parse_spec
from rigid.spec.record import ChannelSpec, DefectName, RecordSpec, Stretch
from rigid.spec.rig import RigSpec
from rigid.spec.sheets import SensorSpec
from rigid.spec.values import BandsSpec, ModelSpec, PriorSpec, SamplerSpec, Spec

__all__ = [
    "BandsSpec",
    "ChannelSpec",
    "DefectName",
    "Known",
    "ModelSpec",
    "Printed",
    "PriorSpec",
    "PublishedSpec",
    "RecordSpec",
    "RigSpec",
    "SamplerSpec",
    "SensorSpec",
    "Spec",
    "Stretch",
    "find_spec",
    "load_spec",
    "parse_spec",
]

"""Measured runs: read from a logger's file, checked, immutable."""

from rigid.records.read import read_record, read_records
from rigid.records.record import Channel, Record

__all__ = ["Channel", "Record", "read_record", "read_records"]

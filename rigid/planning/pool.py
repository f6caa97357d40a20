"""The records that candidates are like: the spec's own, and those of other specs that it names."""

import dataclasses
from typing import NamedTuple

from rigid.io.errors import InputError
from rigid.planning.change import name_of
from rigid.records.read import read_records
from rigid.records.record import Record
from rigid.spec import Spec, load_spec
from rigid.spec.record import RecordSpec
from rigid.spec.sentences import unknown
from rigid.spec.values import PlanRecordSpec


class Pool(NamedTuple):
    """A spec and its records, with those of other specs that candidates are like."""

    spec: Spec
    records: tuple[Record, ...]


def pool(spec: Spec, records: tuple[Record, ...]) -> Pool:
    """Add the records of other specs that a spec's [plan] names, under names that say so.

    Raises InputError for a spec or a record that is not there, or records that cannot be read.
    """
    specs: list[RecordSpec] = []
    found: list[Record] = []
    for one in () if spec.plan is None else spec.plan.records:
        if one.spec is None or any(r.name == name_of(one) for r in specs):
            continue
        more, read = _of_another(spec, one)
        specs += more
        found += read
    listed = spec.model_copy(update={"records": (*spec.records, *specs)})
    return Pool(listed, (*records, *found))


def _of_another(spec: Spec, one: PlanRecordSpec) -> tuple[list[RecordSpec], list[Record]]:
    """A record of another spec, as that spec states it and as it was read."""
    assert one.spec is not None  # asked for
    other = load_spec(spec.path.parent / one.spec)
    mine = tuple(r for r in other.records if r.fit and r.name == one.like)
    if not mine:
        names = sorted({r.name for r in other.records if r.fit})
        where = f"{spec.path} [[plan.records]] like"
        raise InputError(f"{where}: {unknown('record', one.like, names)} in {other.path}")
    named = {"name": name_of(one)}
    read = read_records(other.model_copy(update={"records": mine}))
    return (
        [r.model_copy(update=named) for r in mine],
        [_renamed(r, name_of(one)) for r in read],
    )


def _renamed(record: Record, name: str) -> Record:
    return dataclasses.replace(record, name=name)

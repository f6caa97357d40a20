"""The tests of a spec whose load is sought."""

import numpy as np

from rigid.io.errors import InputError
from rigid.kinds import kinds_with
from rigid.records.read import read_records
from rigid.records.record import Record
from rigid.smoothing.field import Field
from rigid.smoothing.machine_records import make_test
from rigid.smoothing.rig_records import make_field
from rigid.spec import Spec

SOUGHT = kinds_with("ice")
"""Kinds of records whose load is sought."""


def read_fields(spec: Spec) -> tuple[tuple[Field, ...], ...]:
    """Read a spec's tests, in its order: each as its cylinders, or as one machine.

    Raises InputError with the problems of all records, or where there are none, or where the
    cylinders of a run do not share their sample times.
    """
    runs: dict[str, list[Record]] = {}
    for record in read_records(spec, kinds=SOUGHT):
        runs.setdefault(record.name, []).append(record)
    if not runs:
        kind = "field" if spec.machine is None else "test"
        raise InputError(f"{spec.path}: has no record of kind '{kind}'; bands need one at least")
    tests: list[tuple[Field, ...]] = []
    problems = []
    for records in runs.values():
        try:
            tests.append(_fields(spec, records) if spec.machine is None else
                         (make_test(spec, records),))  # fmt: skip
        except InputError as error:
            problems.append(str(error))
    if problems:
        raise InputError("\n".join(problems))
    return tuple(tests)


def _fields(spec: Spec, records: list[Record]) -> tuple[Field, ...]:
    """The cylinders of one test of the rig."""
    fields, problems = [], []
    for record in records:
        try:
            fields.append(make_field(record, spec.sensors))
        except InputError as error:
            problems.append(str(error))
    if problems:
        raise InputError("\n".join(problems))
    name, first = fields[0].name, fields[0]
    if len(fields) > 2:
        raise InputError(
            f"{spec.path}: field record '{name}' has {len(fields)} cylinders; at most two"
        )
    for other in fields[1:]:
        same = first.samples == other.samples and np.isclose(first.interval, other.interval)
        if not (same and abs(first.first - other.first) < 0.5 * first.interval):
            raise InputError(
                f"{spec.path}: cylinders {first.place} and {other.place} of field record '{name}' "
                "do not share their sample times; cut them with `rows`, or give them names of "
                "their own"
            )
    return tuple(fields)

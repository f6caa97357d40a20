"""The greatest load of a test as a quantity that a next record is to tell."""

import dataclasses
import re
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from rigid.inference.calibrate import Asked
from rigid.inference.derived import values_of
from rigid.inference.newton import expanded, is_noise, joined
from rigid.inference.search import Found
from rigid.io.errors import InputError
from rigid.likelihood.assemble import sheets
from rigid.likelihood.problem import Problem
from rigid.planning.quantity import Quantity
from rigid.smoothing.field import Field
from rigid.smoothing.laws import RigModel
from rigid.smoothing.peaks import PEAK_UNIT, Peaks, peaks
from rigid.smoothing.reading import read_fields
from rigid.smoothing.run import learned, ways
from rigid.spec import Spec, load_spec
from rigid.spec.sentences import unknown

NAME = re.compile(r"peak_load\[(?P<test>[^,\]]+)(?:,(?P<place>[^\]]+))?\]")
SHIFT = 0.5
"""Of a posterior sd: by so much a number is moved either way for the slope of the peak."""
COPIES = 32
"""Draws of what noise and the load's own movement leave open."""


@dataclasses.dataclass(frozen=True)
class Sought:
    """A test whose greatest load is asked for: records of it, and the place of the load."""

    spec: Spec
    fields: tuple[Field, ...]
    place: str


def sought(asked: Asked, name: str) -> Sought | None:
    """Return the test that a quantity names; None where it is no peak load.

    Raises InputError where there is no such test or place, or the tests are of another rig.
    """
    parts = NAME.fullmatch(name)
    if parts is None:
        return None
    spec, where = asked.spec, f"{asked.spec.path} [plan]: {name}"
    if spec.plan is not None and spec.plan.tests is not None:
        other = load_spec(spec.path.parent / spec.plan.tests)
        same = (other.rig, other.machine, other.model.effects, other.sensors)
        if same != (spec.rig, spec.machine, spec.model.effects, spec.sensors):
            raise InputError(
                f"{where}: {other.path} has another rig, other effects or other sensors than "
                f"{spec.path}; they have to be the same"
            )
        spec = other
    tests = {fields[0].name: fields for fields in read_fields(spec)}
    if parts["test"] not in tests:
        raise InputError(f"{where}: {unknown('test', parts['test'], tests)}")
    fields = tests[parts["test"]]
    places = [place for field in fields for place in field.setup.inputs.loads]
    places = ["total", *places] if len(places) > 1 else places
    place = parts["place"] or places[0]
    if place not in places:
        raise InputError(f"{where}: {unknown('place', place, places)}")
    return Sought(spec, fields, place)


def peak_load(
    test: Sought, found: Found, seed: int, report: Callable[[int], None] = lambda _: None
) -> Quantity:
    """Return the greatest load of a test, in proportion to what a fit's numbers change around it.

    - `found`: the search of the calibration. - `report(1)`: after each block of a record.

    Slopes are differences over a posterior sd at the best fit. What sensors of the test that the
    calibration never read, noise and the load's own movement leave open stays.
    """
    problem, best = found.problem, found.optima[0]
    free, noise = ~is_noise(problem), best.z[is_noise(problem)]
    w = joined(problem, best.z, best.standard)
    known = np.asarray(expanded(problem, w, noise).information)
    sds = np.sqrt(np.diag(np.linalg.inv(known)))
    steps = SHIFT * np.diag(sds)
    ends = np.concatenate([np.tile(w, (COPIES, 1)), w + steps, w - steps])
    law = _law(test, problem, ends, best.z)
    here = law.only(np.arange(1))
    [way] = ways(test.fields, [learned(test.spec, test.fields, here, report)], [law])
    loads: Peaks = peaks(way, seed, report)[test.place]
    centre, (up, down) = loads.mean[0], np.split(loads.mean[COPIES : COPIES + 2 * len(w)], 2)
    slopes = (up - down) / (2.0 * SHIFT * sds)
    unread = 0.5 * (loads.mean[COPIES + 2 * len(w) :: 2] - loads.mean[COPIES + 2 * len(w) + 1 :: 2])
    stays = float(loads.drawn[:COPIES].var(ddof=1) + unread @ unread)
    count, origin = int(free.sum()), best.z[free]

    def values(z: Float[np.ndarray, "n size"]) -> Float[np.ndarray, " n"]:
        return centre + (z[:, free] - origin) @ slopes[:count]

    return Quantity(values, PEAK_UNIT, slopes[count:], stays)


def _law(test: Sought, problem: Problem, w: np.ndarray, z: np.ndarray) -> RigModel:
    """The rig at points w (n, ends), and at the first with each unread sensor an sd off."""
    spread = {p.sensor(i): p.sheet.spread for p in problem.pieces for i in range(len(p.tracks))}
    channels = [c for field in test.fields for c in field.setup.channels]
    unread = [c for c in channels if c.label not in spread]
    more = 4 * len(unread)
    every = np.concatenate([w, np.tile(w[0], (more, 1))])
    full = np.tile(z, (len(every), 1))
    free = ~is_noise(problem)
    full[:, free] = every[:, : int(free.sum())]
    values = {label: np.asarray(v) for label, v in values_of(problem, full).items()}
    standard = every[:, int(free.sum()) :].reshape(len(every), -1, 2)
    sensors: dict[str, dict[str, np.ndarray]] = {"gain": {}, "zero": {}}
    for number, label in enumerate(problem.sensors):
        for at, (name, one) in enumerate(sensors.items()):
            one[f"{name}[{label}]"] = spread[label][at] * standard[:, number, at]
    listed = sheets(test.spec)
    for number, one in enumerate(unread):
        sheet, first = listed[one.quantity], len(w) + 4 * number
        for at, (name, sd) in enumerate((("gain", sheet.gain_sd), ("zero", sheet.zero_sd))):
            shifts = np.zeros(len(every))
            shifts[first + 2 * at : first + 2 * at + 2] = sd, -sd
            sensors[name][f"{name}[{one.label}]"] = shifts
        values.setdefault(f"noise[{one.label}]", np.full(len(every), sheet.noise))
    labels = {name: tuple(one) for name, one in sensors.items()}
    values |= sensors["gain"] | sensors["zero"]
    return RigModel("best fit", 1.0, problem.effects, values, labels, "", test.spec.machine)

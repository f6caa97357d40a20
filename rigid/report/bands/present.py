"""From bands to what their section of the page shows."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rigid.plots.metrology import digits, median_and_interval
from rigid.report import made as provenance
from rigid.report import wording
from rigid.report.bands import figures
from rigid.report.bands.output import unit
from rigid.report.bands.section import (
    KIND,
    OF_A_MACHINE,
    OF_THE_RIG,
    Banded,
    BandsContent,
    FieldContent,
    FieldShown,
)
from rigid.report.content import BAD, GOOD, Answer, Check, Front
from rigid.report.gallery import hang
from rigid.report.taken import sentences
from rigid.smoothing.budget import PARTS, Line
from rigid.smoothing.events import Fall, Turn, falls, turns
from rigid.smoothing.field import Field
from rigid.smoothing.finished import Finished
from rigid.smoothing.run import Bands
from rigid.spec import Spec
from rigid.spec.values import BandsSpec

RIG = "field"
"""Kind of the records of the rig; those of a machine are tests."""

ASKED = "What load did the ice carry, and how far did the plate move?"
ASKED_OF_A_MACHINE = "What load did the machine work against, and how far did it move?"

LED = ("peak load", "load at failure", "displacement at peak")
"""Numbers of the budget that stand on the first screen."""

NEXT = {
    "residuals": "Run `rigid discover` on the calibration: what is missing from the rig goes into "
    "the load.",
    "posterior": "Mend the calibration first: `rigid fit` says which check failed and what to do.",
    "solver": "The steps of the smoother do not hold for this rig: look for an effect that is "
    "stiff or does not change smoothly, and leave it out of the bands. Where the load falls within "
    "a sampling interval: sample faster than the rig swings.",
}
"""What to do when a check fails, by its name."""


def finished(found: Bands, simulated: bool, folder: Path) -> Finished:
    """Draw the figures of a test and keep what is told of it; its series are let go.

    - `folder`: of the page; the figures' files are written to `figures/` in it.
    """
    pairs = list(zip(found.test.fields, found.test.learned, strict=True))
    dropped = tuple(fall for f, one in pairs for fall in falls(f, one))
    moved = tuple(turn for f, one in pairs for turn in turns(f, one))
    seen = shown(found, simulated, dropped, moved)
    return Finished(
        name=found.name,
        places=_places(found),
        budget=found.budget,
        falls=dropped,
        turns=moved,
        gaps={
            f"{f.setup.channels[i].quantity} of {f.name},{f.setup.channels[i].place}": float(
                one.gap[i]
            )
            for f, one in pairs
            for i in f.setup.read
        },
        sha256={place: mark for f in found.test.fields for place, mark in f.files.items()},
        aside=found.aside,
        kind=found.test.fields[0].kind,
        figures=tuple(one for _, one in reversed(hang(figures, seen, KIND.name, folder))),
    )


def content(
    spec: Spec, made: dict[str, Any], found: Sequence[Finished], draws: int
) -> BandsContent:
    """Gather the section; `made` is what goes to JSON."""
    assert spec.bands is not None  # the command has asked for it
    checks = tuple(Check(**c) for c in made["checks"])
    return BandsContent(
        title=spec.title or spec.path.stem,
        simulated=spec.simulated,
        front=front(made["usable"], checks, found),
        provenance=provenance.made(spec, made["seed"], made["sha256"].items()),
        checks=checks,
        taken=sentences(made),
        drawn=tuple(
            (f"record-{number}", one)
            for number, test in enumerate(found, start=1)
            for one in test.figures
        ),
        heads=PARTS,
        records=tuple(_record(one) for one in found),
        draws=draws,
        laws=len(spec.bands.sources),
        posterior=_posteriors(spec.bands),
        machine=spec.machine is not None,
    )


def front(usable: bool, checks: Sequence[Check], found: Sequence[Finished]) -> Front:
    """Question, peak loads, whether they may be used, what to do."""
    failed = [one for one in checks if not one.ok]
    return Front(
        asked=ASKED if all(one.kind == RIG for one in found) else ASKED_OF_A_MACHINE,
        state=GOOD if usable else BAD,
        ruling=wording.verdict(usable, checks),
        why=tuple(f"{one.name}: {one.says}" for one in failed),
        answers=tuple(answer for one in found for answer in answers(one)),
        cannot=(
            "The load between samples: an event shorter than the interval of the records shows in "
            "none of them.",
        ),
        next=tuple(NEXT.get(one.name, f"See the check `{one.name}`.") for one in failed),
        figure=found[0].figures[0].key.removeprefix(f"fig-{KIND.name}-") if found else "",
    )


def answers(found: Finished) -> tuple[Answer, ...]:
    """Peak load, load at failure and displacement of a test as a whole, largest part named."""
    whole = "total" if found.kind == RIG and len(found.places) > 1 else ""
    at = "cylinder" if found.kind == RIG else "joint"
    return tuple(
        Answer(
            f"{line.name}, record {found.name}"
            + ("" if line.place == whole else f", {at} {line.place}"),
            median_and_interval((line.q05, line.median, line.q95), line.unit),
            _most(line),
        )
        for line in found.budget
        if whole in ("", line.place) and line.name in LED
    )


def _most(line: Line) -> str:
    """The largest part of a number's uncertainty."""
    parts = [(value, name) for value, name in zip(line.parts, PARTS, strict=True) if value]
    if not parts:
        return ""
    value, name = max(parts)
    return f"most of its uncertainty: {name}, {digits(value, line.unit)} (1 sd)"


def _posteriors(named: BandsSpec) -> str:
    """The posterior's file, or those of several laws with their probabilities."""
    if named.posterior is not None:
        return named.posterior.name
    return ", ".join(f"{path.parent.name}/{path.name} ({p:.3g})" for path, p in named.sources)


def _record(found: Finished) -> FieldContent:
    files = (
        (f"bands/{found.name}.csv", "median and quantiles over time"),
        (f"bands/{found.name}-parts.csv", "standard deviations over time by their cause"),
    )
    return FieldContent(found.name, tuple(found.budget), _events(found), files)


def _events(found: Finished) -> tuple[str, ...]:
    out = []
    at = "Cylinder" if found.kind == RIG else "Joint"
    for place in found.places:
        for turn in (turn for turn in found.turns if turn.cylinder == place):
            out.append(
                f"{at} {place}: the valve moved at {turn.time:.2f} s, κ went from "
                f"{_thousandths(turn.before)} to {_thousandths(turn.after)}."
            )
        dropped = [fall for fall in found.falls if fall.cylinder == place]
        if dropped:
            told = ", ".join(
                f"{digits(f.before, 'N', 3)} to {digits(f.after, 'N', 3)} at {f.time:.2f} s"
                for f in dropped
            )
            out.append(f"{at} {place}: the load fell from {told}.")
    return tuple(out)


def _thousandths(kappa: float) -> str:
    """To three places; a shut valve is no negative zero."""
    return f"{round(kappa, 3) + 0.0:.3f}"


def shown(
    found: Bands, simulated: bool, dropped: Sequence[Fall], moved: Sequence[Turn]
) -> FieldShown:
    """What the figures of a record show."""

    def banded(*names: str) -> tuple[Banded, ...]:
        return tuple(
            Banded(name.split("_", 1)[1], unit(name), found.bands[name].quantiles)
            for name in names
            if name in found.bands
        )

    fields = found.test.fields
    at = tuple(place for f in fields for place in f.setup.inputs.loads)
    whole = ("load_total",) if len(fields) > 1 else ()
    loads = banded(*(f"load_{place}" for place in at), *whole)
    instants: list[float] = []
    for fall in sorted(dropped, key=lambda fall: fall.after - fall.before):
        if all(abs(fall.time - other) > 0.2 for other in instants):
            instants.append(fall.time)
    return FieldShown(
        record=found.name,
        time=found.time,
        loads=loads,
        displacements=banded(*(f"displacement_{place}" for place in at)),
        kappas=banded(*(f"kappa_{place}" for f in fields for place in f.setup.inputs.flows)),
        readings=tuple(one for f in fields for one in _cells(f)),
        parts=tuple(zip(PARTS, found.bands[f"load_{loads[-1].place}"].parts, strict=True)),
        falls=tuple(instants),
        turns=tuple((turn.cylinder, turn.time) for turn in moved),
        simulated=simulated,
        words=OF_THE_RIG if all(f.kind == RIG for f in fields) else OF_A_MACHINE,
    )


def _cells(field: Field) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Where a load is sought, the times at which a load cell was read, and what it read."""
    time = field.first + field.interval * np.arange(field.samples)
    for number, one in enumerate(field.setup.channels):
        if one.quantity == "load" and one.place in field.setup.inputs.loads:
            known = field.known[:, number] > 0
            yield one.place, time, np.where(known, field.reading[:, number], np.nan)


def _places(found: Bands) -> tuple[str, ...]:
    """Cylinders or joints at which loads and flow fractions are sought."""
    inputs = [f.setup.inputs for f in found.test.fields]
    return tuple(dict.fromkeys(place for one in inputs for place in (*one.loads, *one.flows)))

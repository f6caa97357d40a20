"""From bands to what their section of the page shows."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from rigid import __version__
from rigid.plots.bands import Banded, FieldShown
from rigid.plots.metrology import significant
from rigid.report.bands.output import unit
from rigid.report.bands.section import BandsContent, BudgetRow, FieldContent, illustrations
from rigid.report.content import Check
from rigid.smoothing.budget import PARTS
from rigid.smoothing.events import Fall, Turn, falls, turns
from rigid.smoothing.finished import Finished
from rigid.smoothing.model import QUANTITIES
from rigid.smoothing.run import Bands
from rigid.spec import Spec
from rigid.spec.values import BandsSpec


def finished(found: Bands, simulated: bool) -> Finished:
    """Draw the figures of a test and keep what is told of it; its series are let go."""
    pairs = list(zip(found.test.fields, found.test.learned, strict=True))
    dropped = tuple(fall for f, one in pairs for fall in falls(f, one))
    moved = tuple(turn for f, one in pairs for turn in turns(f, one))
    return Finished(
        name=found.name,
        cylinders=tuple(f.cylinder for f in found.test.fields),
        budget=found.budget,
        falls=dropped,
        turns=moved,
        gaps={
            f"{quantity} of {f.label}": float(gap)
            for f, one in pairs
            for quantity, gap in zip(QUANTITIES, one.gap, strict=True)
        },
        sha256={f.label: f.sha256 for f in found.test.fields},
        figures=tuple(illustrations(shown(found, dropped, moved), simulated)),
    )


def content(
    spec: Spec, made: dict[str, Any], found: Sequence[Finished], draws: int
) -> BandsContent:
    """Gather the section; `made` is what goes to JSON."""
    assert spec.bands is not None  # the command has asked for it
    return BandsContent(
        title=spec.title or spec.path.stem,
        simulated=spec.simulated,
        usable=made["usable"],
        checks=tuple(Check(**c) for c in made["checks"]),
        heads=PARTS,
        records=tuple(_record(one) for one in found),
        draws=draws,
        laws=len(spec.bands.sources),
        posterior=_posteriors(spec.bands),
        command=f"python -m rigid.bands {spec.path.stem}",
        version=__version__,
        seed=made["seed"],
    )


def _posteriors(named: BandsSpec) -> str:
    """The posterior's file, or those of several laws with their probabilities."""
    if named.posterior is not None:
        return named.posterior.name
    return ", ".join(f"{path.parent.name}/{path.name} ({p:.3g})" for path, p in named.sources)


def _record(found: Finished) -> FieldContent:
    rows = tuple(BudgetRow(**vars(line)) for line in found.budget)
    drawn = (
        (f"bands/{found.name}.svg", "the whole test"),
        (f"bands/{found.name}-drops.svg", "its greatest drops"),
    )
    files = (
        *drawn[: len(found.figures)],
        (f"bands/{found.name}.csv", "median and quantiles over time"),
        (f"bands/{found.name}-parts.csv", "standard deviations over time by their cause"),
    )
    return FieldContent(found.name, found.figures, rows, _events(found), files)


def _events(found: Finished) -> tuple[str, ...]:
    out = []
    for cylinder in found.cylinders:
        for turn in (turn for turn in found.turns if turn.cylinder == cylinder):
            out.append(
                f"Cylinder {cylinder}: the valve moved at {turn.time:.2f} s, κ went from "
                f"{_thousandths(turn.before)} to {_thousandths(turn.after)}."
            )
        dropped = [fall for fall in found.falls if fall.cylinder == cylinder]
        if dropped:
            told = ", ".join(
                f"{significant(f.before, 'N')} to {significant(f.after, 'N')} at {f.time:.2f} s"
                for f in dropped
            )
            out.append(f"Cylinder {cylinder}: the load fell from {told}.")
    return tuple(out)


def _thousandths(kappa: float) -> str:
    """To three places; a shut valve is no negative zero."""
    return f"{round(kappa, 3) + 0.0:.3f}"


def shown(found: Bands, dropped: Sequence[Fall], moved: Sequence[Turn]) -> FieldShown:
    """What the figures of a record show."""

    def banded(*names: str) -> tuple[Banded, ...]:
        return tuple(
            Banded(name.split("_", 1)[1], unit(name), found.bands[name].quantiles)
            for name in names
            if name in found.bands
        )

    cylinders = [f.cylinder for f in found.test.fields]
    loads = banded(*(f"load_{c}" for c in cylinders), "load_total")
    instants: list[float] = []
    for fall in sorted(dropped, key=lambda fall: fall.after - fall.before):
        if all(abs(fall.time - other) > 0.2 for other in instants):
            instants.append(fall.time)
    return FieldShown(
        record=found.name,
        time=found.time,
        loads=loads,
        displacements=banded(*(f"displacement_{c}" for c in cylinders)),
        kappas=banded(*(f"kappa_{c}" for c in cylinders)),
        readings=tuple(
            (f.cylinder, f.first + f.interval * np.arange(f.samples), _known(f.reading, f.known))
            for f in found.test.fields
        ),
        parts=tuple(zip(PARTS, found.bands[f"load_{loads[-1].place}"].parts, strict=True)),
        falls=tuple(instants),
        turns=tuple((turn.cylinder, turn.time) for turn in moved),
    )


def _known(reading: np.ndarray, known: np.ndarray) -> np.ndarray:
    return np.where(known[:, 0] > 0, reading[:, 0], np.nan)

"""Bands of a study's field records: as files of a whole run, and as a data set of one record."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from shutil import rmtree
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import xarray as xr

from rigid.inference.posterior import save_posterior
from rigid.io.cache import NOTHING_KEPT, Shelf
from rigid.io.cli import Options
from rigid.io.errors import InputError
from rigid.io.files import plain, write_text
from rigid.io.progress import WRITE, say, stage
from rigid.report.bands import output
from rigid.report.bands.present import content, finished
from rigid.report.bands.section import KIND
from rigid.report.gallery import take_down
from rigid.report.section import write_report
from rigid.smoothing import kept, run
from rigid.smoothing.field import Field
from rigid.smoothing.finished import Finished
from rigid.smoothing.laws import RigModel, draws, read_laws, some
from rigid.smoothing.learning import Learned
from rigid.smoothing.mixture import LEVELS
from rigid.smoothing.reading import read_fields
from rigid.smoothing.reference_check import against_reference
from rigid.smoothing.smoother import Keeping
from rigid.spec import BandsSpec, Spec
from rigid.study.result import CommandResult

KEPT = "bands/unfinished"
"""Folder of what is known of each test, until the run is done."""

LONG_NAMES = {
    "load": "load on the ice",
    "displacement": "displacement of the plate",
    "kappa": "flow fraction",
    "tilt": "difference of the plate's displacements",
}

AT_JOINTS = {
    "load": "load",
    "displacement": "by how much the ends have come closer",
    "kappa": "flow fraction",
}

Fields = tuple[Field, ...]


@dataclass(frozen=True, eq=False)
class Smoothing:
    """Field tests, and what the rig may be.

    - `tests`: cylinders of each. - `laws`: with the draws to use. - `seed`.
    """

    spec: Spec
    tests: tuple[Fields, ...]
    laws: tuple[RigModel, ...]
    seed: int

    @property
    def names(self) -> list[str]:
        """Names of the tests."""
        return [fields[0].name for fields in self.tests]


@dataclass(frozen=True, eq=False)
class Written(CommandResult):
    """A run whose files are written: its tests, and all of bands.json."""

    tests: tuple[Finished, ...]
    result: Mapping[str, Any]

    def table(self) -> str:
        """What the command prints."""
        note = "simulated data\n" if self.result["simulated"] else ""
        return note + output.table(self.tests)


def smoothing(spec: Spec, seed: int) -> Smoothing:
    """Read posteriors and field records.

    Raises InputError where a posterior does not hold what a record asks for.
    """
    rng = np.random.default_rng([seed, 4])
    laws = tuple(some(law, spec, rng) for law in read_laws(spec, rng))
    tests = read_fields(spec)
    for field in (field for test in tests for field in test):
        for law in laws:
            draws(law, field)  # refuses what the posterior does not hold before any work is done
    return Smoothing(spec, tests, laws, seed)


def write_all(asked: Smoothing, folder: Path, options: Options) -> Written:
    """Make the bands of every field test and write all files."""
    if not options.resume:
        rmtree(folder / KEPT, ignore_errors=True)
        take_down(folder, KIND.name)
    tests = tuple(_written(asked, test, folder, options) for test in asked.tests)
    spec = asked.spec
    made = output.as_dict(spec.path.stem, spec.simulated, asked.seed, tests, asked.laws)
    found = Written(tests, plain(made))
    write_text(folder / "bands" / "bands.json", found.json())
    this = content(spec, made, list(tests), sum(law.size for law in asked.laws))
    with stage(options.quiet, WRITE):
        write_report(KIND, this, folder)
    rmtree(folder / KEPT, ignore_errors=True)
    return found


def _written(asked: Smoothing, fields: Fields, folder: Path, options: Options) -> Finished:
    """Make the bands of a test and write its files; gives what report and summary need of it."""
    name, mark = fields[0].name, kept.mark(fields, asked.laws, asked.seed)
    shelf = Shelf(folder / KEPT / name, mark, options.resume)
    done = shelf.read("finished", kept.FINISHED)
    if done is not None:
        say(options.quiet, f"{name}: taken from the run before")
        return done
    under = _ways(asked, fields, shelf, options)
    found = _mixed(asked, under, shelf, options)
    output.write_bands(folder / "bands", found)
    with stage(options.quiet, f"{name}: solve again by diffrax"):
        solver = against_reference(under, asked.spec.sensors)
    done = replace(finished(found, asked.spec.simulated, folder), solver=solver)
    shelf.clear()
    shelf.put("finished", done)
    return done


def _mixed(
    asked: Smoothing, under: tuple[run.Way, ...], shelf: Shelf, options: Options
) -> run.Bands:
    """Mix the draws of all laws into bands; `shelf`: keeps how far they are."""
    title = f"{under[0].test.fields[0].name}: draws"
    with stage(options.quiet, title, run.blocks(under), "blocks") as shown:
        return run.bands(under, asked.seed, Keeping(shelf, shown.add))


def _ways(asked: Smoothing, fields: Fields, shelf: Shelf, options: Options) -> tuple[run.Way, ...]:
    """Learn how the load of a test moves under each law; keep what is done."""
    with stage(options.quiet, f"{fields[0].name}: learning", None, "passes") as shown:

        def learned(law: RigModel) -> tuple[Learned, ...]:
            return run.learned(asked.spec, fields, law, shown.add)

        found = [
            shelf.once(f"learned-{number}", partial(learned, law), kept.LEARNED)
            for number, law in enumerate(asked.laws)
        ]
    return run.ways(fields, found, asked.laws)


def bands(
    spec: Spec, posterior: xr.DataTree | None, record: str | None, seed: int, options: Options
) -> xr.Dataset:
    """Bands of one field test.

    - `posterior`: of a fit, as in posterior.nc; None: those that the spec names in [bands].
    - `record`: name of the test; None where the spec has one alone.

    Raises InputError where there is no posterior or no such test.
    """
    with TemporaryDirectory(prefix="rigid-") as made:
        folder = Path(made)
        if posterior is not None:
            groups = {str(name): group.to_dataset() for name, group in posterior.children.items()}
            told = {str(name): value for name, value in posterior.attrs.items()}
            save_posterior(folder / "posterior.nc", groups, told)
            named = {"posterior": folder / "posterior.nc", "laws": ()}
            given = BandsSpec(posterior=folder) if spec.bands is None else spec.bands
            spec = spec.model_copy(update={"bands": given.model_copy(update=named)})
        asked = smoothing(spec, seed)
        under = _ways(asked, _one(asked, record), NOTHING_KEPT, options)
        return dataset(asked, _mixed(asked, under, NOTHING_KEPT, options))


def _one(asked: Smoothing, record: str | None) -> Fields:
    """The test that is asked for."""
    names = asked.names
    if record is None and len(names) == 1:
        return asked.tests[0]
    if record not in names:
        raise InputError(
            f"{asked.spec.path}: which field record? bands(record=...) takes {', '.join(names)}"
        )
    return asked.tests[names.index(record)]


def dataset(asked: Smoothing, found: run.Bands) -> xr.Dataset:
    """Quantiles of every quantity over time, and the parts of its standard deviation.

    `load_A` (quantile, time), `load_A_parts` (part, time), ..., in SI; attributes tell units, what
    it is, record, seed and whether the records are simulated.
    """
    variables = {}
    for name, band in found.bands.items():
        unit, said = output.unit(name), _long_name(name, asked.spec.machine is not None)
        variables[name] = (("quantile", "time"), band.quantiles, {"units": unit, "long_name": said})
        parts = {"units": unit, "long_name": f"standard deviation of {said} by source"}
        variables[f"{name}_parts"] = (("part", "time"), band.parts, parts)
    coords = {
        "time": ("time", found.time, {"units": "s", "long_name": "time of the record"}),
        "quantile": ("quantile", np.asarray(LEVELS), {"units": "1"}),
        "part": list(run.PART_NAMES),
    }
    attrs = {
        "record": found.name,
        "spec_name": asked.spec.path.stem,
        "simulated": int(asked.spec.simulated),
        "seed": asked.seed,
    }
    return xr.Dataset(variables, coords, attrs)


def _long_name(name: str, machine: bool) -> str:
    """What a quantity such as `load_A` is."""
    quantity, _, place = name.partition("_")
    if machine:
        return f"{AT_JOINTS[quantity]}, joint {place}"
    where = {"": "", "total": ", sum of the cylinders", "mean": ", mean of the cylinders"}
    return LONG_NAMES.get(quantity, quantity) + where.get(place, f", cylinder {place}")

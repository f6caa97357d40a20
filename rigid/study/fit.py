"""A finished fit: posterior, table, checks, figures and files."""

from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.figure import Figure

from rigid.inference.calibrate import Calibrated
from rigid.inference.posterior import data_tree
from rigid.inference.summary import Check, Result, write_result_json, write_summary_csv
from rigid.io.files import json_text
from rigid.plots.figure import Drawn
from rigid.report.calibration import figures, output
from rigid.report.calibration.figures import corner, friction, records, roots, traces
from rigid.report.calibration.for_paper import write_for_paper
from rigid.report.calibration.present import content
from rigid.report.calibration.section import KIND
from rigid.report.content import CalibrationContent
from rigid.report.gallery import modules
from rigid.report.section import write_report
from rigid.spec import Spec
from rigid.study.result import CommandResult


@dataclass(frozen=True, eq=False)
class Fit(CommandResult):
    """What a fit found.

    - `spec`; `calibrated`: all that the inference gave. - `wall_s`: time it took [s].
    """

    spec: Spec
    calibrated: Calibrated
    wall_s: float

    @cached_property
    def result(self) -> Result:
        """All of result.json: table, checks, gap, cost."""
        return output.result(self.spec, self.calibrated, self.wall_s)

    @property
    def checks(self) -> tuple[Check, ...]:
        """What must hold for the result to be used: name, whether it does, a sentence."""
        return tuple(self.result.checks)

    @property
    def usable(self) -> bool:
        """Whether every check holds."""
        return self.result.usable

    @property
    def taken(self) -> Mapping[str, Any]:
        """What was held exact and set aside."""
        return self.result.taken

    def json(self) -> str:
        """Text of result.json."""
        return json_text(self.result.values())

    def table(self) -> str:
        """What the command prints."""
        return output.table(self.result)

    def summary(self) -> pd.DataFrame:
        """Return the table of summary.csv, a row per parameter.

        R-hat is judged between ensembles, ESS with every walker a chain.
        """
        return pd.DataFrame([row.values() for row in self.result.parameters]).set_index("name")

    @cached_property
    def posterior(self) -> xr.DataTree:
        """All groups of posterior.nc: posterior, prior, predictions, log-likelihoods, data."""
        folder = self.spec.path.parent.resolve().as_posix()
        told = output.provenance(self.spec, self.calibrated, self.result) | {"spec_folder": folder}
        return data_tree(self._groups, told)

    @property
    def best(self) -> np.ndarray:
        """z (size,) of the best optimum of the search."""
        return self.calibrated.found.optima[0].z

    @property
    def plot(self) -> "Figures":
        """Figures of the report, drawn when they are asked for."""
        return Figures(content(self.spec, self.calibrated, self.result))

    def write(self, folder: Path | str, spec_folder: str | None = None) -> None:
        """Write posterior.nc, summary.csv, result.json and the report to a folder.

        - `spec_folder`: where the spec lies, seen from the place that the files will be moved to;
          None: they stay.
        """
        folder = Path(folder)
        # The library that writes it releases the interpreter: figures are drawn meanwhile.
        with ThreadPoolExecutor(max_workers=1) as beside:
            kept = beside.submit(
                output.write_posterior,
                folder / "posterior.nc",
                self.spec,
                self.calibrated,
                self.result,
                self._groups,
                spec_folder,
            )
            write_summary_csv(folder / "summary.csv", self.result.parameters)
            write_result_json(folder / "result.json", self.result)
            told = content(self.spec, self.calibrated, self.result)
            write_for_paper(told.paper, folder)
            write_report(KIND, told, folder)
            kept.result()

    @cached_property
    def _groups(self) -> Mapping[str, xr.Dataset]:
        return output.groups(self.calibrated, self.result.parameters)


@dataclass(frozen=True)
class Figures:
    """The figures of a report on a fit; each method draws one anew."""

    content: CalibrationContent

    def names(self) -> list[str]:
        """Return the names of all figures that this fit has, as `figure` takes them."""
        return [one.name for one in self._drawn()]

    def figure(self, name: str) -> Figure:
        """Draw one by its name.

        Raises LookupError where this fit has no such figure.
        """
        for one in self._drawn():
            if one.name == name:
                return one.figure
        raise LookupError(f"this fit has no figure '{name}'; it has {', '.join(self.names())}")

    def friction(self) -> Figure:
        """Friction over frequency, with its prior and the values a paper gives."""
        return self._one(friction)

    def corner(self) -> Figure:
        """Pairs of the main parameters."""
        return self._one(corner)

    def traces(self) -> Figure:
        """Ensemble means over steps, and rank histograms."""
        return self._one(traces)

    def roots(self) -> Figure:
        """Roots of the characteristic equation."""
        return self._one(roots)

    def record(self, name: str, cylinder: str = "A") -> Figure:
        """One record beside what the posterior says its sensors should read."""
        fits = tuple(c for c in self.content.fits if (c.record, c.cylinder) == (name, cylinder))
        if not fits:
            known = dict.fromkeys(f"{c.record},{c.cylinder}" for c in self.content.fits)
            raise KeyError(f"no record {name},{cylinder}; there are {', '.join(known)}")
        return next(records.drawn(replace(self.content, fits=fits))).figure

    def _one(self, module: ModuleType) -> Figure:
        """The figure of a file.

        Raises LookupError where this fit has none.
        """
        for one in module.drawn(self.content):
            return one.figure
        raise LookupError(f"this fit has no {module.__name__.rsplit('.', 1)[-1]} to draw")

    def _drawn(self) -> Iterator[Drawn]:
        for module in modules(figures):
            yield from module.drawn(self.content)

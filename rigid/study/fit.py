"""A finished fit: posterior, table, checks, figures and files."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TypeVar

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.figure import Figure

from rigid.inference.calibrate import Calibrated
from rigid.inference.posterior import data_tree
from rigid.inference.summary import Check, Result, write_result_json, write_summary_csv
from rigid.report.calibration import output
from rigid.report.calibration.present import content
from rigid.report.calibration.section import write_report
from rigid.report.content import CalibrationContent
from rigid.spec import Spec

Part = TypeVar("Part")


@dataclass(frozen=True, eq=False)
class Fit:
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

    def summary(self) -> pd.DataFrame:
        """Return the table of summary.csv, a row per parameter.

        R-hat is judged between ensembles, ESS with every walker a chain.
        """
        return pd.DataFrame([row.values() for row in self.result.parameters]).set_index("name")

    @cached_property
    def posterior(self) -> xr.DataTree:
        """All groups of posterior.nc: posterior, prior, predictions, log-likelihoods, data."""
        folder = self.spec.path.parent.resolve().as_posix()
        told = output.provenance(self.spec, self.calibrated) | {"spec_folder": folder}
        return data_tree(self._groups, told)

    @property
    def best(self) -> np.ndarray:
        """z (size,) of the best optimum of the search."""
        return self.calibrated.found.optima[0].z

    @property
    def plot(self) -> "Figures":
        """Figures of the report, drawn when they are asked for."""
        return Figures(content(self.spec, self.calibrated, self.result))

    def write(self, folder: Path | str) -> None:
        """Write posterior.nc, summary.csv, result.json and the report to a folder."""
        folder = Path(folder)
        output.write_posterior(
            folder / "posterior.nc", self.spec, self.calibrated, groups=self._groups
        )
        write_summary_csv(folder / "summary.csv", self.result.parameters)
        write_result_json(folder / "result.json", self.result)
        write_report(content(self.spec, self.calibrated, self.result), folder)

    @cached_property
    def _groups(self) -> Mapping[str, xr.Dataset]:
        return output.groups(self.calibrated, self.result.parameters)


@dataclass(frozen=True)
class Figures:
    """The figures of a report on a fit; each method draws one anew."""

    content: CalibrationContent

    def friction(self) -> Figure:
        """Friction over frequency, with its prior and the values a paper gives."""
        from rigid.plots.friction import friction_figure

        return friction_figure(_there(self.content.friction, "friction"), self._simulated)

    def corner(self) -> Figure:
        """Pairs of the main parameters."""
        from rigid.plots.corner import corner_figure

        return corner_figure(_there(self.content.draws, "draws to show"), self._simulated)

    def traces(self) -> Figure:
        """Ensemble means over steps, and rank histograms."""
        from rigid.plots.traces import trace_figure

        return trace_figure(self.content.traces, self._simulated)

    def roots(self) -> Figure:
        """Roots of the characteristic equation."""
        from rigid.plots.roots import roots_figure

        return roots_figure(_there(self.content.roots, "roots"), self._simulated)

    def record(self, name: str, cylinder: str = "A") -> Figure:
        """One record beside what the posterior says its sensors should read."""
        from rigid.plots.fits import record_figure

        shown = [c for c in self.content.fits if (c.record, c.cylinder) == (name, cylinder)]
        if not shown:
            known = dict.fromkeys(f"{c.record},{c.cylinder}" for c in self.content.fits)
            raise KeyError(f"no record {name},{cylinder}; there are {', '.join(known)}")
        return record_figure(shown, self._simulated)

    @property
    def _simulated(self) -> bool:
        return self.content.simulated


def _there(part: Part | None, name: str) -> Part:
    """Refuse a figure that a fit of this machine does not have."""
    if part is None:
        raise LookupError(f"this fit has no {name}")
    return part

"""Which record a study needs next."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from rigid.inference.calibrate import Asked, search_once
from rigid.inference.reference_check import POINTS, SolverCheck, solved_again
from rigid.inference.search_cache import Searched
from rigid.io.cli import Options
from rigid.io.files import write_text
from rigid.io.progress import stage
from rigid.planning.change import stated
from rigid.planning.pool import pool
from rigid.planning.quantity import quantity_of, usual
from rigid.planning.ranking import Fitted, Ranking, points_of, rank, weighed
from rigid.records.record import Record
from rigid.report.made import made as provenance
from rigid.report.plan.output import as_csv, as_dict
from rigid.report.plan.present import content, table
from rigid.report.plan.section import KIND
from rigid.report.section import write_report
from rigid.spec import Spec
from rigid.study.peak import peak_load, sought
from rigid.study.result import CommandResult


@dataclass(frozen=True, eq=False)
class Plan(CommandResult):
    """Records that could be taken, the worthiest first.

    - `spec`; `records`: as read. - `known`: their posterior. - `ranking`; `seed`.
    """

    spec: Spec
    records: tuple[Record, ...]
    known: Searched
    ranking: Ranking
    seed: int

    @cached_property
    def solver(self) -> SolverCheck | None:
        """The best fit and points of the posterior, solved again by diffrax."""
        found, rng = self.known.found, np.random.default_rng([self.seed, 4])
        points = points_of(self.known, rng, POINTS - 1)
        return solved_again(found.problem, np.concatenate([found.optima[0].z[None], points]))

    @cached_property
    def result(self) -> Mapping[str, Any]:
        """All of plan.json."""
        return as_dict(self.spec, self.known, self.solver, self.ranking, self.seed)

    def table(self) -> str:
        """What the command prints."""
        return table(dict(self.result))

    def summary(self) -> pd.DataFrame:
        """Return the table of plan.csv: expected sd by record, quantity and number of records."""
        rows = [
            {"record": one["record"], "cost": one["cost"], **told}
            for one in self.result["records"]
            for told in one["expected"]
        ]
        return pd.DataFrame(rows)

    def write(self, folder: Path) -> None:
        """Write plan.json, plan.csv and the report."""
        made = dict(self.result)
        write_text(folder / "plan.json", self.json())
        write_text(folder / "plan.csv", as_csv(made))
        read = [(r.path.name, r.sha256) for r in self.records]
        write_report(KIND, content(self.spec, made, provenance(self.spec, self.seed, read)), folder)


def plan(
    asked: Asked,
    quantities: tuple[str, ...],
    seed: int,
    options: Options,
    folder: Path,
) -> Plan:
    """Search, fit a law to the posterior, and rank records that could be taken.

    - `quantities`: names; empty: those of the spec, or the usual ones. - `folder`: keeps the
      search.

    Raises InputError for a quantity, a record or a setting that is not there.
    """
    spec, records, problem = asked.spec, asked.records, asked.problem
    given = () if spec.plan is None else spec.plan.quantities
    names = quantities or given or usual(problem)
    tests = {name: test for name in names if (test := sought(asked, name)) is not None}
    where = f"{spec.path} [plan]"
    values = {name: quantity_of(problem, name, where) for name in names if name not in tests}
    every = pool(spec, records)
    changes = stated(every.spec, problem)
    known = search_once(asked, options, folder)
    for name, test in tests.items():
        with stage(options.quiet, name, None, "passes") as shown:
            values[name] = peak_load(test, known.found, seed, shown.add)
    values = {name: values[name] for name in names}
    with stage(options.quiet, "weigh records", weighed(changes), "records") as shown:
        found = rank(Fitted(every.spec, every.records, known), values, changes, seed, shown.reach)
    return Plan(spec, records, known, found, seed)

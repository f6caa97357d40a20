"""Figures of each quantity, and the tables for people and programs: summary.csv, result.json."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigid.inference import convergence
from rigid.io.files import csv_text, json_text, plain, write_text

SCHEMA = 1
COLUMNS = (
    "name", "unit", "mean", "sd", "median", "q05", "q95", "ess_bulk", "ess_tail", "r_hat",
    "published",
)  # fmt: skip
FALSE_ALARMS = 0.003
"""Share of complete models of whose campaigns it may be said that something is missing. A user who
asks of a hundred such campaigns has an alarm or more with a chance of 26 %; at 0.01 it would be
63 %."""


@dataclass(frozen=True)
class Summary:
    """Figures of one quantity; q05 and q95 are its 5 % and 95 % quantiles.

    ess_bulk, ess_tail and r_hat are None for a quantity that is constant.
    """

    mean: float
    sd: float
    median: float
    q05: float
    q95: float
    ess_bulk: float | None
    ess_tail: float | None
    r_hat: float | None

    @classmethod
    def of_independent(cls, values: NDArray[np.float64]) -> "Summary":
        """Figures of draws, of any shape, that no chain made."""
        q05, median, q95 = (float(q) for q in np.quantile(values, (0.05, 0.5, 0.95)))
        mean, sd = float(np.mean(values)), float(np.std(values, ddof=1))
        return cls(mean, sd, median, q05, q95, None, None, None)


@dataclass(frozen=True)
class ParameterRow:
    """One row of the tables: `kappa[free-run-2,A]`, its unit, its figures, the published value."""

    name: str
    unit: str
    summary: Summary
    published: float | None = None

    def values(self) -> dict[str, Any]:
        """The row as columns of summary.csv."""
        flat = {
            "name": self.name, "unit": self.unit, **asdict(self.summary),
            "published": self.published,
        }  # fmt: skip
        return {column: plain(flat[column]) for column in COLUMNS}


@dataclass(frozen=True)
class Check:
    """One check of the report: did it hold, and a sentence that says what was found."""

    name: str
    ok: bool
    says: str

    def values(self) -> dict[str, Any]:
        """An entry of `checks` in the results."""
        return {"name": self.name, "ok": bool(self.ok), "says": self.says}


@dataclass(frozen=True)
class Gap:
    """Root mean square residual over what the sensors' sheets promise, overall and by channel.

    - records: record -> channel -> gap
    """

    overall: float | None
    records: Mapping[str, Mapping[str, float | None]]


@dataclass(frozen=True)
class Cost:
    """What the result took. Rates are those of the whole run, `wall_s`."""

    wall_s: float
    compile_s: float
    evaluations: int
    ess_min: float | None
    failed_solves: int

    def values(self) -> dict[str, Any]:
        """The entries of `cost` in result.json."""
        known = self.ess_min is not None and self.wall_s > 0
        return {
            "wall_s": self.wall_s,
            "compile_s": self.compile_s,
            "evaluations": self.evaluations,
            "evaluations_per_s": self.evaluations / self.wall_s if self.wall_s > 0 else None,
            "ess_min": self.ess_min,
            "ess_min_per_s": self.ess_min / self.wall_s if known and self.ess_min else None,
            "failed_solves": self.failed_solves,
        }


@dataclass(frozen=True)
class Result:
    """All of result.json. It is usable if every check holds.

    - `solver`: what the full solve by diffrax says of the fast one.
    - `preliminary`: whether it is that of the search, before the chain has run.
    - `taken`: entries `held_exact` and `set_aside`.
    """

    spec: str
    simulated: bool
    checks: Sequence[Check]
    parameters: Sequence[ParameterRow]
    gap: Gap
    cost: Cost
    seed: int
    versions: Mapping[str, str] = field(default_factory=dict)
    sha256: Mapping[str, str] = field(default_factory=dict)
    solver: Mapping[str, Any] | None = None
    preliminary: bool = False
    taken: Mapping[str, Any] = field(default_factory=dict)

    @property
    def usable(self) -> bool:
        """May the result be used as it stands."""
        return all(check.ok for check in self.checks)

    def values(self) -> dict[str, Any]:
        """The entries of result.json."""
        rows = {row.name: row.values() for row in self.parameters}
        told = {
            "schema": SCHEMA,
            "spec": self.spec,
            "usable": self.usable,
            "simulated": self.simulated,
            "checks": [check.values() for check in self.checks],
            "parameters": {
                name: {key: value for key, value in row.items() if key != "name"}
                for name, row in rows.items()
            },
            "gap": {"overall": self.gap.overall, "records": self.gap.records},
            "cost": self.cost.values(),
            "solver": self.solver,
            "seed": self.seed,
            "versions": self.versions,
            "sha256": self.sha256,
            **self.taken,
        }
        return plain(told | ({"preliminary": True} if self.preliminary else {}))


def summarise(
    values: NDArray[np.float64],
    ensemble: NDArray[np.integer],
    modes: NDArray[np.integer] | None = None,
) -> Summary:
    """Figures of one quantity.

    - values: (chain, draw), a chain for each walker
    - ensemble: (chain,), the ensemble each walker is of; R-hat is judged between ensembles
    - modes: (chain, draw), the mode each draw is in; then R-hat is judged within them, too

    Source: R-hat and ESS of Vehtari et al. (2021), "Rank-normalization, folding, and localization".
    """
    values = np.asarray(values, dtype=float)
    turned = _by_ensemble(values, ensemble)
    within = None if modes is None else _by_ensemble(modes, ensemble)
    found = convergence.diagnose("", turned, within)
    figures = Summary.of_independent(values)
    return replace(figures, ess_bulk=found.ess_bulk, ess_tail=found.ess_tail, r_hat=found.r_hat)


def _by_ensemble(values: NDArray[Any], ensemble: NDArray[np.integer]) -> NDArray[Any]:
    """(chain, draw) as (ensembles, steps, walkers)."""
    groups = [values[ensemble == label].T for label in np.unique(ensemble)]
    if len({group.shape for group in groups}) > 1:
        raise ValueError("ensembles differ in their number of walkers")
    return np.stack(groups)


def write_summary_csv(path: Path | str, rows: Sequence[ParameterRow]) -> None:
    """Write a row per parameter; what is not known stays empty."""
    write_text(path, csv_text(COLUMNS, (row.values().values() for row in rows)))


def write_result_json(path: Path | str, result: Result) -> None:
    """Write the result for programs; null stands for what is not known or not finite."""
    write_text(path, json_text(result.values()))

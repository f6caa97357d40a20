"""Finished runs as they lie in their folders, read for a comparison.

A run is a folder of results, or its posterior.nc or result.json. What a folder does not hold is
None here, and the page says so.
"""

import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Float

from rigid.inference.posterior import load_posterior
from rigid.io.errors import InputError
from rigid.io.files import MIB, read_bytes
from rigid.physics.sensors import UNITS
from rigid.plots.shown import QUANTILES

MOST_JSON = 256 * MIB
"""Of a file of results."""

OTHERS = {"discovery.json": "discover", "laws.json": "laws", "bands/bands.json": "bands"}
"""Files of other commands that a folder may hold, and the command."""


SENSORS = ("noise", "zero")
"""Numbers in the unit of what their sensor reads."""


@dataclass(frozen=True)
class Figures:
    """Figures of one parameter in one run, SI."""

    unit: str
    median: float
    sd: float
    q05: float
    q95: float


@dataclass(frozen=True, eq=False)
class Friction:
    """|mu| [N s/m] over frequency [Hz]: quantiles at `QUANTILES`, (5, frequencies)."""

    frequency: Float[np.ndarray, " m"]
    magnitude: Float[np.ndarray, "5 m"]


@dataclass(frozen=True, eq=False)
class Run:
    """One finished run.

    - `name`: unique among those compared. - `path`: as given.
    - `usable`: None where the folder does not tell. - `failed`: what its checks say against it.
    - `parameters`: figures by label. - `gaps`: by record, then channel; `overall`.
    - `spec`: the text of its spec; empty where it is not there. - `effects`.
    - `sha256`: digest by "record,cylinder". - `versions`, `seed`, `simulated`.
    - `friction`: None where there is none. - `others`: content of `OTHERS` that are there.
    - `notes`: what is missing, a sentence each.
    """

    name: str
    path: Path
    usable: bool | None = None
    failed: tuple[str, ...] = ()
    parameters: Mapping[str, Figures] = field(default_factory=dict)
    gaps: Mapping[str, Mapping[str, float | None]] = field(default_factory=dict)
    overall: float | None = None
    spec: str = ""
    spec_name: str = ""
    effects: tuple[str, ...] = ()
    sha256: Mapping[str, str] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)
    seed: int | None = None
    simulated: bool = False
    friction: Friction | None = None
    others: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def digests(self) -> frozenset[str]:
        """Digests of the records."""
        return frozenset(self.sha256.values())

    @property
    def values(self) -> Mapping[str, Any]:
        """The spec as nested values; empty where it is not there or not TOML."""
        try:
            return tomllib.loads(self.spec)
        except tomllib.TOMLDecodeError:
            return {}


def read_runs(paths: Sequence[Path]) -> tuple[Run, ...]:
    """Read the runs of a comparison, with a name for each.

    Raises InputError for fewer than two, for one that is given twice, and for what is no run.
    """
    if len(paths) < 2:
        raise InputError(
            f"{len(paths)} run given; a comparison takes two or more folders of results, as in "
            "`python -m rigid.compare reports/a reports/b`"
        )
    where = [path.resolve() for path in paths]
    for path in where:
        if where.count(path) > 1:
            raise InputError(f"{path}: given twice; name each run once")
    return tuple(
        replace(read_run(path), name=name) for path, name in zip(paths, _names(paths), strict=True)
    )


def _names(paths: Sequence[Path]) -> list[str]:
    """The least of each path that tells it from the others."""
    parts = [
        path.resolve().parts if path.is_dir() else path.resolve().parent.parts for path in paths
    ]
    for count in range(1, max(map(len, parts)) + 1):
        names = ["/".join(part[-count:]) for part in parts]
        if len(set(names)) == len(names):
            return names
    return [f"{'/'.join(part[-1:])} ({number})" for number, part in enumerate(parts, start=1)]


def read_run(path: Path) -> Run:
    """Read one run.

    Raises InputError for a path that is none, naming what was looked for.
    """
    if not path.exists():
        raise InputError(f"{path}: no such file or folder; give a folder that a command wrote to")
    folder = path if path.is_dir() else path.parent
    result = _json(folder / "result.json") if path.is_dir() or path.suffix == ".json" else None
    stored = folder / "posterior.nc" if path.is_dir() else path
    tree = load_posterior(stored) if stored.suffix == ".nc" and stored.is_file() else None
    others = {
        command: found
        for name, command in OTHERS.items()
        if path.is_dir() and (found := _json(folder / name)) is not None
    }
    if result is None and tree is None and not others:
        told = ", ".join(("result.json", "posterior.nc", *OTHERS))
        raise InputError(
            f"{path}: holds no result ({told} are looked for); give the folder that "
            "`python -m rigid.fit` wrote to"
        )
    run = Run(name=folder.name, path=path, others=others)
    if tree is not None:
        run = _with_posterior(run, tree)
    run = _with_result(run, result) if result is not None else run
    run = _with_bands(run, others["bands"]) if "bands" in others else run
    return replace(run, notes=tuple(_notes(run, result, tree)))


def _json(path: Path) -> Mapping[str, Any] | None:
    """A file of results; None where there is none."""
    if not path.is_file():
        return None
    try:
        found = json.loads(read_bytes(path, MOST_JSON).decode("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: no JSON, or damaged ({error}); run its command again") from None
    if not isinstance(found, dict):
        raise InputError(f"{path}: holds no table of results; run its command again")
    return found


def _with_posterior(run: Run, tree: xr.DataTree) -> Run:
    """What posterior.nc tells."""
    told = tree.attrs
    posterior = tree["posterior"].to_dataset()
    usable = told.get("usable")
    failed = str(told.get("failed_checks", ""))
    return replace(
        run,
        spec=str(told.get("spec", "")),
        spec_name=str(told.get("spec_name", "")),
        effects=tuple(part for part in str(told.get("effects", "")).split(",") if part),
        seed=None if told.get("seed") is None else int(told["seed"]),
        simulated=bool(told.get("simulated", 0)),
        versions=_table(told.get("versions")),
        sha256=_table(told.get("sha256")),
        usable=None if usable is None else bool(usable),
        failed=(failed,) if failed else (),
        parameters=_from_draws(posterior),
        friction=_friction(posterior),
    )


def _table(text: Any) -> dict[str, str]:
    """A table that is kept as text in an attribute."""
    try:
        found = json.loads(str(text))
    except ValueError:
        return {}
    return {str(k): str(v) for k, v in found.items()} if isinstance(found, dict) else {}


def _from_draws(posterior: xr.Dataset) -> dict[str, Figures]:
    """Figures of every number, `kappa[free-run-2,A]`, of its draws."""
    out = {}
    for name, variable in posterior.data_vars.items():
        if variable.dims[:2] != ("chain", "draw") or "frequency" in variable.dims:
            continue
        whole, places = str(variable.attrs.get("units", "1")), variable.dims[2:]
        flat = variable.to_numpy().reshape(-1, *variable.shape[2:])
        for at in np.ndindex(*flat.shape[1:]):
            series = flat[(slice(None), *at)]
            if not np.isfinite(series).all():
                continue
            parts = [str(posterior[d].to_numpy()[i]) for d, i in zip(places, at, strict=True)]
            unit = UNITS.get(parts[0], whole) if name in SENSORS else whole
            where = ",".join(parts)
            label = f"{name}[{where}]" if where else str(name)
            q05, median, q95 = np.quantile(series, (0.05, 0.5, 0.95))
            out[label] = Figures(unit, float(median), float(np.std(series)), float(q05), float(q95))
    return out


def _friction(posterior: xr.Dataset) -> Friction | None:
    """|mu| over frequency, of the first view where friction varies."""
    if not {"mu_omega", "k_omega", "frequency"} <= set(posterior.variables):
        return None
    loss, store = posterior["mu_omega"], posterior["k_omega"]
    if "friction_view" in loss.dims:
        loss, store = loss.isel(friction_view=0), store.isel(friction_view=0)
    frequency = posterior["frequency"].to_numpy()
    whole = np.hypot(loss.to_numpy(), store.to_numpy() / (2 * np.pi * frequency))
    flat = whole.reshape(-1, frequency.size)
    return Friction(frequency, np.percentile(flat, QUANTILES, axis=0))


def _with_result(run: Run, result: Mapping[str, Any]) -> Run:
    """What result.json tells; its table counts before the draws, since it is what is quoted."""
    parameters = {}
    for label, row in dict(result.get("parameters") or {}).items():
        if all(row.get(key) is not None for key in ("median", "sd", "q05", "q95")):
            parameters[label] = Figures(
                row.get("unit", "1"), row["median"], row["sd"], row["q05"], row["q95"]
            )
    gap = result.get("gap") or {}
    checks = [one for one in result.get("checks") or [] if not one.get("ok", True)]
    return replace(
        run,
        spec_name=run.spec_name or str(result.get("spec", "")),
        usable=result.get("usable", run.usable),
        failed=tuple(f"{one['name']}: {one['says']}" for one in checks) or run.failed,
        parameters=parameters or run.parameters,
        gaps=gap.get("records") or {},
        overall=gap.get("overall"),
        sha256=run.sha256 or dict(result.get("sha256") or {}),
        versions=run.versions or dict(result.get("versions") or {}),
        seed=run.seed if run.seed is not None else result.get("seed"),
        simulated=bool(result.get("simulated", run.simulated)),
    )


def _with_bands(run: Run, found: Mapping[str, Any]) -> Run:
    """Peak loads and what else the bands of a folder quote, as numbers of the run."""
    quoted = {
        f"{line['quantity']}[{record},{line['place']}]": Figures(
            line["unit"], line["median"], line["combined"], line["q05"], line["q95"]
        )
        for record, told in (found.get("records") or {}).items()
        for line in told.get("budget", [])
        if None not in (line["median"], line["combined"], line["q05"], line["q95"])
    }
    return replace(
        run,
        parameters={**run.parameters, **quoted},
        sha256={**found.get("sha256", {}), **run.sha256},
        usable=bool(found.get("usable", True)) and run.usable is not False,
        simulated=run.simulated or bool(found.get("simulated", False)),
    )


def _notes(run: Run, result: object, tree: object) -> list[str]:
    """What is not there, a sentence each."""
    out = []
    if result is None:
        out.append("no result.json: its checks and its gaps are not known")
    if tree is None:
        out.append("no posterior.nc: its spec and its friction over frequency are not known")
    if not run.parameters:
        out.append("no parameter table")
    if not run.sha256:
        out.append("no digests of records: whether it shares records with the others is not known")
    return out

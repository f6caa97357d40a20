"""Specs of the fits, ready to run on the files of a campaign."""

import os
from collections.abc import Iterator
from pathlib import Path

from rigid.generator.constants import COUNT
from rigid.generator.core import Run
from rigid.generator.draw import Truth
from rigid.generator.schedule import PRELOAD
from rigid.generator.writers import column

BASE_EFFECTS = ("load-cell-spring", "oil-compressibility", "viscous-friction", "pump-curve")
MEMORY_EFFECTS = (*BASE_EFFECTS, "frequency-dependent-friction")
SUFFIX = {"release": ".csv"}  # the accelerometer's files; all else is a table of the logger


def file_name(run: Run) -> str:
    """Name of the file that holds a run; free and field records hold both cylinders."""
    return run.name + SUFFIX.get(run.kind, ".dat")


def write_specs(folder: Path, data: Path, truth: Truth) -> None:
    """Write calibration.toml and constant-mu.toml into `folder` for the records in `data`."""
    where = Path(os.path.relpath(data.resolve(), folder.resolve())).as_posix()
    slow = sorted({run.cylinder for run in truth.runs if run.kind not in SUFFIX})
    records = "\n".join([*map(_channels, slow), *(_record(run, where) for run in truth.runs)])
    titles = {
        "calibration": "Calibration of the rig, friction with memory",
        "constant-mu": "Calibration of the rig, a constant viscosity per kind of record",
    }
    models = {
        "calibration": _effects(MEMORY_EFFECTS),
        "constant-mu": _effects(BASE_EFFECTS) + '\nvary = { mu = "kind" }',
    }
    for name, title in titles.items():
        head = f'title = "{title}"\nsimulated = true\n\n[model]\n{models[name]}\n'
        (folder / f"{name}.toml").write_text(f"{head}\n{records}", encoding="ascii", newline="\n")


def _effects(names: tuple[str, ...]) -> str:
    lines = "".join(f'    "{name}",\n' for name in names)
    return f"effects = [\n{lines}]"


def _record(run: Run, where: str) -> str:
    file = file_name(run) if where == "." else f"{where}/{file_name(run)}"
    lines = [
        "[[records]]",
        f'name = "{run.name}"',
        f'kind = "{run.kind}"',
        f'cylinder = "{run.cylinder}"',
        f'file = "{file}"',
    ]
    lines += _release() if run.kind == "release" else _slow(run)
    return "\n".join(lines) + "\n"


def _release() -> Iterator[str]:
    yield f"preload = {{ value = {PRELOAD}, sd = {0.01 * PRELOAD} }}"
    yield "[records.channels]"
    yield 'time = { column = "time", unit = "s" }'
    yield f'acceleration = {{ column = "Az", unit = "counts", scale = {COUNT!r} }}'


def _slow(run: Run) -> Iterator[str]:
    if len(run.valve) > 1:
        yield "valve = ["
        for switch in run.valve[:-1]:
            yield f'    {{ until = {switch.until}, position = "{switch.position}" }},'
        yield f'    {{ position = "{run.valve[-1].position}" }},'
        yield "]"


def _channels(cylinder: str) -> str:
    lines = [f"[channels.{cylinder}]", 'time = { column = "TIMESTAMP", unit = "timestamp" }']
    for channel, unit in (("load", "kN"), ("stroke", "mm"), ("pressure", "bar")):
        name = column(channel, cylinder)
        lines.append(f'{channel} = {{ column = "{name}", unit = "{unit}" }}')
    return "\n".join(lines) + "\n"

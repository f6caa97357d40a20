"""What is known of a field test so far, on disk, so that a resumed run does not do it again."""

import dataclasses
import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple
from zipfile import BadZipFile

import numpy as np

from rigid import __version__
from rigid.files import replacing
from rigid.smoothing.budget import Line
from rigid.smoothing.field import Field
from rigid.smoothing.latent import Movement
from rigid.smoothing.laws import Law
from rigid.smoothing.learning import Learned
from rigid.smoothing.paths import Test
from rigid.smoothing.run import Band, Bands

PLAIN = tuple(name for name in Learned._fields if name != "movement")
ARRAYS = tuple(name for name in Movement._fields if name != "steps")


class Kept(NamedTuple):
    """Of one test: what was learned under each law that is done, and the bands once they are."""

    learned: tuple[tuple[Learned, ...], ...] = ()
    bands: Bands | None = None


def mark(fields: Sequence[Field], laws: Sequence[Law], seed: int) -> str:
    """Return what a test's bands depend on; only a run with the same reads what was kept."""
    told = hashlib.sha256(json.dumps([seed, __version__, [f.sha256 for f in fields]]).encode())
    for field in fields:
        for part in (field.reading, field.known, np.array([field.first, field.interval])):
            told.update(part.tobytes())
    for law in laws:
        told.update(f"{law.name} {law.weight}".encode())
        for name in sorted(law.values):
            told.update(name.encode() + np.ascontiguousarray(law.values[name]).tobytes())
    return told.hexdigest()


def save(path: Path, mark: str, kept: Kept) -> None:
    """Write what is known of a test, whole or not at all."""
    arrays: dict[str, np.ndarray] = {"mark": np.array(mark)}
    for i, under in enumerate(kept.learned):
        for j, one in enumerate(under):
            arrays |= {f"{i}/{j}/{name}": np.asarray(getattr(one, name)) for name in PLAIN}
            arrays |= {f"{i}/{j}/movement/{n}": getattr(one.movement, n) for n in ARRAYS}
            arrays[f"{i}/{j}/steps"] = np.array(one.movement.steps)
    if kept.bands is not None:
        arrays["rows"] = kept.bands.test.rows
        best = [under is kept.bands.test.learned for under in kept.learned].index(True)
        arrays["best"] = np.array(best)
        arrays["budget"] = np.array(json.dumps([dataclasses.asdict(b) for b in kept.bands.budget]))
        for name, band in kept.bands.bands.items():
            arrays[f"band/{name}/quantiles"] = band.quantiles
            arrays[f"band/{name}/parts"] = band.parts
    with replacing(path) as temporary, temporary.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)


def load(path: Path, mark: str, fields: Sequence[Field]) -> Kept:
    """Read back what `save` wrote of the same test, or nothing where there is nothing that fits."""
    try:
        with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        if str(arrays["mark"]) != mark:
            return Kept()
        laws = len({name.split("/")[0] for name in arrays if name.endswith("/steps")})
        learned = tuple(
            tuple(_learned(arrays, f"{i}/{j}/") for j in range(len(fields))) for i in range(laws)
        )
        return Kept(learned, _bands(arrays, fields, learned) if "rows" in arrays else None)
    except (OSError, BadZipFile, KeyError, ValueError):
        return Kept()


def _learned(arrays: dict[str, np.ndarray], key: str) -> Learned:
    parts = {name: arrays[f"{key}movement/{name}"] for name in ARRAYS}
    movement = Movement(**parts, steps=int(arrays[f"{key}steps"]))
    series = {name: arrays[f"{key}{name}"] for name in PLAIN if name != "bound"}
    return Learned(movement=movement, bound=float(arrays[f"{key}bound"]), **series)


def _bands(
    arrays: dict[str, np.ndarray], fields: Sequence[Field], learned: tuple[tuple[Learned, ...], ...]
) -> Bands:
    test = Test(tuple(fields), learned[int(arrays["best"])], arrays["rows"])
    made = {
        name.split("/")[1]: Band(arrays[name], arrays[name.replace("/quantiles", "/parts")])
        for name in arrays
        if name.startswith("band/") and name.endswith("/quantiles")
    }
    listed = json.loads(str(arrays["budget"]))
    budget = tuple(Line(**line | {"parts": tuple(line["parts"])}) for line in listed)
    return Bands(fields[0].name, test.time, made, budget, test)

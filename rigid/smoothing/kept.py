"""What is known of a field test so far, on disk, so that a resumed run does not do it again.

While a test is under way this is what was learned of it (`<record>.npz`), once it is done what the
report says of it (`<record>.json`); its series are then in its own files.
"""

import dataclasses
import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from rigid import __version__
from rigid.io.files import replacing, write_text
from rigid.plots.figure import Illustration
from rigid.smoothing.budget import Line
from rigid.smoothing.events import Fall, Turn
from rigid.smoothing.field import Field
from rigid.smoothing.finished import Finished
from rigid.smoothing.latent import Movement
from rigid.smoothing.laws import Law
from rigid.smoothing.learning import Learned

PLAIN = tuple(name for name in Learned._fields if name != "movement")
ARRAYS = tuple(name for name in Movement._fields if name != "steps")


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


def save(path: Path, mark: str, learned: Sequence[tuple[Learned, ...]]) -> None:
    """Write what was learned of a test under each law so far, whole or not at all."""
    arrays: dict[str, np.ndarray] = {"mark": np.array(mark)}
    for i, under in enumerate(learned):
        for j, one in enumerate(under):
            arrays |= {f"{i}/{j}/{name}": np.asarray(getattr(one, name)) for name in PLAIN}
            arrays |= {f"{i}/{j}/movement/{n}": getattr(one.movement, n) for n in ARRAYS}
            arrays[f"{i}/{j}/steps"] = np.array(one.movement.steps)
    with replacing(path) as temporary, temporary.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)


def load(path: Path, mark: str, cylinders: int) -> tuple[tuple[Learned, ...], ...]:
    """Read back what `save` wrote of the same test, or nothing where there is nothing that fits."""
    try:
        with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        if str(arrays["mark"]) != mark:
            return ()
        laws = len({name.split("/")[0] for name in arrays if name.endswith("/steps")})
        return tuple(
            tuple(_learned(arrays, f"{i}/{j}/") for j in range(cylinders)) for i in range(laws)
        )
    except (OSError, BadZipFile, KeyError, ValueError):
        return ()


def save_finished(path: Path, mark: str, finished: Finished) -> None:
    """Write what the report says of a test that is done, whole or not at all."""
    told = {"mark": mark, "finished": dataclasses.asdict(finished)}
    write_text(path, json.dumps(told, allow_nan=False))


def load_finished(path: Path, mark: str) -> Finished | None:
    """Read back what `save_finished` wrote of the same test; None where nothing fits."""
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
        if told["mark"] != mark:
            return None
        given = told["finished"]
        return Finished(
            name=given["name"],
            cylinders=tuple(given["cylinders"]),
            budget=tuple(Line(**b | {"parts": tuple(b["parts"])}) for b in given["budget"]),
            falls=tuple(Fall(**fall) for fall in given["falls"]),
            turns=tuple(Turn(**turn) for turn in given["turns"]),
            gaps=given["gaps"],
            sha256=given["sha256"],
            figures=tuple(
                Illustration(**f | {"files": tuple(f["files"])}) for f in given["figures"]
            ),
        )
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _learned(arrays: dict[str, np.ndarray], key: str) -> Learned:
    parts = {name: arrays[f"{key}movement/{name}"] for name in ARRAYS}
    movement = Movement(**parts, steps=int(arrays[f"{key}steps"]))
    series = {name: arrays[f"{key}{name}"] for name in PLAIN if name != "bound"}
    return Learned(movement=movement, bound=float(arrays[f"{key}bound"]), **series)

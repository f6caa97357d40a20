"""What a field test's bands depend on, and what of them a resumed run does not make again."""

import hashlib
from collections.abc import Sequence

import numpy as np

from rigid.inference.reference_check import SensorError, SolverCheck
from rigid.io.version import __version__
from rigid.likelihood.set_aside import Aside
from rigid.plots.figure import Illustration
from rigid.smoothing.budget import Line
from rigid.smoothing.events import Fall, Turn
from rigid.smoothing.field import Field
from rigid.smoothing.finished import Finished
from rigid.smoothing.latent import Movement
from rigid.smoothing.laws import RigModel
from rigid.smoothing.learning import Learned

LEARNED = (Learned, Movement)
FINISHED = (Finished, Line, Fall, Turn, Illustration, SolverCheck, SensorError, Aside)


def mark(fields: Sequence[Field], laws: Sequence[RigModel], seed: int) -> dict[str, str]:
    """Return what a test's bands depend on, by name; only a run with the same reads it."""
    told = {"seed": str(seed), "version": __version__}
    for field in fields:
        digest = hashlib.sha256("".join(field.files.values()).encode())
        for part in (field.reading, field.known, np.array([field.first, field.interval])):
            digest.update(part.tobytes())
        told[f"record {field.label}"] = digest.hexdigest()
    for number, law in enumerate(laws):
        digest = hashlib.sha256(f"{law.name} {law.weight}".encode())
        for name in sorted(law.values):
            digest.update(name.encode() + np.ascontiguousarray(law.values[name]).tobytes())
        told[f"posterior {number + 1}"] = digest.hexdigest()
    return told

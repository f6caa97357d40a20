"""What a study of validation does to every replicate, as values that travel with a job."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from rigid.jobs.job import Given
from rigid.spec.read import parse_spec
from rigid.spec.values import Spec

IGNORED = "colour-ignored"
BREAKS = ("noise-halved", "rounding-ignored", IGNORED, "record-twice")
"""Ways to break the likelihood on purpose."""
FAST, FULL, SLOPES = FITS = ("fast", "full", "slopes")
"""Weighted draws of the law around the optimum near the truth; as the command fits; not at all, for
the likelihood's slope at the truth needs no fit."""
COLOUR = 0.8
"""Correlation of neighbouring samples of noise in campaigns for a likelihood that ignores it."""


@dataclass(frozen=True)
class Design:
    """How replicates are drawn and fitted.

    - `seed`: of everything random. - `fit`: one of FITS.
    - `broken`: how the likelihood is broken, one of BREAKS; None: it is not.
    - `colour`: correlation of neighbouring samples of noise, 0 for white noise.
    - `shift`: misfit, in prior sds: a constant of the rig is drawn from that far away.
    - `around`: where priors are moved to, by label: centre and width in their own sds.
    """

    seed: int
    fit: str = FAST
    broken: str | None = None
    colour: float = 0.0
    shift: float = 0.0
    around: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Name of the file of rows."""
        parts = [self.fit]
        parts += [self.broken] if self.broken else []
        parts += ["misfit"] if self.shift else []
        parts += ["around"] if self.around else []
        return "-".join(parts)


def arguments(spec: Spec, design: Design, number: int) -> dict[str, Any]:
    """Return what a job is given: the spec as it stands, the design, the replicate's number."""
    folder = spec.path.resolve().parent
    told = asdict(design) | {"around": {k: list(v) for k, v in sorted(design.around.items())}}
    return {
        "text": spec.text,
        "method": spec.solve.method,
        "path": str(folder / spec.path.name),
        "design": told,
        "number": number,
    }


def read_arguments(given: Given) -> tuple[Spec, Design, int]:
    """Undo `arguments` where the job runs; records are those that came with it."""
    told = given.arguments
    spec = parse_spec(told["text"], Path(told["path"]))
    records = tuple(
        r.model_copy(update={"file": given.path(r.file.absolute())}) for r in spec.records
    )
    around = {k: (v[0], v[1]) for k, v in told["design"]["around"].items()}
    design = Design(**(told["design"] | {"around": around}))
    solve = spec.solve.model_copy(update={"method": told["method"]})
    return spec.model_copy(update={"records": records, "solve": solve}), design, told["number"]

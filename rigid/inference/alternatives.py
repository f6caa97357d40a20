"""What k_LC becomes under the choices that no probability was given to."""

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from rigid.inference.calibrate import Calibrated
from rigid.inference.derived import values_of
from rigid.inference.search import refit
from rigid.kinds import KINDS
from rigid.likelihood.assemble import assemble
from rigid.spec import Spec

CHOICES = {
    "two-per-cylinder": "two beams per cylinder",
    "two-shared": "both cylinders on two beams",
}
DRAWS = 4000


@dataclass(frozen=True)
class Alternative:
    """What a number becomes under a choice that no probability was given to.

    - question: "beams of the frame that carry the load"; label: "two", "four"
    - used: whether the rest of the page rests on this choice
    - symbol, unit, median, q05, q95: the number it is judged by, usually k_LC
    """

    question: str
    label: str
    used: bool
    median: float
    q05: float
    q95: float
    text: str = ""
    symbol: str = "k_{LC}"
    unit: str = "N/m"


def alternatives(spec: Spec, done: Calibrated) -> tuple[Alternative, ...]:
    """k_LC for either count of the frame's beams, eq. (15); the other one by a Gaussian refit."""
    framed = any(KINDS[r.kind].contact == "frame" for r in done.records)
    if not framed or spec.rig.k_frame is not None or "k_LC" not in done.values:
        return ()
    out = []
    for beams, label in CHOICES.items():
        used = spec.rig.frame_beams == beams
        draws = done.values["k_LC"].ravel() if used else _refitted(spec, done, beams)
        low, middle, high = (float(q) for q in np.percentile(draws, [5, 50, 95]))
        how = "the posterior of this page" if used else "Gaussian law around a refit"
        out.append(Alternative(
            "beams of the frame that carry a cylinder's load (eq. 15)", label, used,
            middle, low, high, how,
        ))  # fmt: skip
    return tuple(out)


def _refitted(spec: Spec, done: Calibrated, beams: str) -> np.ndarray:
    """Draws of k_LC from the Gaussian law around the best fit with other beams."""
    rig = spec.rig.model_copy(update={"frame_beams": beams})
    problem = assemble(spec.model_copy(update={"rig": rig}), done.records)
    optimum = refit(problem, done.found)
    rng = np.random.default_rng([done.seed, 5])
    factor = np.linalg.cholesky(optimum.covariance)
    z = optimum.z + rng.standard_normal((DRAWS, len(optimum.z))) @ factor.T
    return np.asarray(jnp.asarray(values_of(problem, z)["k_LC"]))

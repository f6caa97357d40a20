"""The mark 'only the prior speaks' on mu(omega) stands where the records do not narrow it.

Free runs alone tell |mu| at 100 Hz to a factor of 2.4, where the prior's band is one of 600: they
know the sum of all branches, and the law allows no more than that anywhere. Releases alone leave it
at 0 Hz as wide as 0.7 of the prior.
"""

from pathlib import Path

import numpy as np
import pytest

from rigid.inference.derived import LEVELS, frictions, values_of
from rigid.inference.few_starts import best_of_few
from rigid.inference.friction_curve import FREQUENCIES
from rigid.inference.search import search_from
from rigid.likelihood.assemble import assemble
from rigid.records.read import read_records
from rigid.report.calibration.shown import PRIOR_DRAWS, narrowed
from rigid.spec import load_spec

EXAMPLE = Path(__file__).parents[1] / "fits" / "calibration.toml"
STEADY, RINGING = 0.02, 100.0
"""Hz; of free running, and of a release."""


def magnitudes(problem, z: np.ndarray) -> np.ndarray:
    curve = frictions(problem, values_of(problem, z))[""]
    return np.percentile(curve.magnitude, LEVELS, axis=0)


@pytest.mark.slow
def test_only_what_the_records_narrow_is_marked():
    spec = load_spec(EXAMPLE)
    problem = assemble(spec, read_records(spec))
    rng = np.random.default_rng(66)
    before = magnitudes(problem, rng.standard_normal((PRIOR_DRAWS, problem.parameters.size)))
    best = best_of_few(problem, 4, 5).z
    found = {}
    for kinds in (("frame", "release", "free-run"), ("release",), ()):
        masked = problem.with_weights(
            {
                (piece.group, piece.quantity): np.asarray(piece.weight)
                * [problem.groups[piece.group].tracks[t].kind in kinds for t in piece.tracks]
                for piece in problem.pieces
            }
        )
        law = search_from(masked, best[None]).optima[0]
        z = rng.multivariate_normal(law.z, law.covariance, size=PRIOR_DRAWS, method="cholesky")
        marks = narrowed(magnitudes(problem, z), before)
        found[kinds] = tuple(
            bool(marks[np.argmin(np.abs(FREQUENCIES - hertz))]) for hertz in (STEADY, RINGING)
        )
    assert found == {
        ("frame", "release", "free-run"): (True, True),
        ("release",): (False, True),
        (): (False, False),
    }

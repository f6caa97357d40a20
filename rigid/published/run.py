"""All stories under both priors: evidence, draws, and what the draws show."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from rigid.physics.characteristic import PUBLISHED_RIG, dimensionless
from rigid.published import quantities as q
from rigid.published.catalogue import CAUSES, STORIES
from rigid.published.evidence import Evidence, resampled
from rigid.published.inference import READINGS, VACUUM, Weighed, open_quantities, weigh
from rigid.published.running import common_given
from rigid.published.story import PRIOR_SETS, Story
from rigid.spec import PublishedSpec, Spec

DRAWS = 2000
"""Of each story under each prior."""

LEAST_EFFECTIVE = 100.0
"""Points that must count in an evidence for it to be quoted."""

BRANCHES = {"small": (0.0, 4e4), "near": (4e4, 4e5), "locked": (4e5, np.inf)}
"""N s/m: stretches of mu that make the branches of the constant story; epsilon = 1.38 is 9.65e4."""

TIME = np.linspace(0.0, 0.05, 201)
"""s after the release, of the drawn accelerations."""


@dataclass(frozen=True, eq=False)
class Told:
    """A story under one prior, told.

    - `all_six`, `release`: evidence of all numbers, and of frame and release alone.
    - `pairs`: of all with one cause of free running. - `readings`: of all, by reading of the text.
    - `units`: by label. - `draws`: (DRAWS,) by label, SI.
    - `cause`: index of the cause in each draw; `common`: its common number (NaN without one).
    - `root`: complex omega/omega_0 of the strongest oscillation, omega_0 as below eq. (14).
    - `acceleration` [m/s^2]: 5, 25, 50, 75, 95 % quantiles at TIME, (5, times).
    - `causes`: posterior share of each cause. - `branches`: of each of BRANCHES.
    - `held`: share of the posterior whose oil stays above vacuum.
    """

    story: Story
    prior: str
    all_six: Evidence
    release: Evidence
    pairs: dict[str, Evidence]
    readings: dict[str, Evidence]
    units: dict[str, str]
    draws: dict[str, Float[np.ndarray, " n"]]
    cause: np.ndarray
    common: Float[np.ndarray, " n"]
    root: np.ndarray
    acceleration: Float[np.ndarray, "5 times"]
    causes: dict[str, float]
    branches: dict[str, float]
    held: float


@dataclass(frozen=True)
class Findings:
    """Everything told, by (prior, story)."""

    told: dict[tuple[str, str], Told]
    seed: int

    def of(self, prior: str) -> list[Told]:
        """All stories under a prior, in order."""
        return [t for (p, _), t in self.told.items() if p == prior]

    @property
    def usable(self) -> bool:
        """Whether every evidence rests on enough points."""
        return self.least_effective >= LEAST_EFFECTIVE

    @property
    def least_effective(self) -> float:
        """The least effective number of points of all evidences of all six numbers."""
        return min(t.all_six.effective for t in self.told.values())


COUNT = len(PRIOR_SETS) * len(STORIES)
"""Fits of all hypotheses under all priors."""


def run(spec: Spec, seed: int, report: Callable[[int], None] = lambda _: None) -> Findings:
    """Tell every story under both priors; `report` is told how many of the `COUNT` are done."""
    told = {}
    for i, prior in enumerate(PRIOR_SETS):
        for j, story in enumerate(STORIES):
            found = weigh(story, prior, spec, 1000 * seed + 100 * i + j)
            rng = np.random.default_rng([seed, i, j])
            told[prior, story.key] = tell(found, spec, rng)
            report(len(told))
    return Findings(told, seed)


def held(found: Weighed) -> float:
    """Share of the posterior whose oil stays above vacuum, of all weighted points."""
    weight = np.exp(found.log_weight() - found.log_weight().max())
    return float(np.sum(weight * (found.least > VACUUM)) / np.sum(weight))


def tell(found: Weighed, spec: Spec, rng: np.random.Generator) -> Told:
    """Work out of weighted points what is reported."""
    assert spec.published is not None
    picked = resampled(found.log_weight(), DRAWS, rng)
    response = q.Response(*(a[picked] for a in found.response))
    opened = open_quantities(found.story, spec)
    draws = {one.label: found.values[one.label][picked] for one in opened}
    draws |= {
        "period": found.shown["release_period"][picked],
        "e_folding": q.e_folding(response),
        "p_least": found.least[picked],
    }
    cause = _causes(found, picked, rng)
    shares = np.bincount(cause, minlength=len(CAUSES)) / DRAWS
    omega_0 = dimensionless(PUBLISHED_RIG, 0.0).omega_0
    best = q.strongest(response)
    units = {one.label: one.unit for one in opened} | UNITS
    return Told(
        story=found.story,
        prior=found.prior,
        all_six=found.evidence(),
        release=found.release_evidence(),
        pairs={c.key: found.pair_evidence(c.key) for c in CAUSES},
        readings={name: found.evidence(name) for name in READINGS},
        units=units,
        draws=draws,
        cause=cause,
        common=_common(found, picked, cause, spec.published, rng),
        root=-1j * response.rates[np.arange(DRAWS), best] / omega_0,
        acceleration=np.percentile(q.acceleration(response, TIME), (5, 25, 50, 75, 95), axis=0),
        causes={c.key: float(s) for c, s in zip(CAUSES, shares, strict=True)},
        branches={
            name: float(np.mean((draws["mu"] >= low) & (draws["mu"] < high)))
            for name, (low, high) in BRANCHES.items()
        },
        held=held(found),
    )


UNITS = {"period": "s", "e_folding": "s", "p_least": "Pa"}
"""Of what the draws show beside the open numbers."""


def _causes(found: Weighed, picked: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The cause of free running in each draw, drawn in proportion to its density."""
    logs = np.stack([found.causes[c.key][picked] for c in CAUSES])
    noise = rng.gumbel(size=logs.shape)
    return np.argmax(logs + noise, axis=0)


def _common(
    found: Weighed,
    picked: np.ndarray,
    cause: np.ndarray,
    published: PublishedSpec,
    rng: np.random.Generator,
) -> np.ndarray:
    """The common number of the cause in each draw."""
    out = np.full(len(picked), np.nan)
    for i, one in enumerate(CAUSES):
        here = cause == i
        if one.parameter and here.any():
            friction = found.friction[picked][here]
            normal = rng.standard_normal(int(here.sum()))
            out[here] = common_given(one, found.prior, friction, published, normal)
    return out

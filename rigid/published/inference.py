"""Each story held against the printed numbers, under each of the two priors."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.special import logsumexp

from rigid.effects.declare import lognormal, normal, uniform
from rigid.published import quantities as q
from rigid.published.catalogue import CAUSES
from rigid.published.evidence import Evidence, Points, adapted, evidence
from rigid.published.printed import BLUNDER, log_probability
from rigid.published.quantities import Values
from rigid.published.running import log_density
from rigid.published.story import Quantity, Story, quantity
from rigid.spec import Spec

BLOCK = 2048
"""Points of one compiled program."""

NUISANCES = (
    quantity("k_LC", r"k_\mathrm{LC}", "N/m", lognormal(6e7, 2.0), lognormal(6e7, 4.0)),
    quantity("visible_share", r"\theta", "1", *[lognormal(0.05, 1.6)] * 2),
    quantity("first_peak", "h", "1", *[uniform(0.0, 1.0)] * 2),
)
"""Open in every story: k_LC; below which share of its peak an oscillation is seen no more; and how
much of a period the peak of the hook itself (HR of Fig. 8) adds to the duration."""

CONSTANTS = (
    ("M_HC", r"M_\mathrm{HC}", "kg"),
    ("M_Pl", r"M_\mathrm{Pl}", "kg"),
    ("M_Fl", r"M_\mathrm{Fl}", "kg"),
    ("k_oil", r"k_\mathrm{oil}", "Pa"),
    ("L_0", "L_0", "m"),
    ("k_frame", r"k_\mathrm{frame}", "N/m"),
)
"""Of the rig, each with the spread of the spec's [rig]."""


@dataclass(frozen=True)
class Reading:
    """How the text may be read.

    - `widened`: factor on the half-widths of the release. - `offset` [m]: still inside the stroke.
    - `beams`: per cylinder (docs/errata.md, eqs. (15) and (16)).
    - `slip`: probability that a number stands for a reason that is not the rig.
    - `holds`: whether the oil must stay above vacuum.
    """

    widened: float = 1.0
    offset: float = 0.0
    beams: float = 2.0
    slip: float = BLUNDER
    holds: bool = False


READINGS = {
    "as printed": Reading(),
    "'about' means twice as wide": Reading(widened=2.0),
    "both cylinders on two beams": Reading(beams=1.0),
    "offset still inside": Reading(offset=1e-3),
    "offset still inside, both cylinders on two beams": Reading(offset=1e-3, beams=1.0),
    "a slip is one in a million": Reading(slip=1e-6),
    "the oil stays above vacuum": Reading(holds=True),
}

VACUUM = -1.013e5
"""Pa gauge: oil cannot be pulled further without opening."""

OPENED = -700.0
"""Log probability of a motion under which oil would open, where it must not: as good as none."""


@dataclass(frozen=True, eq=False)
class Weighed:
    """A story under one prior: points of the prior and what they say.

    - `values`: SI by label, (n,). - `shown`: what the rig shows of each printed number, (n,).
    - `friction` [N s/m]: in steady running. - `response`: of the release.
    - `least` [Pa]: least oil pressure of the release.
    - `release`: log probability of the four printed numbers of frame and release, by reading.
    - `causes`: log density of the two numbers of free running, by cause.
    - `log_ratio`: what makes the points speak for the prior, see `Points`.
    """

    story: Story
    prior: str
    values: Values
    shown: dict[str, np.ndarray]
    friction: np.ndarray
    response: q.Response
    least: np.ndarray
    release: dict[str, np.ndarray]
    causes: dict[str, np.ndarray]
    log_ratio: np.ndarray | float = 0.0

    def log_likelihood(self, reading: str = "as printed") -> Float[np.ndarray, " n"]:
        """Log probability of all six numbers, the causes of free running a priori alike."""
        mixed = logsumexp(np.stack(list(self.causes.values())), axis=0) - np.log(len(self.causes))
        return self.release[reading] + mixed

    @property
    def questions(self) -> Float[np.ndarray, "questions n"]:
        """The log-likelihoods that lie apart: by reading, and with friction the one cause."""
        asked = [self.log_likelihood(name) for name in self.release]
        return np.stack([*asked, self.release["as printed"] + self.causes["same"]])

    def log_weight(self, reading: str = "as printed") -> Float[np.ndarray, " n"]:
        """Log weight of the points under all six numbers."""
        return self.log_likelihood(reading) + self.log_ratio

    def evidence(self, reading: str = "as printed") -> Evidence:
        """Of all six numbers."""
        return evidence(self.log_weight(reading))

    def release_evidence(self) -> Evidence:
        """Of frame and release alone."""
        return evidence(self.release["as printed"] + self.log_ratio)

    def pair_evidence(self, cause: str) -> Evidence:
        """Of all six numbers with one cause of free running."""
        return evidence(self.release["as printed"] + self.causes[cause] + self.log_ratio)


def open_quantities(story: Story, spec: Spec) -> tuple[Quantity, ...]:
    """All that a story leaves open: its own, the nuisances, and the constants of the rig."""
    known = [
        quantity(name, symbol, unit, *[normal(k.value, k.sd)] * 2)
        for name, symbol, unit in CONSTANTS
        for k in (spec.rig.known[name],)
    ]
    return (*story.quantities, *NUISANCES, *known)


def weigh(story: Story, prior: str, spec: Spec, seed: int) -> Weighed:
    """Hold a story against the printed numbers at points that serve all that is asked."""
    opened = open_quantities(story, spec)

    def at(z: np.ndarray) -> Weighed:
        return weighed_at(story, prior, values_at(opened, prior, z, spec), spec)

    found: Points = adapted(lambda z: at(z).questions, len(opened), seed)
    return replace(at(found.z), log_ratio=found.log_ratio)


def values_at(
    opened: tuple[Quantity, ...], prior: str, z: Float[np.ndarray, "n d"], spec: Spec
) -> dict[str, np.ndarray]:
    """SI values by label of standard normal points."""
    out = {
        one.label: np.asarray(one.laws[prior].from_standard(z[:, i]))
        for i, one in enumerate(opened)
    }
    assert spec.published is not None  # the caller has looked
    certain = {"S_Pl": spec.rig.S_Pl.value, "preload": spec.published.preload}
    return out | {name: np.full(len(z), value) for name, value in certain.items()}


def weighed_at(story: Story, prior: str, values: Values, spec: Spec) -> Weighed:
    """What given values of a story say."""
    published = spec.published
    assert published is not None  # the caller has looked
    found = _responses(story, values)
    period, seen = q.period(found), q.visible(found, values["visible_share"])
    with np.errstate(invalid="ignore"):
        shown = {
            "frame_stroke": q.frame_stroke(published.frame_load, values),
            "release_period": period,
            "release_duration": seen + values["first_peak"] * period,
            "release_oscillations": seen / period,
        }
    friction, least = story.slow(values), q.least_pressure(found)
    opened = np.where(least < VACUUM, OPENED, 0.0)
    return Weighed(
        story, prior, values, shown, friction, found, least,
        {name: _release(shown, values, reading, spec) + reading.holds * opened
         for name, reading in READINGS.items()},
        {c.key: log_density(c, prior, friction, published) for c in CAUSES},
    )  # fmt: skip


def _responses(story: Story, values: Values) -> q.Response:
    """The release at all points, in blocks of one size."""
    n = len(values["mu"])
    parts = []
    for start in range(0, n, BLOCK):
        block = {k: v[start : start + BLOCK] for k, v in values.items()}
        parts.append(story.respond(story, block))
    return q.Response(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def _release(
    shown: dict[str, np.ndarray], values: Values, reading: Reading, spec: Spec
) -> np.ndarray:
    """Log probability of the four numbers under one reading of the text."""
    published = spec.published
    assert published is not None
    softer = published.frame_load / values["k_frame"] * (2.0 / reading.beams - 1.0)
    stroke = shown["frame_stroke"] + softer + reading.offset
    total = log_probability(published.frame_stroke, stroke, 1.0, reading.slip)
    for name in ("release_period", "release_duration", "release_oscillations"):
        number = getattr(published, name)
        total = total + log_probability(number, shown[name], reading.widened, reading.slip)
    return total

"""From findings to what the page and the figures show."""

from collections.abc import Sequence

import numpy as np

from rigid.physics.characteristic import PUBLISHED_RIG, dimensionless, roots
from rigid.published.catalogue import AREA, CAUSES, STORIES, TRANSFER
from rigid.published.quantities import running_speed
from rigid.published.run import TIME, Findings, Told
from rigid.published.running import common_given, sliding_force
from rigid.published.story import PRIOR_SETS
from rigid.report import wording
from rigid.report.content import BAD, GOOD, Check, Front
from rigid.report.made import made
from rigid.report.published.output import REFERENCE, checks, factors
from rigid.report.published.section import (
    CauseShown,
    PrintedRow,
    StoriesContent,
    StoriesShown,
    StoryRow,
    StoryShown,
)
from rigid.report.published.tables import cause_needs, in_short, needs, tables
from rigid.spec import Printed, Spec

PERCENTS = (5, 25, 50, 75, 95)
FIGURE_PRIOR = PRIOR_SETS[0]
"""Under which the bands of the figures are drawn."""

RUN_TIME = np.linspace(0.0, 10.0, 101)
SPEEDS = np.linspace(5e-4, 15e-3, 59)
"""s and m/s of the drawn free runs."""

SHOWN_DRAWS = 250
"""Roots drawn for each story."""

PRINTED_NAMES = {
    "frame_stroke": ("stroke at 250 kN in the frame", 1e3, "mm"),
    "release_period": ("period of the release", 1e3, "ms"),
    "release_duration": ("duration of the release", 1e3, "ms"),
    "release_oscillations": ("oscillations of the release", 1.0, ""),
    "mu_A": ("S p / v of A in free running", 1e-6, "MN s/m"),
    "mu_B": ("S p / v of B in free running", 1e-6, "MN s/m"),
    "kappa_A": ("κ of A in the field", 1.0, ""),
    "kappa_B": ("κ of B in the field", 1.0, ""),
}


def content(spec: Spec, found: Findings) -> StoriesContent:
    """Gather the section."""
    stories = tuple(
        StoryRow(t.story.title, t.story.assumes, needs(t), t.story.decides)
        for t in found.of(FIGURE_PRIOR)
    )
    told = found.told[FIGURE_PRIOR, REFERENCE]
    causes = tuple(
        StoryRow(c.title, c.assumes, cause_needs(i, told), c.decides) for i, c in enumerate(CAUSES)
    )
    listed = tuple(checks(found))
    return StoriesContent(
        title=spec.title or spec.path.stem,
        simulated=False,
        front=front(spec, found, listed),
        provenance=made(spec, found.seed, ()),
        checks=listed,
        says=in_short(found, spec),
        printed=tuple(_printed(name, spec) for name in PRINTED_NAMES),
        stories=stories,
        causes=causes,
        tables=tables(found),
        shown=shown(spec, found),
    )


def front(spec: Spec, found: Findings, listed: Sequence[Check]) -> Front:
    """Question, answers, whether they may be used."""
    return Front(
        asked=f"What do {len(PRINTED_NAMES)} printed numbers allow, and which of "
        f"{len(STORIES)} hypotheses do they favour?",
        state=GOOD if found.usable else BAD,
        ruling=wording.verdict(found.usable, listed),
        why=in_short(found, spec),
        cannot=(
            f"Six of the numbers count in the evidence, and there are {len(STORIES)} hypotheses: "
            "what follows is mostly prior. Read the Bayes factors under both priors, and the "
            "assumption that each hypothesis rests on.",
            "Nothing on this page was measured for it, and nothing is simulated data; numbers of "
            "the paper stand with their place.",
        ),
        figure="evidence",
    )


def _printed(name: str, spec: Spec) -> PrintedRow:
    title, factor, unit = PRINTED_NAMES[name]
    number: Printed = getattr(spec.published, name)
    rounding = f"{number.half_width * factor:g} {unit}".strip()
    reading = f"{number.sd * factor:g} {unit}".strip()
    allows = f"rounding ± {rounding}, reading {reading} (1 sd)"
    value = f"{number.value * factor:g} {unit}".strip()
    return PrintedRow(title, value, allows, number.place, number.why)


def shown(spec: Spec, found: Findings) -> StoriesShown:
    """What the figures show."""
    published = spec.published
    assert published is not None
    against = {p: factors(found, p) for p in PRIOR_SETS}
    scaled = dimensionless(PUBLISHED_RIG, 1.0)
    sweep = np.concatenate([[0.0], np.geomspace(1e2, 1e7, 600)])

    def at(friction: float) -> np.ndarray:
        return roots(scaled.epsilon * friction, scaled.a1, scaled.a2)

    path = np.stack([at(m) for m in sweep], axis=1)
    forces = sliding_force(published)
    return StoriesShown(
        stories=tuple(_story(t, against) for t in found.of(FIGURE_PRIOR)),
        time=TIME,
        period=published.release_period.value,
        duration=published.release_duration.value,
        omega_0=scaled.omega_0,
        path=path,
        printed_roots=(("μ = 0", at(0.0)), ("3.7·10³, eq. (17)", at(3.7e3)),
                       ("1.35·10⁶, eq. (18)", at(1.35e6)), ("4.46·10⁶, eq. (18)", at(4.46e6))),
        speeds=SPEEDS,
        causes=tuple(_cause(i, found, spec) for i in range(1, len(CAUSES))),
        borrowed=tuple((name, v, f / AREA) for name, (v, f) in forces.items()),
        run_time=RUN_TIME,
        stroke=tuple(_stroke(name, k.value, found.seed)
                     for name, k in (("A", published.kappa_A), ("B", published.kappa_B))),
    )  # fmt: skip


def _story(told: Told, against: dict[str, dict[str, tuple[float, float]]]) -> StoryShown:
    key = told.story.key
    factors_by_prior = tuple((p, *against[p][key]) for p in PRIOR_SETS)
    return StoryShown(
        key, told.story.title, factors_by_prior, told.root[:SHOWN_DRAWS], told.acceleration
    )


def _stroke(name: str, fraction: float, seed: int) -> tuple[str, np.ndarray]:
    """Stroke over time, the flow fraction as in the field test within TRANSFER."""
    normal = np.random.default_rng([seed, ord(name)]).standard_normal(4000)
    speed = running_speed(fraction) * np.exp(np.log(TRANSFER[FIGURE_PRIOR]) * normal)
    return name, np.percentile(speed[:, None] * RUN_TIME, PERCENTS, axis=0)


def _cause(number: int, found: Findings, spec: Spec) -> CauseShown:
    """Pressure over speed under one cause, given the printed numbers; A and B each their own.

    Beside the cause acts the friction of the release under one constant mu.
    """
    cause, published = CAUSES[number], spec.published
    assert published is not None
    rng = np.random.default_rng([found.seed, 7, number])
    n = 4000
    friction = rng.choice(found.told[FIGURE_PRIOR, REFERENCE].draws["mu"], n)
    common = common_given(cause, FIGURE_PRIOR, friction, published, rng.standard_normal(n))
    own = np.log(cause.spread[FIGURE_PRIOR])
    bands = []
    for name, printed in (("A", published.mu_A), ("B", published.mu_B)):
        if cause.speed:
            fraction = {"A": published.kappa_A, "B": published.kappa_B}[name].value
            # S p and v are known only together: the force is what is printed times the speed.
            away = np.log(TRANSFER[FIGURE_PRIOR])
            left = np.maximum(printed.value - friction, 1e-3 * printed.value)
            likely = np.log(left * running_speed(fraction))
            share = own**2 / (own**2 + away**2)
            mean = np.log(common) + share * (likely - np.log(common))
            force = np.exp(mean + own * np.sqrt(1.0 - share) * rng.standard_normal(n))
            pressure = (force[:, None] + friction[:, None] * SPEEDS) / AREA
        else:
            relative = np.hypot(printed.sd, printed.half_width / np.sqrt(3.0)) / printed.value
            total = printed.value * np.exp(relative * rng.standard_normal(n))
            pressure = total[:, None] * SPEEDS / AREA
        bands.append((name, np.percentile(pressure, PERCENTS, axis=0)))
    return CauseShown(cause.title, tuple(bands))

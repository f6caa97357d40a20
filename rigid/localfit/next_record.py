"""The next record that would part two explanations which the present records cannot tell apart."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.stats import norm

from rigid.localfit.candidates import Candidate, standard_of
from rigid.localfit.expansion import Point, Program, expand
from rigid.localfit.families import Family
from rigid.localfit.local import LocalFit
from rigid.localfit.screening import Around, screen
from rigid.localfit.signature import signatures

FACTORS = {"kappa": (0.3, 3.0), "preload": (0.5, 2.0)}
"""By how much a record's own settings are varied."""
SETTINGS = {"kappa": "the flow fraction", "preload": "the preload"}


class Setting(NamedTuple):
    """A setting of the records by its name, and the factor that it is multiplied by."""

    name: str
    factor: float


class Proposal(NamedTuple):
    """A record to take.

    - `words`: what it is. - `apart`: s sqrt((1 - c)/2) with it; 1.64 parts the two in 19 of 20.
    """

    words: str
    apart: float

    @property
    def sentence(self) -> str:
        """What to take; an ideal observer tells the two apart with Phi(apart)."""
        often = float(norm.cdf(self.apart))
        told = "more than 99 %" if often > 0.99 else f"{100 * often:.0f} %"
        return f"{self.words}: with it, the two are told apart in {told} of campaigns"


Apart = Callable[[int], float]
"""How far apart two explanations are with one more record like that of a number."""


def best_record(base: LocalFit, apart: Mapping[Setting, Apart]) -> Proposal | None:
    """Find the record, like one of those there but otherwise set, that parts a pair best.

    - `apart`: by setting. None where no record has a setting.
    """
    best: Proposal | None = None
    for setting, with_one_more in apart.items():
        for number, track in enumerate(base.layout.tracks):
            if not _has(base, setting, track):
                continue
            far = with_one_more(number)
            if best is None or far > best.apart:
                best = Proposal(worded(base, number, setting), far)
    return best


def worded(base: LocalFit, number: int, setting: Setting) -> str:
    """Say which record it is: like number `number`, a setting of it changed."""
    track = base.layout.problem.track(base.layout.tracks[number])
    return (
        f"{track.of.words} like {track.name} (cylinder {track.cylinder}) at {setting.factor:g} "
        f"times {SETTINGS[setting.name]}"
    )


def _has(base: LocalFit, setting: Setting, track: str) -> bool:
    """Whether a record has a setting, and it is uncertain."""
    own = base.hypothesis.of_track(track)
    return any(base.hypothesis.parameters[i].base == setting.name for i in own)


def otherwise(base: LocalFit, program: Program) -> dict[Setting, LocalFit]:
    """A fit with one setting of all records multiplied, by the settings that records have."""
    listed = [Setting(name, factor) for name, factors in FACTORS.items() for factor in factors]
    moved = {s: _moved(base, s) for s in listed}
    points = {s: Point.beside(base, w) for s, w in moved.items() if w is not None}
    if not points:
        return {}
    return dict(zip(points, expand(program, list(points.values())), strict=True))


def _moved(base: LocalFit, setting: Setting) -> Float[np.ndarray, " size"] | None:
    """w with one setting of all records multiplied, or None where no record has it."""
    w, found = base.w.copy(), False
    for i, parameter in enumerate(base.hypothesis.parameters):
        if parameter.base == setting.name:
            value = float(parameter.prior.from_standard(w[i])) * setting.factor
            w[i], found = standard_of(parameter.prior, value), True
    return w if found else None


def _one_more(
    local: LocalFit, there: LocalFit, number: int
) -> tuple[Float[np.ndarray, "more size"], Float[np.ndarray, "more own"]]:
    """Slopes of one more record like that of a number: by shared numbers, and by its own anew."""
    slopes = there.design[_rows(local, number)]
    own = local.hypothesis.of_track(local.layout.tracks[number])
    shared = slopes.copy()
    shared[:, own] = 0.0
    return shared, slopes[:, own]


def _rows(local: LocalFit, number: int) -> np.ndarray:
    return (local.layout.track == number) & local.layout.read


def between_effects(
    base: LocalFit,
    programs: tuple[Family, ...],
    pair: tuple[Candidate, Candidate],
    amplitude: float,
) -> Proposal | None:
    """Find the record that parts two effects by their signatures around one fit.

    - `amplitude`: of the first of the pair, as it was found.
    """
    here = signatures(base, programs, pair)

    def with_setting(there: LocalFit) -> Apart:
        changed = signatures(there, programs, pair)

        def apart(number: int) -> float:
            rows = _rows(base, number)
            shared, private = _one_more(base, there, number)
            old = np.pad(base.design, ((0, 0), (0, private.shape[1])))
            design = np.concatenate([old, np.concatenate([shared, private], axis=1)])
            curvature = np.concatenate([base.terms.curvature, there.terms.curvature[rows]])
            around = Around(np.zeros(len(curvature)), curvature, design, np.zeros(design.shape[1]))
            found = screen(around, np.concatenate([here, changed[rows]]))
            cosine = min(abs(float(found.cosines[0, 1])), 1.0)
            return abs(amplitude) * float(found.size[0]) * float(np.sqrt(0.5 * (1.0 - cosine)))

        return apart

    there = otherwise(base, Program(base.family))
    return best_record(base, {s: with_setting(one) for s, one in there.items()})


def between_fits(
    pair: tuple[LocalFit, LocalFit], programs: tuple[Program, Program]
) -> Proposal | None:
    """Find the record that parts two hypotheses that have been fitted.

    `apart` is half the distance of what the two expect of the record, in noise, once the one that
    is wrong has been fitted to it; 1.64 parts them in 19 of 20.
    """
    first, second = (otherwise(one, program) for one, program in zip(pair, programs, strict=True))

    def with_setting(setting: Setting) -> Apart:
        one, other = End(pair[0], first[setting]), End(pair[1], second[setting])
        return lambda number: (
            0.5 * max(_distance(one, other, number), _distance(other, one, number))
        )

    return best_record(pair[0], {s: with_setting(s) for s in first if s in second})


class End(NamedTuple):
    """A hypothesis at its fit, and with one setting of all records changed."""

    local: LocalFit
    there: LocalFit


def _distance(true: End, wrong: End, number: int) -> float:
    """How far a wrong hypothesis stays from one more record of the true one, in sds of its noise.

    Squared, it is what is left of the difference of both once the wrong one has moved where the
    present records let it, the mean over what they leave open of the true one.
    """
    rows = _rows(true.local, number)
    curvature = np.maximum(wrong.there.terms.curvature[rows], 0.0)
    miss = wrong.there.residual[rows] - true.there.residual[rows]
    shared, private = _one_more(wrong.local, wrong.there, number)
    design = np.concatenate([shared, private], axis=1)
    known = np.eye(design.shape[1])
    known[: len(wrong.local.w), : len(wrong.local.w)] = wrong.local.information
    weighed = design * curvature[:, None]
    solved = np.linalg.inv(known + design.T @ weighed)
    spread, _ = _one_more(true.local, true.there, number)

    def left(columns: np.ndarray) -> np.ndarray:
        """What the wrong one cannot follow of changes (n, k): their products (k, k)."""
        absorbed = weighed.T @ columns
        return columns.T @ (curvature[:, None] * columns) - absorbed.T @ solved @ absorbed

    certain = float(left(miss[:, None])[0, 0])
    uncertain = float(np.sum(true.local.covariance * left(spread)))
    return float(np.sqrt(max(certain + uncertain, 0.0)))

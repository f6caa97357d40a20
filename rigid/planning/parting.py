"""Which candidate would part two explanations that the present records cannot tell apart.

`apart` is half the distance, in noise, of what the two expect of all records, once the one that is
wrong has been fitted to them. An ideal observer tells the two apart with Phi(apart); 1.64 does so
in 19 of 20.
"""

import dataclasses
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from rigid.localfit.candidates import Candidate
from rigid.localfit.families import Family
from rigid.localfit.local import LocalFit
from rigid.localfit.screening import Around, screen
from rigid.localfit.signature import signatures
from rigid.planning.change import Change
from rigid.planning.elsewhere import Elsewhere, Possible, alike, elsewhere
from rigid.planning.limits import Beyond


@dataclasses.dataclass(frozen=True)
class Parting:
    """What a candidate would do for a pair of explanations.

    - `change`. - `apart`: with so many such records. - `now`: with none.
    - `beyond`: what would be read or set beyond its limit; None: nothing.
    """

    change: Change
    apart: tuple[float, ...]
    now: float
    beyond: Beyond | None

    @property
    def worth(self) -> float:
        """Log odds that one such record adds, for a unit of cost."""
        return (self.apart[0] ** 2 - self.now**2) / self.change.cost

    @property
    def words(self) -> str:
        """What to take."""
        says = self.change.says
        return f"a record {says}" if says.startswith("like ") else says

    @property
    def sentence(self) -> str:
        """What to take, and how often the two are told apart with it."""
        return f"{self.words}: with it, the two are told apart in {often(told(self.apart[0]))}"


def told(apart: float) -> float:
    """Share of campaigns in which an ideal observer tells two explanations apart."""
    return float(norm.cdf(apart))


def often(share: float) -> str:
    """That share in words."""
    return f"{'more than 99' if share > 0.99 else f'{100 * share:.0f}'} % of campaigns"


class Pair(NamedTuple):
    """Two effects, either of which may be missing from a fit.

    - `local`: the fit without them; `programs`: hold both. - `both`. - `amplitude`: of the first
      of the two, as it was found.
    """

    local: LocalFit
    programs: tuple[Family, ...]
    both: tuple[Candidate, Candidate]
    amplitude: float


class Rivals(NamedTuple):
    """Two hypotheses, each at its fit, and the programs that they are expanded by."""

    locals: tuple[LocalFit, LocalFit]
    programs: tuple[Family, Family]


Apart = Callable[[str, int], float]
"""How far apart two explanations are with so many records like that of a name."""


def between_effects(
    pair: Pair, possible: Possible, repeats: tuple[int, ...] = (1,)
) -> tuple[Parting, ...]:
    """Rank candidates by how far they part two effects, by their signatures around one fit.

    - `repeats`: numbers of such records, 1 first.
    """
    local, programs = pair.local, pair.programs
    here = _condensed(local, signatures(local, programs, pair.both))

    def lot(changes: tuple[Change, ...]) -> tuple[Elsewhere, Apart]:
        other = elsewhere(local, possible, changes, local.family, programs)
        changed = signatures(other.there, other.families, pair.both)

        def apart(like: str, count: int) -> float:
            shared, private = other.slopes(like, count)
            old = np.pad(here.design, ((0, 0), (0, private.shape[1])))
            more = Samples(
                other.curvature(like, count),
                np.concatenate([shared, private], axis=1),
                np.tile(changed[other.rows(like)], (count, 1)),
            )
            both = zip(here._replace(design=old), more, strict=True)
            return _apart(pair.amplitude, Samples(*(np.concatenate(part) for part in both)))

        return other, apart

    return _ranked(possible, lot, _apart(pair.amplitude, here), repeats)


class Samples(NamedTuple):
    """What some samples say of two effects.

    - `curvature` (n,). - `design` (n, size): slopes by what a fit adjusts. - `columns` (n, 2):
      signatures.
    """

    curvature: np.ndarray
    design: np.ndarray
    columns: np.ndarray


def _condensed(local: LocalFit, columns: np.ndarray) -> Samples:
    """As many samples as there are columns in all that say as much as those of a fit."""
    weight = np.sqrt(np.maximum(local.terms.curvature, 0.0))[:, None]
    few = np.linalg.qr(weight * np.concatenate([local.design, columns], axis=1), mode="r")
    design, both = np.split(few, [local.design.shape[1]], axis=1)
    return Samples(np.ones(len(few)), design, both)


def _apart(amplitude: float, samples: Samples) -> float:
    """s sqrt((1 - c)/2) of the first of two signatures, c the cosine of both."""
    curvature, design, columns = samples
    none = np.zeros(len(curvature)), np.zeros(design.shape[1])
    found = screen(Around(none[0], curvature, design, none[1]), columns)
    cosine = min(abs(float(found.cosines[0, 1])), 1.0)
    return abs(amplitude) * float(found.size[0]) * float(np.sqrt(0.5 * (1.0 - cosine)))


def between_fits(
    rivals: Rivals, possible: Possible, repeats: tuple[int, ...] = (1,)
) -> tuple[Parting, ...]:
    """Rank candidates by how far they part two hypotheses that have been fitted.

    - `repeats`: numbers of such records, 1 first.
    """

    def lot(changes: tuple[Change, ...]) -> tuple[Elsewhere, Apart]:
        one, other = (
            elsewhere(local, possible, changes, program)
            for local, program in zip(rivals.locals, rivals.programs, strict=True)
        )
        return (
            one,
            lambda like, count: (
                0.5 * max(_distance(one, other, like, count), _distance(other, one, like, count))
            ),
        )

    return _ranked(possible, lot, 0.0, repeats)


def _ranked(
    possible: Possible,
    lot: Callable[[tuple[Change, ...]], tuple[Elsewhere, Apart]],
    now: float,
    repeats: tuple[int, ...],
) -> tuple[Parting, ...]:
    """Partings of all candidates, the worthiest first; those beyond a limit last."""
    found = []
    for changes in alike(possible.changes):
        other, apart = lot(changes)
        for one in changes:
            far = tuple(apart(one.like, count) for count in repeats)
            found.append(Parting(one, far, now, other.beyond(possible.spec, one)))
    return tuple(sorted(found, key=lambda one: (one.beyond is not None, -one.worth)))


def best(ranked: tuple[Parting, ...]) -> Parting | None:
    """Return the candidate to take; None where none keeps the limits."""
    return next((one for one in ranked if one.beyond is None), None)


def _distance(true: Elsewhere, wrong: Elsewhere, like: str, count: int) -> float:
    """How far a wrong hypothesis stays from records of the true one, in sds of their noise.

    Squared, it is what is left of the difference of both once the wrong one has moved where the
    present records let it, the mean over what they leave open of the true one.
    """
    rows = wrong.rows(like)
    curvature = wrong.curvature(like, count)
    miss = np.tile(wrong.there.residual[rows] - true.there.residual[rows], count)
    design = np.concatenate(wrong.slopes(like, count), axis=1)
    known = np.eye(design.shape[1])
    size = len(wrong.here.w)
    known[:size, :size] = wrong.here.information
    weighed = design * curvature[:, None]
    solved = np.linalg.inv(known + design.T @ weighed)
    spread, _ = true.slopes(like, count)

    def left(columns: np.ndarray) -> np.ndarray:
        """What the wrong one cannot follow of changes (n, k): their products (k, k)."""
        absorbed = weighed.T @ columns
        return columns.T @ (curvature[:, None] * columns) - absorbed.T @ solved @ absorbed

    certain = float(left(miss[:, None])[0, 0])
    uncertain = float(np.sum(true.here.covariance * left(spread)))
    return float(np.sqrt(max(certain + uncertain, 0.0)))

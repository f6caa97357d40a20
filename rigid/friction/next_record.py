"""The record that would part two laws which the present records leave tied."""

from collections.abc import Sequence

import numpy as np

from rigid.friction.comparison import Comparison, Standing
from rigid.localfit.joint_ascent import Place, simulated
from rigid.localfit.local import Local
from rigid.localfit.next_record import FACTORS, Proposal, has_setting, otherwise, worded

Setting = tuple[str, float]
"""Name of a setting of the records, and the factor that it is multiplied by."""


def next_record(found: Comparison) -> Proposal | None:
    """Find the record, like one of those there but otherwise set, that parts the tied laws best.

    The pair is the first law and the likeliest of those tied with it. `apart` is half the distance
    of what the two expect of the record, in noise, once the one that is wrong has been fitted to
    it; 1.64 parts them in 19 of 20. None where nothing is tied or no record has a setting.
    """
    if not found.tied:
        return None
    pair = found.first, found.tied[0]
    settings = [(name, factor) for name, factors in FACTORS.items() for factor in factors]
    there = [_otherwise(found, one, settings) for one in pair]
    best: Proposal | None = None
    for name, factor in (s for s in there[0] if s in there[1]):
        ends = [one[name, factor] for one in there]
        for number, track in enumerate(pair[0].local.layout.tracks):
            if not has_setting(pair[0].local, name, track):
                continue
            apart = 0.5 * max(
                _distance(pair[i].local, pair[1 - i].local, (ends[i], ends[1 - i]), number)
                for i in (0, 1)
            )
            if best is None or apart > best.apart:
                best = Proposal(worded(pair[0].local, number, name, factor), apart)
    return best


def _otherwise(
    found: Comparison, one: Standing, settings: Sequence[Setting]
) -> dict[Setting, Local]:
    """A law with one setting of all records multiplied, by setting that a record has."""
    moved = {s: otherwise(one.local, *s) for s in settings}
    places = {s: Place.beside(one.local, w) for s, w in moved.items() if w is not None}
    if not places:
        return {}
    ends = simulated(found.fitted.programs.of(one.law), list(places.values()))
    return dict(zip(places, ends, strict=True))


def _distance(true: Local, wrong: Local, there: tuple[Local, Local], number: int) -> float:
    """How far a wrong law stays from one more record of the true one, (in sds of its noise).

    Squared, it is what is left of the difference of both once the wrong law has moved where the
    present records let it, the mean over what they leave open of the true law.
    """
    rows = (true.layout.track == number) & true.layout.read
    track = true.layout.tracks[number]
    bend = np.maximum(there[1].terms.bend[rows], 0.0)
    miss = there[1].residual[rows] - there[0].residual[rows]
    design, known = _one_more(wrong, there[1].design[rows], track)
    weighed = design * bend[:, None]
    solved = np.linalg.inv(known + design.T @ weighed)
    open_, _ = _one_more(true, there[0].design[rows], track)
    spread = open_[:, : len(true.w)]

    def left(columns: np.ndarray) -> np.ndarray:
        """What the wrong law cannot follow of changes (n, k): their products (k, k)."""
        absorbed = weighed.T @ columns
        return columns.T @ (bend[:, None] * columns) - absorbed.T @ solved @ absorbed

    certain = float(left(miss[:, None])[0, 0])
    uncertain = float(np.sum(true.covariance * left(spread)))
    return float(np.sqrt(max(certain + uncertain, 0.0)))


def _one_more(local: Local, slopes: np.ndarray, track: str) -> tuple[np.ndarray, np.ndarray]:
    """Slopes of one more record like `track`, its own numbers its own, and what is known so far."""
    own = local.hypothesis.of_track(track)
    shared = slopes.copy()
    shared[:, own] = 0.0
    known = np.eye(len(local.w) + len(own))
    known[: len(local.w), : len(local.w)] = local.information
    return np.concatenate([shared, slopes[:, own]], axis=1), known

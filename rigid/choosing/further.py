"""The record that would part two laws which the present records leave tied."""

import dataclasses
from collections.abc import Mapping

import numpy as np

from rigid.choosing.comparing import Comparison, Standing
from rigid.choosing.laws import MEMORY, VISCOUS
from rigid.choosing.together import Place, simulated
from rigid.discovery.further import FACTORS, Proposal, otherwise, worded
from rigid.discovery.local import Local


def next_record(found: Comparison) -> Proposal | None:
    """Find the record, like one of those there but otherwise set, that parts the tied laws best.

    The pair is the first law and the likeliest of those tied with it. `apart` is half the distance
    of what the two expect of the record, in noise, once the one that is wrong has been fitted to
    it; 1.64 parts them in 19 of 20. None where nothing is tied or no record has a setting.
    """
    if not found.tied:
        return None
    pair = found.first, found.tied[0]
    best: Proposal | None = None
    for name, factors in FACTORS.items():
        for factor in factors:
            there = _otherwise(found, pair, name, factor)
            if there is None:
                continue
            for number, track in enumerate(pair[0].local.layout.tracks):
                if f"{name}[{track}]" not in pair[0].local.hypothesis.labels:
                    continue
                apart = 0.5 * max(
                    _distance(one.local, other.local, (there[one], there[other]), number)
                    for one, other in (pair, pair[::-1])
                )
                if best is None or apart > best.apart:
                    best = Proposal(worded(pair[0].local, number, name, factor), apart)
    return best


def _otherwise(
    found: Comparison, pair: tuple[Standing, Standing], name: str, factor: float
) -> Mapping[Standing, Local] | None:
    """The pair with one setting of all records multiplied, or None where no record has it."""
    programs, fits, out = found.fitted.programs, found.fitted.fits, {}
    for one in pair:
        w = otherwise(one.local, name, factor)
        if w is None:
            return None
        if one.law.dry is None:
            place = Place(one.local, w, False)
        else:  # slopes by all other numbers as they are without dry friction
            plain = fits[MEMORY if one.law.memory else VISCOUS]
            labels = one.local.hypothesis.labels
            kept = np.array([label in plain.hypothesis.labels for label in labels])
            sensors = np.ones(len(w) - len(labels), dtype=bool)
            (bare,) = simulated(
                programs.viscous, [Place(plain, w[np.concatenate([kept, sensors])], False)]
            )
            place = Place(dataclasses.replace(one.local, design=bare.design), w, True)
        (out[one],) = simulated(programs.of(one.law), [place])
    return out


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
    own = [i for i, label in enumerate(local.hypothesis.labels) if label.endswith(f"[{track}]")]
    shared = slopes.copy()
    shared[:, own] = 0.0
    known = np.eye(len(local.w) + len(own))
    known[: len(local.w), : len(local.w)] = local.information
    return np.concatenate([shared, slopes[:, own]], axis=1), known

"""What the answers of the discovery benchmark are worth: counts, bounds, calibration."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import binomtest, norm

NOTHING, UNNAMED = "nothing", "unnamed"
NO_ANSWER = ("refused", "failed", "unreachable")
LEVEL = 0.95
CONFIDENT = 0.9
TOLD_APART = float(norm.ppf(LEVEL))
"""Least s sqrt((1 - c)/2) at which an oracle parts two effects in 95 % of the cases, 1.64."""
FLOOR = 1e-3
"""A probability of 0 for what was true counts as this in the log score."""
LOOKALIKE = 0.8
"""Cosine between the traces of two causes from which on they count as lookalikes."""
BINS = 10
FORECASTERS = 2000


def upper(count: int, of: int) -> float:
    """One-sided upper 95 % bound of a share (Clopper and Pearson 1934, Biometrika 26)."""
    return _exact(count, of, "less").high


def lower(count: int, of: int) -> float:
    """One-sided lower 95 % bound of a share."""
    return _exact(count, of, "greater").low


def _exact(count: int, of: int, side: str):
    return binomtest(count, of, alternative=side).proportion_ci(LEVEL, method="exact")


def statement(answer: Mapping) -> str:
    """What an answer says first: an effect, "nothing" or "unnamed"."""
    steps = answer["steps"]
    if answer["verdict"] == "nothing-missing" or not steps:
        return UNNAMED if answer["verdict"] == "unnamed" else NOTHING
    return steps[0].get("effect") or UNNAMED


def stated(answer: Mapping) -> dict[str, float]:
    """Probabilities that an answer gives, by what they are of."""
    if "probabilities" in answer:
        return dict(answer["probabilities"])
    if not answer["steps"]:
        return {}
    step = answer["steps"][0]
    found = {a["effect"]: a["probability"] for a in step.get("alternatives", [])}
    if step.get("probability") is not None:
        found[statement(answer)] = step["probability"]
    return found


def true_names(row: Mapping) -> set[str]:
    """What would be right to say first."""
    case = row["case"]
    if not case["hide"]:
        return {NOTHING}
    if case["population"] in {"taken out", "outside"}:
        return {UNNAMED}
    if case["population"] == "behind":
        return {case["hide"][1], UNNAMED}
    return set(case["hide"])


def said_of(row: Mapping) -> dict[str, float]:
    """Effects that were added, and the probability of each."""
    steps = row["answer"]["steps"]
    return {step["effect"]: step["probability"] for step in steps if step.get("effect")}


class Known(NamedTuple):
    """Cosines between the traces of causes, as lookalikes.json has them."""

    names: list[str]
    either_sign: list[str]
    cosines: np.ndarray

    def cosine(self, one: str, other: str) -> float:
        """Cosine; for an effect of either sign its size counts."""
        value = float(self.cosines[self.names.index(one), self.names.index(other)])
        return abs(value) if {one, other} & set(self.either_sign) else value


def known_from(stored: Mapping) -> Known:
    """Read lookalikes.json."""
    return Known(stored["names"], stored["either_sign"], np.array(stored["cosines"]))


def parted(known: Known, name: str, strength: float, others: Iterable[str]) -> bool:
    """Whether an oracle could part a cause from every other one at a strength."""
    closest = max((known.cosine(name, other) for other in others if other != name), default=0.0)
    return strength * math.sqrt((1.0 - closest) / 2.0) >= TOLD_APART


def calibration_error(probability: np.ndarray, right: np.ndarray) -> float:
    """Expected calibration error in ten bins of equal width.

    - probability (n,): stated; right (n,): 0 or 1. Source: Naeini, Cooper, Hauskrecht 2015, AAAI.
    """
    place = np.minimum((probability * BINS).astype(int), BINS - 1)
    off = np.bincount(place, probability - right, BINS)
    return float(np.abs(off).sum() / len(probability))


def forecaster_band(probability: np.ndarray, seed: int = 1) -> float:
    """95 % quantile of the error of a forecaster whose probabilities, these, are right."""
    rng = np.random.default_rng(seed)
    draws = rng.uniform(size=(FORECASTERS, len(probability))) < probability
    errors = [calibration_error(probability, drawn) for drawn in draws.astype(float)]
    return float(np.quantile(errors, LEVEL))


def itself(said: str) -> set[str]:
    """A statement that stands for itself alone."""
    return {said}


def forecasts(
    rows: Sequence[Mapping],
    names: Callable[[Mapping], set[str]] = true_names,
    meant: Callable[[str], set[str]] = itself,
) -> tuple[np.ndarray, np.ndarray]:
    """Probability of each first statement (n,) and whether it was right (n,).

    - names: what would be right to say of a row; meant: all that a statement stands for, whose
      probabilities are added up.
    """
    pairs = []
    for row in rows:
        said, given = statement(row["answer"]), stated(row["answer"])
        if said in given:
            sure = sum(given.get(name, 0.0) for name in meant(said))
            pairs.append((sure, float(said in names(row))))
    array = np.array(pairs).reshape(-1, 2)
    return array[:, 0], array[:, 1]


def log_scores(rows: Sequence[Mapping]) -> np.ndarray:
    """Minus the log of the probability given to what was true (n,), where any was given."""
    scores = []
    for row in rows:
        given = stated(row["answer"])
        if given:
            share = sum(given.get(name, 0.0) for name in true_names(row))
            scores.append(-math.log(max(share, FLOOR)))
    return np.array(scores)


class Odds(NamedTuple):
    """How good the odds between lookalikes are: mean log scores in nats, 0 is best.

    - `campaigns`: of one cause that has lookalikes. - `pairs`: of that cause and a lookalike.
    - `score`: of them all. - `band`: 2.5 and 97.5 % of a perfect forecaster's score.
    """

    campaigns: int
    pairs: int
    score: float
    band: tuple[float, float]


def lookalike_odds(rows: Iterable[Mapping], known: Known, seed: int = 1) -> Odds | None:
    """Score p / (p + q) of what was hidden, p, and of each lookalike, q; None where there is none.

    - `rows`: of campaigns with one cause, which is in the catalogue. - `seed`: of the forecaster.

    A perfect forecaster's probabilities are right: the cause is drawn from those that were stated,
    in each campaign. Lookalikes have a cosine of LOOKALIKE and more.
    """
    rng, scores, pairs = np.random.default_rng(seed), [], 0
    drawn, drawn_pairs = np.zeros(FORECASTERS), np.zeros(FORECASTERS)
    for row in rows:
        given, true = stated(row["answer"]), row["case"]["hide"][0]
        names = [name for name in known.names if name in given]
        if true not in names:
            continue
        chance = np.maximum([given[name] for name in names], 1e-300)
        alike = np.array([[known.cosine(a, b) >= LOOKALIKE for b in names] for a in names])
        np.fill_diagonal(alike, False)
        share = chance[:, None] / (chance[:, None] + chance[None, :])
        score = np.where(alike, -np.log(np.maximum(share, FLOOR)), 0.0).sum(axis=1)
        causes = rng.choice(len(names), FORECASTERS, p=chance / chance.sum())
        drawn += score[causes]
        drawn_pairs += alike.sum(axis=1)[causes]
        count = int(alike[names.index(true)].sum())
        if count:
            pairs += count
            scores.append(float(score[names.index(true)]))
    if not pairs:
        return None
    levels = [(1.0 - LEVEL) / 2.0, (1.0 + LEVEL) / 2.0]
    low, high = np.quantile(drawn / np.maximum(drawn_pairs, 1.0), levels)
    return Odds(len(scores), pairs, sum(scores) / pairs, (float(low), float(high)))


def overlap(row: Mapping) -> float | None:
    """Overlap of stated and true stretch of time over their union; None where either has none."""
    truth = row["truth"][0]["parameters"]
    window = (row["answer"]["steps"] or [{}])[0].get("where", {}).get("time_s")
    if "start" not in truth or not window:
        return None
    both = min(window[1], truth["end"]) - max(window[0], truth["start"])
    either = max(window[1], truth["end"]) - min(window[0], truth["start"])
    return max(both, 0.0) / either


def placed(row: Mapping) -> tuple[bool, bool]:
    """Whether the first step's equation and record are those of a hidden cause."""
    where = (row["answer"]["steps"] or [{}])[0].get("where") or {}
    equations = {told["equation"] for told in row["truth"]}
    records = {record.split(",")[0] for told in row["truth"] for record in told["records"]}
    said = str(where.get("record") or "").split(",")[0]
    return where.get("equation") in equations, said in records

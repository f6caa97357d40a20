"""All explanations of what a model leaves over, weighed against each other.

Exclusive explanations: nothing is missing; one effect of the catalogue is; something is that no
effect explains, stood for by bumps of hidden forces, flows and distortions. Each has a prior and a
Bayes factor against nothing.
"""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.special import logsumexp
from scipy.stats import chi2

from rigid.discovery.unmodelled.base import AbstractHidden, Bumps, Inferred
from rigid.localfit.candidates import Candidate
from rigid.localfit.evidence import Bundle, amplitudes, log_bayes, mean_of
from rigid.localfit.local import LocalFit
from rigid.localfit.screening import Screening

NOTHING, UNNAMED = "nothing", "unnamed"
PRIOR_NOTHING, PRIOR_UNNAMED = 0.4, 0.15
"""What one would bet before any record: who looks suspects something, and of what is missing one in
four has no entry. The rest is shared evenly by the effects."""

SIMULATED = 1000
"""Draws of campaigns in which nothing is missing, for the p-value."""

ALIKE = 0.98
"""Effects whose signatures have this cosine explain the same, and take each other's place."""

Z_GRID = np.linspace(-8.0, 8.0, 49)
SIZES, LEAST_SIZE = 48, 1e-4
"""Sizes of signatures at which a law's curve is worked out; the least, over the greatest."""


class Bundled(NamedTuple):
    """A hidden thing and the bundle of its signatures."""

    hidden: AbstractHidden
    bundle: Bundle


@dataclasses.dataclass(frozen=True)
class Explained:
    """Bayes factors of everything that was tried, to second order around a fit.

    - `listed`: candidates. - `screening`: of them and of all that is hidden, in that order.
    - `candidate`: log Bayes factor of each. - `bundles`, `bundle`: hidden things, and the log Bayes
      factor of each.
    - `null` (draws,): log of the evidence for anything at all where nothing is missing.
    """

    listed: tuple[Candidate, ...]
    screening: Screening
    candidate: Float[np.ndarray, " c"]
    bundles: tuple[Bundled, ...]
    bundle: Float[np.ndarray, " b"]
    null: Float[np.ndarray, " draws"]

    @cached_property
    def p_value(self) -> float:
        """How often as much is found where nothing is missing."""
        # As it stands for the records: curves over the strength end where chance does.
        exact = {i: self.candidate[[i]] for i in range(len(self.listed))}
        here = _totals(self, self.screening.slope[None], exact)[0]
        return float((1 + np.sum(self.null >= here)) / (1 + len(self.null)))

    def seen(self, slope: Float[np.ndarray, " k"]) -> "Explained":
        """Weigh the same of records that leave other slopes (k,) of all signatures."""
        screening = self.screening._replace(slope=slope)
        return dataclasses.replace(
            self,
            screening=screening,
            candidate=_of_candidates(self.listed, screening),
            bundle=_of_bundles(self.bundles, screening),
        )

    @cached_property
    def effects(self) -> dict[str, float]:
        """Log Bayes factor of every effect, averaged over its shapes and places."""
        names = [one.effect.name for one in self.listed]
        return {
            name: float(mean_of(self.candidate[[i for i, n in enumerate(names) if n == name]]))
            for name in dict.fromkeys(names)
        }

    @property
    def unnamed(self) -> float:
        """Log Bayes factor of something hidden, averaged over all that was tried."""
        return float(np.asarray(logsumexp(self.bundle + shares(self.bundles))))

    @cached_property
    def hidden(self) -> dict[AbstractHidden, float]:
        """Log of what speaks for each hidden thing, the likeliest first."""
        logs = self.bundle + shares(self.bundles)
        return {self.bundles[i].hidden: float(logs[i]) for i in np.argsort(-logs)}

    def bundle_of(self, hidden: AbstractHidden) -> Bundle:
        """Signatures of a hidden thing."""
        return next(bundle for one, bundle in self.bundles if one == hidden)

    def inferred(self, hidden: AbstractHidden, local: LocalFit, everything: Bumps) -> Inferred:
        """What the records say of a hidden thing.

        - `local`: the fit. - `everything`: signatures of all that is hidden.
        """
        bundle = self.bundle_of(hidden)
        own = everything.of(bundle.columns - len(self.listed))
        return Inferred(hidden, *bundle.amplitudes(self.screening.slope), own, local, everything)

    def alike(self, name: str) -> tuple[str, ...]:
        """Effects whose signature is that of an effect, itself among them."""
        cosines, at = self.screening.cosines, self.best_of(name)
        return tuple(n for n in self.effects if abs(cosines[at, self.best_of(n)]) > ALIKE)

    def best_of(self, name: str) -> int:
        """Number of the candidate of an effect that explains most."""
        mine = [i for i, one in enumerate(self.listed) if one.effect.name == name]
        return mine[int(np.argmax(self.candidate[mine]))]


def shares(bundles: Sequence[Bundled]) -> Float[np.ndarray, " b"]:
    """Log of what one would bet on each hidden thing: classes alike, and each within its class.

    Else the many stretches of time of many records would leave nothing for a plain leak.
    """
    classes = [hidden.prior_class for hidden, _ in bundles]
    counts = np.array([classes.count(one) for one in classes])
    return -np.log(counts * max(len(set(classes)), 1))


def bundles_of(
    targets: Sequence[AbstractHidden], first: int, information: Float[np.ndarray, "k k"]
) -> tuple[Bundled, ...]:
    """Bundle the bumps: each target's own, and those over time of all records together."""
    numbers: dict[AbstractHidden, list[int]] = {}
    for i, target in enumerate(targets):
        numbers.setdefault(target, []).append(first + i)
        if target.pooled is not None:
            numbers.setdefault(target.pooled, []).append(first + i)
    return tuple(Bundled(t, Bundle(np.array(c), information)) for t, c in numbers.items())


def explain(
    listed: tuple[Candidate, ...],
    targets: tuple[AbstractHidden, ...],
    screening: Screening,
    seed: int,
) -> Explained:
    """Weigh all candidates and bumps; their signatures are screened in that order."""
    bundles = bundles_of(targets, len(listed), screening.information)
    candidate, bundle = _of_candidates(listed, screening), _of_bundles(bundles, screening)
    found = Explained(listed, screening, candidate, bundles, bundle, np.zeros(0))
    drawn = null_draws(screening.information, seed)
    best_waves(drawn, bundles, seed)
    return dataclasses.replace(found, null=_totals(found, drawn, by_chance(listed, seed)))


def _of_candidates(listed: Sequence[Candidate], screening: Screening) -> np.ndarray:
    diagonal = np.diag(screening.information)
    out = np.array([one.log_share for one in listed])
    for members, departures in of_one_law(listed):
        out[members] += log_bayes(screening.slope[members], diagonal[members], departures)
    return out


def _of_bundles(bundles: Sequence[Bundled], screening: Screening) -> np.ndarray:
    return np.array([float(b.log_bayes(screening.slope)) + t.log_share for t, b in bundles])


def null_draws(information: np.ndarray, seed: int) -> np.ndarray:
    """Slopes (SIMULATED, k) of all signatures in campaigns where nothing is missing."""
    size = np.sqrt(np.maximum(np.diag(information), 1e-200))
    rng = np.random.default_rng([seed, 5])
    return rng.standard_normal((SIMULATED, len(size))) @ _root(information, size).T * size


def by_chance(listed: Sequence[Candidate], seed: int) -> dict[int, np.ndarray]:
    """Log Bayes factors (draws,) of candidates that are the best of many settings, by number."""
    rng = np.random.default_rng([seed, 6])
    return {i: rng.choice(one.chance, SIMULATED) for i, one in enumerate(listed) if one.chance}


def best_waves(drawn: Float[np.ndarray, "draws k"], bundles: Sequence[Bundled], seed: int) -> None:
    """Put into slopes (draws, k) those of bundles that are the best of many settings."""
    rng = np.random.default_rng([seed, 7])
    for target, bundle in bundles:
        if target.tried > 1:
            least = _least_tail(rng, len(drawn), target.tried)
            way = rng.standard_normal((len(drawn), bundle.rank))
            far = np.sqrt(chi2.isf(least, way.shape[1]))
            drawn[:, bundle.columns] = bundle.slopes(
                way * (far / np.linalg.norm(way, axis=1))[:, None]
            )


def _least_tail(rng: np.random.Generator, draws: int, tried: int) -> np.ndarray:
    """Smallest of so many tail probabilities, (draws,)."""
    return -np.expm1(np.log(rng.random(draws)) / tried)


def _root(information: np.ndarray, size: np.ndarray) -> np.ndarray:
    """A matrix R with R R' the correlation of the signatures (k, k)."""
    alike = information / np.outer(size, size)
    # White noise of a ten-thousandth sd parts signatures in each other's span.
    return np.linalg.cholesky(alike + 1e-8 * np.eye(len(size)))


def _totals(
    found: Explained, slope: np.ndarray, known: Mapping[int, np.ndarray] | None = None
) -> np.ndarray:
    """Log of the evidence for anything at all against nothing, (draws,) for slopes (draws, k).

    - `known`: log Bayes factors of some candidates, by number, that do not come from the slopes.
    """
    known = known or {}
    size = found.screening.size
    names = [one.effect.name for one in found.listed]
    parts: dict[str, list[np.ndarray]] = {}
    for i, curve in enumerate(curves_of_all(found.listed, size, Z_GRID)):
        log = known[i] if i in known else np.interp(slope[:, i] / size[i], Z_GRID, curve)
        parts.setdefault(names[i], []).append(log)
    effects = [mean_of(np.stack(logs, axis=-1)) for logs in parts.values()]
    each = np.stack([b.log_bayes(slope) + t.log_share for t, b in found.bundles], axis=-1)
    hidden = np.asarray(logsumexp(each + shares(found.bundles), axis=-1))
    prior = prior_of(len(effects))
    weighed = [*(e + np.log(prior[1]) for e in effects), hidden + np.log(PRIOR_UNNAMED)]
    return np.logaddexp.reduce(np.stack(weighed), axis=0)


def curves_of_all(
    listed: Sequence[Candidate], sizes: np.ndarray, strengths: np.ndarray
) -> np.ndarray:
    """Log Bayes factors (c, grid) of candidates over the `strengths` (grid,).

    - `sizes` (c or more,): of their signatures. One curve over the strength serves all records, and
      few of them all candidates of one law.
    """
    out = np.empty((len(listed), len(strengths)))
    for members, departures in of_one_law(listed):
        out[members] = curves_of(departures, sizes[members], strengths)
    return out + np.array([one.log_share for one in listed])[:, None]


def of_one_law(listed: Sequence[Candidate]) -> Iterator[tuple[list[int], np.ndarray]]:
    """Numbers of candidates whose amplitudes have one law, and departures of these."""
    alike: dict[tuple, list[int]] = {}
    for i, one in enumerate(listed):
        alike.setdefault((id(one.prior), one.absent), []).append(i)
    for members in alike.values():
        one = listed[members[0]]
        yield members, amplitudes(one.prior, one.absent)


def curves_of(
    departures: np.ndarray, sizes: np.ndarray, strengths: np.ndarray = Z_GRID
) -> np.ndarray:
    """Log Bayes factors (m, grid) over the `strengths` (grid,), for amplitudes of one law.

    - `sizes` (m,): of their signatures. Between SIZES of them, evenly spaced in their logarithm,
      the curves are interpolated.
    """
    few = sizes
    if len(sizes) > SIZES:
        few = np.geomspace(max(sizes.min(), LEAST_SIZE * sizes.max()), sizes.max(), SIZES)
    squares = np.repeat(few[:, None] ** 2, len(strengths), axis=1)
    curves = log_bayes(strengths * few[:, None], squares, departures)
    if few is sizes:
        return curves
    place = np.interp(np.log(sizes), np.log(few), np.arange(SIZES))
    left = np.minimum(place.astype(int), SIZES - 2)
    share = (place - left)[:, None]
    return (1.0 - share) * curves[left] + share * curves[left + 1]


def prior_of(effects: int) -> tuple[float, float, float]:
    """Prior of nothing, of each effect and of something unnamed."""
    return PRIOR_NOTHING, (1.0 - PRIOR_NOTHING - PRIOR_UNNAMED) / max(effects, 1), PRIOR_UNNAMED

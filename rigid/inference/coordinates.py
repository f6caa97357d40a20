"""Coordinates u in which the posterior of a sum's parts is straight.

Where a friction has memory, steady running tells its sum mu(0) = mu_inf + sum mu_i to a thousandth
and the parts to a tenth: on the parameters' own scales z the posterior lies along a thin bent
sheet, which no Gaussian law covers and along which walkers creep. A release tells mu_inf, and so
what the other parts add up to. So u has log mu(0), then the logarithms of what follows a part over
that part: of (mu_1 + mu_2) / mu_inf, of mu_2 / mu_1. In these the sheet is all but flat. Search,
tables and priors stay with z; what is drawn around the best fits, and the walkers, are in u.

The map keeps volumes: of a sum of two parts, d(log sum)/d(log part i) is the part's share w_i, so
that the determinant of (log sum, log ratio) by the logarithms is w_1 + w_2 = 1; a sum of more is
one of two, within one of two. Densities are the same in z and u.
"""

import dataclasses
import hashlib
from functools import cached_property, lru_cache
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray

from rigid.inference.proposal import LogProb, Mode
from rigid.inference.search import Optimum
from rigid.inference.sums import sums_of
from rigid.likelihood.priors import Lognormal
from rigid.likelihood.problem import Problem

Floats = NDArray[np.float64]


@dataclasses.dataclass(frozen=True, eq=False)
class Sum:
    """Parts of a sum among the entries of z, each with a lognormal law.

    - `places` (parts,): where they are; at the first of them u has the sum, at each other the ratio
      of it and all parts after it to the part before. - `centre`, `width` (parts,): log of a part
      is centre + width z.
    """

    places: NDArray[np.intp]
    centre: Floats
    width: Floats

    def straight(self, z: Floats) -> None:
        """Put sum and ratios in the place of the parts of z (..., size), on the parts' scales."""
        logs = self.centre + self.width * z[..., self.places]
        total, ratios = logs[..., -1], []
        for part in np.moveaxis(logs, -1, 0)[-2::-1]:
            ratios.append(total - part)
            total = np.logaddexp(part, total)
        z[..., self.places] = np.stack([total, *ratios[::-1]], axis=-1) / self.width

    def parts(self, u: Floats) -> None:
        """Put the parts in the place of sum and ratios in u (..., size); undoes `straight`."""
        total, *ratios = np.moveaxis(u[..., self.places] * self.width, -1, 0)
        logs = []
        for ratio in ratios:
            logs.append(total - np.logaddexp(0.0, ratio))
            total = logs[-1] + ratio
        u[..., self.places] = (np.stack([*logs, total], axis=-1) - self.centre) / self.width

    def slopes(self, z: Floats) -> Floats:
        """Return d(sum, ratios)/d(parts) at z (size,), (parts, parts)."""
        logs = self.centre + self.width * z[self.places]
        by_logs = np.zeros((len(logs), len(logs)))
        shares = by_logs[-1]
        shares[-1] = 1.0
        total = logs[-1]
        for i in range(len(logs) - 2, -1, -1):
            by_logs[i + 1] = shares
            by_logs[i + 1, i] = -1.0
            more = np.logaddexp(logs[i], total)
            shares = shares * np.exp(total - more)
            shares[i] = np.exp(logs[i] - more)
            total = more
        by_logs[0] = shares
        return by_logs * self.width / self.width[:, None]


@dataclasses.dataclass(frozen=True, eq=False)
class Bend:
    """A map that straightens what bends as a polynomial; see `ridge`.

    - `centre` (size,); `factor` (size, size): its columns are the units q.
    - `low`, `high` (wide,): units within which the polynomial is trusted; beyond them it stays.
    - `coefficients` (terms, narrow): times the `bend_terms` of the first `wide` entries of q they
      are what is taken from those after them.
    """

    centre: Floats
    factor: Floats
    low: Floats
    high: Floats
    coefficients: Floats

    @property
    def wide(self) -> int:
        """How many units bend the others."""
        return len(self.low)

    def straight(self, u: Floats) -> Floats:
        """Return v for u, (..., size)."""
        q = self._units(u)
        q[..., self._bent] -= self._shift(q)
        return self.centre + q @ self.factor.T

    def bent(self, v: Floats) -> Floats:
        """Undo `straight`."""
        q = self._units(v)
        q[..., self._bent] += self._shift(q)
        return self.centre + q @ self.factor.T

    def slopes(self, u: Floats) -> Floats:
        """Return dv/du at u (size,), (size, size)."""
        q = self._units(u)[: self.wide]
        within = np.clip(q, self.low, self.high)
        by_wide = bend_slopes(within)
        bends = np.eye(len(u))
        bends[self._bent, : self.wide] -= (by_wide @ self.coefficients).T * (within == q)
        return self.factor @ bends @ self._inverse

    def _units(self, u: Floats) -> Floats:
        return (u - self.centre) @ self._inverse.T

    def _shift(self, q: Floats) -> Floats:
        """How far the bent entries are from a straight sheet, (..., narrow)."""
        within = np.clip(q[..., : self.wide], self.low, self.high)
        return bend_terms(within) @ self.coefficients

    @property
    def _bent(self) -> slice:
        return slice(self.wide, self.wide + self.coefficients.shape[1])

    @cached_property
    def _inverse(self) -> Floats:
        return np.asarray(np.linalg.inv(self.factor), dtype=np.float64)


@lru_cache
def _factors(n: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Which of n entries are multiplied, by twos and by threes, (terms, 2) and (terms, 3)."""
    twos, threes = (np.array([*combinations_with_replacement(range(n), k)]) for k in (2, 3))
    return twos, threes


def bend_terms(w: Floats) -> Floats:
    """Return the products of two and of three entries of w, (..., n) -> (..., terms)."""
    parts = [np.prod(w[..., factors], axis=-1) for factors in _factors(w.shape[-1])]
    return np.concatenate(parts, axis=-1)


def bend_slopes(w: Floats) -> Floats:
    """Return the slopes of `bend_terms` by w, (..., n) -> (..., n, terms)."""
    n, parts = w.shape[-1], []
    for factors in _factors(n):
        slopes = np.zeros((*w.shape[:-1], n, len(factors)))
        for i in range(factors.shape[1]):
            others = np.prod(w[..., np.delete(factors, i, axis=1)], axis=-1)
            slopes += others[..., None, :] * (factors[:, i] == np.arange(n)[:, None])
        parts.append(slopes)
    return np.concatenate(parts, axis=-1)


@dataclasses.dataclass(frozen=True, eq=False)
class Chart:
    """The map between the sampler's u and a problem's z, arrays (..., size) each.

    - `names`: of the entries of z with sums and ratios in the place of their parts.
    - `sums`: these. - `bends`: what comes after them, one after the other.
    """

    names: tuple[str, ...]
    sums: tuple[Sum, ...]
    bends: tuple[Bend, ...] = ()

    @property
    def mark(self) -> str:
        """What tells these coordinates from others."""
        found = hashlib.sha256(repr([one.places.tolist() for one in self.sums]).encode())
        for bend in self.bends:
            for value in dataclasses.astuple(bend):
                found.update(np.asarray(value).tobytes())
        return found.hexdigest()

    @property
    def plain(self) -> bool:
        """Whether u is z."""
        return not self.sums and not self.bends

    def summed(self, z: Floats) -> Floats:
        """Return z with sums and ratios in the place of their parts."""
        u = np.array(z)
        for one in self.sums:
            one.straight(u)
        return u

    def straight(self, z: Floats) -> Floats:
        """Return u for z."""
        u = self.summed(z)
        for bend in self.bends:
            u = bend.straight(u)
        return u

    def standard(self, u: Floats) -> Floats:
        """Return z for u."""
        z = np.array(u)
        for bend in reversed(self.bends):
            z = bend.bent(z)
        for one in self.sums:
            one.parts(z)
        return z

    def density(self, log_prob: LogProb) -> LogProb:
        """Return a log-density of z as one of u."""
        return lambda u: log_prob(self.standard(u))

    def straightened(self, optimum: Optimum) -> Optimum:
        """Return an optimum whose `z` and `covariance` are those of u."""
        if self.plain:
            return optimum
        slopes = self.slopes(optimum.z)
        covariance = slopes @ optimum.covariance @ slopes.T
        return dataclasses.replace(optimum, z=self.straight(optimum.z), covariance=covariance)

    def standardised(self, optimum: Optimum) -> Optimum:
        """Undo `straightened`."""
        if self.plain:
            return optimum
        z = self.standard(optimum.z)
        back = np.linalg.inv(self.slopes(z))
        return dataclasses.replace(optimum, z=z, covariance=back @ optimum.covariance @ back.T)

    def mode(self, optimum: Optimum) -> Mode:
        """Return the law around an optimum that is Gaussian in u."""
        there = self.straightened(optimum)
        return Mode(there.z, np.linalg.cholesky(there.covariance), optimum.log_posterior)

    def slopes(self, z: Floats) -> Floats:
        """Return du/dz at z (size,), (size, size)."""
        slopes = np.eye(len(z))
        for one in self.sums:
            slopes[np.ix_(one.places, one.places)] = one.slopes(z)
        u = self.summed(z)
        for bend in self.bends:
            slopes = bend.slopes(u) @ slopes
            u = bend.straight(u)
        return slopes


def chart_of(problem: Problem) -> Chart:
    """Return the chart of a problem: sums that its effects tell of, where two parts are sampled."""
    names, sums = list(problem.parameters.labels), []
    for total, parts in sums_of(problem):
        places = np.array([problem.parameters.index(p.label) for p in parts])
        priors = [p.prior for p in parts if isinstance(p.prior, Lognormal)]
        sums.append(
            Sum(
                places,
                np.log([float(prior.median) for prior in priors]),
                np.log([float(prior.factor) for prior in priors]),
            )
        )
        names[places[0]] = total
        for i, place in enumerate(places[1:].tolist(), start=1):
            rest = " + ".join(part.label for part in parts[i:])
            names[place] = f"{f'({rest})' if '+' in rest else rest}/{parts[i - 1].label}"
    return Chart(tuple(names), tuple(sums))

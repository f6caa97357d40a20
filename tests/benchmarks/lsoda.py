"""The same log-posterior with SciPy's LSODA, one walker at a time.

The rig's own equations in plain Python floats; the solver restarts at every switch of the valve
and never steps over one. What it simulates goes through rigid's own likelihood.
"""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import odeint

from rigid.effects.bristle import SPEED_ROUNDING
from rigid.effects.pump_curve import HALF_DROP, MEAN_FLOW, STEEPNESS
from rigid.likelihood.groups import AbstractGroup, flow_label
from rigid.likelihood.marginal import marginal_likelihood
from rigid.likelihood.parameters import Scoped
from rigid.likelihood.problem import LOG_2PI, Problem
from rigid.likelihood.tracks import Track
from rigid.physics.rig import CORE_SCALES

RTOL = 1e-6
ATOL = 1e-8
"""In units of the states' typical sizes: 1e-12 m, 1e-9 m/s, 0.01 Pa, 1e-5 N."""
MAX_STEPS = 1_000_000
EDGE = 1e-9
"""[s]: a sample this close to a switch lies on it; LSODA refuses steps of 1e-16 s."""
Values = Mapping[str, float]
Rates = Callable[[np.ndarray, float], Sequence[float]]


Friction = Callable[[float, Sequence[float]], tuple[float, Sequence[float]]]
"""Of the slip [m/s] and its own states: force on the plunger's motion [N], rates of the states."""


def memory(v: Values) -> Friction:
    """Maxwell branches beside a dashpot."""
    mu, mu1, mu2 = v["mu"], v["mu_branch[1]"], v["mu_branch[2]"]
    tau1, tau2 = v["tau_branch[1]"], v["tau_branch[2]"]

    def force(slip: float, own: Sequence[float]) -> tuple[float, Sequence[float]]:
        r1, r2 = own
        return mu * slip + r1 + r2, ((mu1 * slip - r1) / tau1, (mu2 * slip - r2) / tau2)

    return force


def bristle(v: Values) -> Friction:
    """A dashpot and a bristle: Coulomb, Stribeck or LuGre, by which numbers there are."""
    mu, coulomb = v["mu"], v["F_C"]
    bending, delay = (
        v["z_bristle" if "z_bristle" in v else "presliding"],
        v.get("bristle_time", 0.0),
    )
    excess, speed = v.get("stribeck_excess", 0.0), v.get("v_stribeck", 1.0)
    exp, sqrt, rounding = math.exp, math.sqrt, SPEED_ROUNDING

    def force(slip: float, own: Sequence[float]) -> tuple[float, Sequence[float]]:
        (share,) = own
        limit = 1.0 + excess * exp(-((slip / speed) ** 2))
        pace = sqrt(slip * slip + rounding * rounding) - rounding
        rate = (slip - pace * share / limit) / bending
        damped = coulomb * delay * rate
        return mu * slip + coulomb * share + damped, (rate,)

    return force


def rates_of(v: Values, contact: float, fraction: float) -> Rates:
    """Equations (2)-(13) with the friction that there are numbers of, the valve in one position."""
    m1, m2 = v["M_HC"] - v["M_Pl"], v["M_Pl"] + 0.5 * v["M_Fl"]
    area, column, spring = v["S_Pl"], v["L_0"], v["k_LC"]
    modulus, p_max, tanh = v["k_oil"] / area, v["p_max"], math.tanh
    mean, drop = fraction * MEAN_FLOW, fraction * HALF_DROP
    friction = bristle(v) if "F_C" in v else memory(v)

    def rates(y: np.ndarray, _time: float) -> Sequence[float]:
        x1, v1, x2, v2, p, *own = y.tolist()
        slip = v2 - v1
        rubbing, own_rates = friction(slip, own)
        between = area * p - rubbing
        inflow = mean - drop * tanh(STEEPNESS * (p - p_max)) - area * slip
        return (
            v1,
            (-spring * x1 - between) / m1,
            v2,
            (between - contact * x2) / m2,
            modulus * inflow / (column + x2 - x1),
            *own_rates,
        )

    return rates


class LsodaPosterior:
    """log-posterior(z) of one walker (size,); counts the seconds spent in the solver.

    - `rtol`: relative; `atol`: in units of the states' typical sizes.
    """

    def __init__(self, problem: Problem, rtol: float = RTOL, atol: float = ATOL):
        own = (scale for effect in problem.effects for scale in effect.scales)
        scales = np.array((*CORE_SCALES, *own))
        self.problem, self.rtol, self.atol = problem, rtol, atol * scales
        self.solving = 0.0
        self._values = eqx.filter_jit(lambda p, z: p.parameters.values(z))
        self._likelihood = eqx.filter_jit(lambda p, s, v: marginal_likelihood(p.pieces, s, v).value)

    def __call__(self, z: np.ndarray) -> float:
        values = self._values(self.problem, jnp.asarray(z)[None])
        began = time.perf_counter()
        series = self.simulate({k: v.item() for k, v in jax.device_get(values).items()})
        self.solving += time.perf_counter() - began
        value = float(self._likelihood(self.problem, series, values)[0])
        return value - 0.5 * float(z @ z) - 0.5 * len(z) * LOG_2PI

    def simulate(self, values: Values) -> list[dict[str, np.ndarray]]:
        """Ideal readings of every group, (samples, tracks, 1), as `Problem.predict` gives them."""
        return [self._group(group, values) for group in self.problem.groups]

    def _group(self, group: AbstractGroup, values: Values) -> dict[str, np.ndarray]:
        out = {q: np.zeros((group.samples, len(group.tracks), 1)) for q in group.quantities}
        for i, track in enumerate(group.tracks):
            seen = Scoped(values, track.scope)
            one = self._slow(track, seen) if track.drive else self._release(track, seen)
            for quantity, (first, series) in one.items():
                out[quantity][first : first + len(series), i, 0] = series
        return out

    def _slow(self, track: Track, v: Values) -> dict[str, tuple[int, np.ndarray]]:
        """Load, stroke and pressure of a driven record."""
        drive = track.drive
        assert drive is not None  # a slow record has one
        contact = v["k_frame"] if track.kind == "frame" else 0.0
        times = drive.times
        bounds = (drive.first, *(s for s in drive.switches if s < times[-1]), times[-1])
        state, parts = np.zeros(len(self.atol)), []
        for level, (begin, end) in zip(drive.levels, pairwise(bounds), strict=False):
            last = end == times[-1]
            inside = times[(times > begin - EDGE) & ((times < end - EDGE) | last)]
            later = inside[(inside > begin + EDGE) & (inside < end)]
            fraction = v[flow_label(track, level)] if level else 0.0
            path = self._solve(rates_of(v, contact, fraction), state, (begin, *later, end))
            state = path[-1]
            at_begin = len(inside) - len(later) - last
            parts.append(path[1 - at_begin : None if last else -1])
        y = np.concatenate(parts)
        series = {"load": -v["k_LC"] * y[:, 0], "stroke": y[:, 2] - y[:, 0], "pressure": y[:, 4]}
        return {quantity: (0, s) for quantity, s in series.items()}

    def _release(self, track: Track, v: Values) -> dict[str, tuple[int, np.ndarray]]:
        """Acceleration after a release, from rest under the preload."""
        assert track.onset is not None  # a release has one
        preload = v[f"preload[{track.label}]"]
        at_rest = -preload / v["k_LC"]
        start = np.zeros(len(self.atol))
        start[[0, 2, 4]] = at_rest, at_rest, preload / v["S_Pl"]
        delay = float(track.onset_time) - v[f"release_time[{track.label}]"]
        times = delay + track.interval * np.arange(int(track.samples) - track.onset)
        rates = rates_of(v, 0.0, 0.0)
        path = self._solve(rates, start, (0.0, *times))[1:]
        return {"acceleration": (track.onset, np.array([rates(y, 0.0)[3] for y in path]))}

    def _solve(self, rates: Rates, state: np.ndarray, times: Sequence) -> np.ndarray:
        return odeint(
            rates, state, times, rtol=self.rtol, atol=self.atol, tcrit=times[-1:], mxstep=MAX_STEPS
        )

"""Likelihood of a quick release against a bare loop over the samples in NumPy and SciPy."""

import math
from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np
from campaign import Bench, batched, median_time
from scipy.linalg import expm
from table import Row, ratio_row

from rigid.inference.sample import cores
from rigid.likelihood.channels import Piece
from rigid.likelihood.groups import ReleaseGroup
from rigid.likelihood.parameters import Scoped
from rigid.likelihood.problem import Problem, predict, walkers
from rigid.likelihood.tracks import Track
from rigid.physics.rig import CORE_SCALES

SCALES = np.array((*CORE_SCALES, 1e3, 1e3))
LOG_SQRT_2PI = 0.9189385332046727


def matrix(v: Mapping[str, float]) -> np.ndarray:
    """dy/dt = A y of the rig swinging free, valve shut, column frozen; scaled states."""
    m1, m2, area = v["M_HC"] - v["M_Pl"], v["M_Pl"] + 0.5 * v["M_Fl"], v["S_Pl"]
    a = np.zeros((7, 7))
    a[0, 1] = a[2, 3] = 1.0
    a[1] = np.array([-v["k_LC"], -v["mu"], 0.0, v["mu"], -area, 1.0, 1.0]) / m1
    a[3] = np.array([0.0, v["mu"], 0.0, -v["mu"], area, -1.0, -1.0]) / m2
    a[4, 1], a[4, 3] = np.array([1.0, -1.0]) * v["k_oil"] / v["L_0"]
    for i in (1, 2):
        mu, tau = v[f"mu_branch[{i}]"], v[f"tau_branch[{i}]"]
        a[4 + i, 1], a[4 + i, 3], a[4 + i, 4 + i] = -mu / tau, mu / tau, -1.0 / tau
    return a * SCALES / SCALES[:, None]


def swing(v: Mapping[str, float], track: Track) -> np.ndarray:
    """Acceleration at every sample after the release, by a loop of matrix-vector products."""
    a = matrix(v)
    preload = v[f"preload[{track.label}]"]
    rest = -preload / v["k_LC"]
    y = np.array([rest, 0.0, rest, 0.0, preload / v["S_Pl"], 0.0, 0.0]) / SCALES
    assert track.onset is not None  # a release has one
    y = expm(a * (v["onset"] - v[f"release_time[{track.label}]"])) @ y
    step, last = expm(a * track.interval), a[3] * SCALES[3]
    out = np.empty(track.samples - track.onset)
    for i in range(len(out)):
        out[i] = last @ y
        y = step @ y
    return out


def log_likelihood(v: Mapping[str, float], track: Track, data: np.ndarray) -> float:
    """Gaussian, gain and zero of the sensor left out: less work than rigid does."""
    sigma = v["noise[acceleration,A]"]
    residual = data[track.onset :] - swing(v, track)
    return float(
        -0.5 * residual @ residual / sigma**2 - len(residual) * (math.log(sigma) + LOG_SQRT_2PI)
    )


def alone(problem: Problem) -> Problem:
    """The problem with one release and nothing else."""
    number = next(i for i, g in enumerate(problem.groups) if isinstance(g, ReleaseGroup))
    track = problem.groups[number].tracks[0]
    piece = next(p for p in problem.pieces if p.group == number)
    data, weight = piece.data[:, :1], piece.weight[:, :1]
    one = Piece(0, piece.quantity, piece.sheet, (0,), piece.cylinders[:1], data, weight)
    groups = (ReleaseGroup((track,), problem.effects),)
    return Problem(problem.effects, problem.parameters, groups, (one,))


def rows(bench: Bench) -> list[Row]:
    """One release, one walker."""
    problem = alone(bench.problem)
    track, data = problem.groups[0].tracks[0], np.asarray(problem.pieces[0].data)[:, 0]
    z = bench.draws(walkers(problem) // 2 * cores() * bench.choose(8, 64))
    ours = batched(problem, z, bench.runs)
    values = problem.parameters.values(jnp.asarray(z[:1]))
    v = {k: x.item() for k, x in jax.device_get(values).items()}
    v |= {"onset": float(track.onset_time)}
    v = Scoped(v, track.scope)
    theirs = median_time(lambda: log_likelihood(v, track, data), 10 * bench.runs)
    series = np.asarray(predict(problem, jnp.asarray(z[:1]))[0]["acceleration"])[:, 0, 0]
    apart = np.abs(series[track.onset :] - swing(v, track)).max()
    sides = "quick-release likelihood, per walker", "bare NumPy/SciPy matrix-exponential loop"
    return [
        ratio_row(
            sides,
            theirs / ours.per_walker,
            1.0,
            f"rigid {1e6 * ours.per_walker:.3g} us, gain and zero integrated out, prior included; "
            f"the loop {1e6 * theirs:.3g} us; {len(data) - (track.onset or 0)} samples",
            f"largest difference of the two accelerations: {apart:.2g} m/s^2",
        )
    ]

"""Effective samples per second of the slowest parameter, whole fit, against three peers.

None of the peers could finish this campaign in a day. What their samplers need for an effective
sample is measured on rigid's fast log-posterior, which is the same posterior (the row `joint`
shows that); what an evaluation costs them is measured on their own solver, in a shortened run.
Search, warm-up and start-up count for rigid and are given to the peers for nothing.
"""

import importlib.util

import joint
import peer_emcee
from campaign import Bench
from table import Row, missing, ratio_row
from wall import fits

from rigid.inference.sample import cores

WHAT = "effective samples per second of the slowest parameter, whole fit"


def ours(bench: Bench) -> float:
    """Effective samples a second of the command, start to report, cache warm."""
    warm = fits(bench).warm[0]
    return warm.ess / warm.wall


def rows(bench: Bench) -> list[Row]:
    """Beside emcee with LSODA."""
    warm = fits(bench).warm[0]
    said = (
        f"rigid: {warm.ess:.0f} in {warm.wall:.0f} s, {ours(bench):.3g} a second, start to report"
    )
    peer = peer_emcee.measured(bench)
    reliable = "" if peer.steps > 50 * peer.tau else " (chain shorter than 50 of it: too low)"
    return [
        ratio_row(
            (WHAT, "emcee with SciPy LSODA"),
            ours(bench) / peer.ess_per_second,
            300.0,
            said,
            f"emcee, stretch moves from points of the posterior: {peer.tau:.0f} steps a free draw"
            f"{reliable}, from {peer.steps} steps on rigid's log-posterior",
            f"{1e3 * peer.seconds:.3g} ms an evaluation with LSODA, {cores()} processes, from a "
            f"shortened run of {peer.evaluations} evaluations; "
            f"together {peer.ess_per_second:.2g} a second",
        )
    ]


def pints(bench: Bench) -> list[Row]:
    """Beside PINTS."""
    sides = WHAT, "PINTS with SciPy LSODA"
    if importlib.util.find_spec("pints") is None:
        return [missing(sides, "ahead", "pints")]
    import peer_pints

    peer = peer_pints.measured(bench)
    seconds = joint.lsoda(bench).seconds / cores()
    theirs = 1.0 / (peer.evaluations_each * seconds)
    row = ratio_row(
        sides,
        ours(bench) / theirs,
        1.0,
        f"PINTS, HaarioBardenetACMC, {peer_pints.CHAINS} chains begun at points of the posterior "
        "with its covariance, second half: "
        f"{peer.evaluations_each:.3g} evaluations an effective sample, from {peer.iterations} "
        "iterations on rigid's log-posterior",
        f"{1e3 * seconds:.3g} ms an evaluation: LSODA's median over {cores()} cores; together "
        f"{theirs:.2g} a second",
    )
    return [row]


def numpyro(bench: Bench) -> list[Row]:
    """Beside NumPyro."""
    sides = WHAT, "NumPyro NUTS through diffrax"
    if importlib.util.find_spec("numpyro") is None:
        return [missing(sides, "ahead", "numpyro")]
    import peer_numpyro

    peer = peer_numpyro.measured(bench)
    theirs = cores() / peer.gradient
    row = ratio_row(
        sides,
        ours(bench) / theirs,
        1.0,
        f"one gradient of the whole campaign by Kvaerno5 at {peer_numpyro.TOLERANCE:g}, in reverse "
        f"mode: {peer.gradient:.3g} s; a chain a core",
        "the ratio grants NUTS an effective sample for every gradient, which it never reaches: in "
        f"a shortened run on release-1 alone ({peer.draws} draws after {peer_numpyro.WARM_UP} of "
        f"warm-up, {peer.seconds:.0f} s with compiling) it took {peer.steps:.0f} gradients a draw",
    )
    return [row]

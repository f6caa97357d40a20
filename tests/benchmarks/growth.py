"""How the cost of a log-posterior grows with the length and with the number of records."""

import dataclasses
import time

import jax.numpy as jnp
import numpy as np
from campaign import Bench, median_time
from table import Row

from rigid.likelihood.channels import make_pieces
from rigid.likelihood.groups import SlowGroup
from rigid.likelihood.parameters import Parameters
from rigid.likelihood.problem import Problem, log_posterior
from rigid.likelihood.tracks import Series, Track

FACTORS = (1, 3, 10, 30, 100)
QUICK_FACTORS = (1, 10, 100)
WALKERS = 8
JITTER = 0.15
"""[s]: switches of one record against another's, as in the reference campaign."""
STEEPEST = 1.1
"""Exponent up to which growth counts as linear."""


@dataclasses.dataclass(frozen=True)
class Curve:
    """Seconds an evaluation (a batch of WALKERS) and to compile, by factor."""

    what: str
    factors: np.ndarray
    seconds: np.ndarray
    compiling: np.ndarray

    @property
    def exponent(self) -> float:
        """Slope of the straight line through the logarithms."""
        return float(np.polyfit(np.log(self.factors), np.log(self.seconds), 1)[0])

    @property
    def last(self) -> float:
        """The same between the two largest factors, where fixed costs count least."""
        return float(np.diff(np.log(self.seconds))[-1] / np.diff(np.log(self.factors))[-1])


def lengthened(track: Track, times: int) -> Track:
    """The record with its valve programme over and over again."""
    drive = track.drive
    assert drive is not None  # a slow record has one
    period = drive.interval * int(drive.samples)
    switches, levels = [], []
    for k in range(times):
        switches += [s + k * period for s in drive.switches] + [(k + 1) * period + drive.first]
        levels += drive.levels
    samples = int(drive.samples) * times
    longer = dataclasses.replace(
        drive, samples=samples, switches=switches[:-1], levels=tuple(levels), size=samples
    )
    changed = {"drive": longer, "samples": samples, "size": samples}
    return dataclasses.replace(track, **changed)


def shifted(track: Track, number: int) -> Track:
    """A further record of the same kind, its switches a little elsewhere."""
    drive = track.drive
    assert drive is not None  # a slow record has one
    rng = np.random.default_rng(number)
    switches = tuple(float(s + rng.uniform(-JITTER, JITTER)) for s in drive.switches)
    name = f"{track.name}-{number}"
    label = f"{name},{track.cylinder}"
    return dataclasses.replace(
        track, label=label, name=name, drive=dataclasses.replace(drive, switches=switches)
    )


def problem_of(base: Problem, tracks: tuple[Track, ...]) -> Problem:
    """The problem of slow records of one kind, with made-up readings: only its cost matters."""
    group = SlowGroup(tracks, base.effects)
    of = base.groups[0].tracks[0].label
    kept = [p for p in base.parameters.sampled if of not in p.label]
    local = [p for p in base.parameters.sampled if of in p.label]
    added = [
        dataclasses.replace(p, label=p.label.replace(of, t.label), record=t.name)
        for t in tracks
        for p in local
    ]
    rng = np.random.default_rng(0)
    series = {
        t.label: Series(
            {q: rng.standard_normal(t.samples) for q in group.quantities},
            {q: np.ones(t.samples) for q in group.quantities},
        )
        for t in tracks
    }
    sheets = {p.quantity: p.sheet for p in base.pieces}
    parameters = Parameters((*kept, *added), base.parameters.known)
    return Problem(base.effects, parameters, (group,), make_pieces((group,), series, sheets))


def measured(problem: Problem, runs: int) -> tuple[float, float]:
    """Seconds to evaluate a batch, and to compile its program."""
    z = jnp.zeros((WALKERS, problem.parameters.size))
    began = time.perf_counter()
    log_posterior(problem, z).block_until_ready()
    first = time.perf_counter() - began
    seconds = median_time(lambda: log_posterior(problem, z).block_until_ready(), runs)
    return seconds, first - seconds


def curve(bench: Bench, what: str) -> Curve:
    """Measure all factors."""
    base = bench.plain
    track = base.groups[0].tracks[0]
    factors = QUICK_FACTORS if bench.quick else FACTORS
    found = []
    for k in factors:
        tracks = (lengthened(track, k),)
        if what == "number of records":
            tracks = tuple(shifted(track, i) for i in range(k))
        found.append(measured(problem_of(base, tracks), bench.runs))
    return Curve(what, np.array(factors), *np.array(found).T)


def plot(curves: list[Curve], bench: Bench) -> None:
    """Write the plot beside the table."""
    import matplotlib

    matplotlib.use("svg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(curves), figsize=(8, 3.2), sharey=True)
    for axis, one in zip(axes, curves, strict=True):
        axis.loglog(one.factors, 1e3 * one.seconds / WALKERS, "o-", color="0.2")
        line = one.seconds[-1] * one.factors / one.factors[-1]
        axis.loglog(one.factors, 1e3 * line / WALKERS, "--", color="0.6", label="linear")
        axis.set_xlabel(f"{one.what}, times frame-1")
        axis.set_title(f"exponent {one.exponent:.2f}, at the end {one.last:.2f}", fontsize=9)
    axes[0].set_ylabel("ms a walker")
    axes[0].legend(frameon=False)
    figure.tight_layout()
    assert bench.out is not None  # the caller asks
    figure.savefig(bench.out / "speed-growth.svg", metadata={"Date": None})
    plt.close(figure)


def rows(bench: Bench) -> list[Row]:
    """Growth over two decades of either."""
    curves = [curve(bench, what) for what in ("record length", "number of records")]
    notes = ["copies of the frame record frame-1, batches of 8 walkers on one thread"]
    if bench.out is not None:
        plot(curves, bench)
        notes.append("![growth](speed-growth.svg)")
    return [
        Row(
            f"growth with {c.what}, two decades",
            "linear",
            f"exponent {c.exponent:.2f}, {c.last:.2f} at the end",
            f"at most {STEEPEST:g}",
            max(c.exponent, c.last) <= STEEPEST,
            (
                *notes,
                "ms a walker: "
                + ", ".join(
                    f"{k} times {1e3 * s / WALKERS:.3g}"
                    for k, s in zip(c.factors, c.seconds, strict=True)
                ),
                "compiling [s]: " + ", ".join(f"{s:.0f}" for s in c.compiling),
            ),
        )
        for c in curves
    ]

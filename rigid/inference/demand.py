"""Memory and time that a fit takes, counted from its records, walkers and derivatives.

Memory is that of the arrays that are alive together; each count is that of the stage that makes
them. Time is that of the evaluations of the likelihood at the rates below.
"""

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.inference.calibrate import KEPT_STEPS, MODE_DRAWS, PREDICTED, TABLED_STEPS
from rigid.inference.friction_curve import FREQUENCIES, scopes
from rigid.inference.newton import is_noise
from rigid.inference.tangents import tangents
from rigid.io.compiled import compiled
from rigid.io.errors import InputError
from rigid.io.progress import duration
from rigid.jobs.memory import available
from rigid.likelihood.groups import AbstractGroup, MotionGroup, ReleaseGroup, SlowGroup
from rigid.likelihood.machine_group import MachineGroup
from rigid.likelihood.problem import Problem, walkers
from rigid.physics.drive import Drives, plan
from rigid.physics.staggered import cut_of
from rigid.spec import SamplerSpec

DOUBLE, SINGLE = 8, 4

PROCESS = 640 << 20
"""Bytes of Python, JAX, libraries and the pages' figures."""
PROGRAMS = {
    SlowGroup: 900 << 20,
    ReleaseGroup: 150 << 20,
    MotionGroup: 50 << 20,
    MachineGroup: 300 << 20,
}
"""Bytes that the programs of a sort of group keep, those of diffrax among them, with what their
compiler took: the process does not give it back. A fit of one motion of 380 samples holds 690 MiB
in all, the reference calibration 1.7 GiB with programs kept from before and 2.3 GiB without."""

LAW, FORCES = 8, 5
"""Arrays of a sample that its law takes, and of a walker's motion that become its force."""
TIMES_LOCAL = 40
"""Expansions that a start of the search takes, refinement included: 16 starts took some 40 each."""
STEPS_A_DRAW = 12.0
"""Steps of all walkers for one effective draw of the slowest number."""

FINE, COARSE, RELEASE, MOTION, LIKELIHOOD = 450e-9, 15e-9, 45e-9, 50e-9, 15e-9
"""Processor seconds a sample, record and walker: a step of one sample, a sample within a long step,
of a release, of a motion, and of the likelihood of a reading. Measured on one core of 2026."""
MACHINE, USUAL_STATES = 300e-9, 4
"""Of one step of a machine of so many states on the same core; it goes with their square. Measured,
us, of 2, 4, 7 and 10 states: 0.06, 0.29, 0.57, 2.26 (`tests/machines/`)."""
SHORT = 50e-9
"""Of one short step of a rig with dry friction or air."""
FULL = 40.0
"""Times by which diffrax is slower than a step a sample."""
DERIVATIVE = 2.0
"""Times by which a derivative takes longer than an evaluation."""
START_S, COMPILE_S, REPORT_S = 8.0, 8.0, 25.0
"""Seconds until a process has its libraries, for the programs of a group, and for the page."""


@dataclass(frozen=True)
class Demand:
    """What a fit takes.

    - `stages` [bytes]: most that is held, by what holds it. - `seconds`: of wall time, nothing else
      running. - `steps`: of the chain that both count on. - `cores`: threads side by side.
    """

    stages: Mapping[str, int]
    seconds: float
    steps: int
    cores: int

    @property
    def memory(self) -> int:
        """Bytes that the fit holds at most."""
        return max(self.stages.values())

    @property
    def most(self) -> str:
        """What takes that memory."""
        return max(self.stages, key=lambda name: self.stages[name])

    @property
    def says(self) -> str:
        """One sentence for whoever waits."""
        cores, room = "1 core" if self.cores == 1 else f"{self.cores} cores", available()
        refused = "; it would be refused" if self.memory > room else ""
        return (
            f"a fit takes about {duration(self.seconds)} and {_gib(self.memory)} of memory on this "
            f"machine ({cores}, {_gib(room)} free) with {self.steps} steps of a chain, less where "
            f"weighted draws do{refused}"
        )

    def require_room(self, where: object) -> None:
        """Refuse a fit that this machine cannot hold.

        - `where`: the spec, for the message.

        Raises InputError where memory that is free does not do.
        """
        room = available()
        if self.memory <= room:
            return
        raise InputError(
            f"{where}: a fit would hold about {_gib(self.memory)} of memory, most of it for "
            f"{self.most}; {_gib(room)} are free on this machine; fit fewer or shorter records "
            "together, or take a machine with more memory"
        )


def _gib(size: int) -> str:
    return f"{size / 2**30:.2g} GiB"


def demand(problem: Problem, rule: SamplerSpec, cores: int = os.cpu_count() or 1) -> Demand:
    """Count what a fit takes.

    - `rule`: how it samples. - `cores`: threads that evaluate side by side.
    """
    wide = rule.walkers or walkers(problem)
    chains = rule.ensembles * wide
    steps = _steps(rule, chains)
    held = PROCESS + sum(PROGRAMS[sort] for sort in {type(group) for group in problem.groups})
    alone = {
        "derivatives of the search": min(cores, max(rule.starts - 1, 1)) * _local(problem),
        "walkers that are simulated side by side": max(
            min(cores, rule.ensembles) * _batch(problem, wide // 2),
            cores * _batch(problem, walkers(problem) // 2),
        ),
        "predictions beside the records": _shown(problem),
        "the chain and its tables": 3 * chains * steps * (problem.parameters.size + 1) * DOUBLE
        + _tables(problem, chains, steps),
    }
    # Predictions are made when the chain is there.
    alone["predictions beside the records"] += alone["the chain and its tables"]
    return Demand(
        {name: held + own for name, own in alone.items()},
        _seconds(problem, rule, (chains, steps), cores),
        steps,
        cores,
    )


def _steps(rule: SamplerSpec, chains: int) -> int:
    """Steps until there are draws enough: two blocks at least, a quarter is dropped."""
    wanted = STEPS_A_DRAW * rule.ess / chains / 0.75
    return min(rule.max_steps, rule.block * max(2, math.ceil(wanted / rule.block)))


def _cells(problem: Problem) -> int:
    """Samples of all channels on the grids that are simulated."""
    return sum(piece.data.size for piece in problem.pieces)


def _on_the_way(problem: Problem) -> int:
    """Samples of channels, as often as a simulation holds each of a walker beside its readings."""
    motions = [isinstance(group, MotionGroup) for group in problem.groups]
    return sum(p.data.size * (FORCES if motions[p.group] else 0) for p in problem.pieces)


def _local(problem: Problem) -> int:
    """Bytes of one expansion: readings and their derivatives, the design and its weighted copy.

    LAW more of every sample are its law's: residual, value, score, curvature, each once weighted.
    """
    directions = tangents(problem, np.flatnonzero(~is_noise(problem))).along.shape[1]
    design = directions + 2  # gain and zero of the sensor
    ours = _cells(problem) * (2 * directions + 2 * design + LAW)
    return DOUBLE * (ours + _on_the_way(problem) * directions)


def _batch(problem: Problem, wide: int) -> int:
    """Bytes of one evaluation of walkers: their readings, and these once more in turns."""
    return DOUBLE * (2 * _cells(problem) + _on_the_way(problem)) * wide


def _shown(problem: Problem) -> int:
    """Bytes of predictions from the posterior and the prior, beside the data.

    Readings of all records while channels are made of them, one channel on its way (readings,
    replicates and a sorted copy), and the replicates of both, which the file takes once more.
    """
    half = walkers(problem) // 2
    padded = half * math.ceil(PREDICTED / half)
    longest = max(piece.data.shape[0] for piece in problem.pieces)
    held = DOUBLE * padded + 3 * SINGLE * PREDICTED
    return _cells(problem) * held + 4 * DOUBLE * PREDICTED * longest


def _tables(problem: Problem, chains: int, steps: int) -> int:
    """Bytes of values and friction of the draws; friction is held six times while it is made."""
    kept = max(steps - max(steps // 4, 1), 1)
    draws = chains * (min(kept, TABLED_STEPS) + min(kept, KEPT_STEPS))
    labels = len(problem.parameters.sampled) + len(problem.parameters.known)
    return DOUBLE * draws * (2 * labels + 6 * len(scopes(problem)) * len(FREQUENCIES))


def _seconds(problem: Problem, rule: SamplerSpec, chain: tuple[int, int], cores: int) -> float:
    """Seconds of wall time."""
    chains, steps = chain
    one = sum(_simulation(group) for group in problem.groups) + LIKELIHOOD * _cells(problem)
    free = int(np.count_nonzero(~is_noise(problem)))
    search = rule.starts * TIMES_LOCAL * free * DERIVATIVE
    draws = (
        chains * (steps + 1) + 2 * MODE_DRAWS + 2 * chains * min(steps, KEPT_STEPS) + 4 * PREDICTED
    )
    threads = min(cores, rule.ensembles)
    fixed = START_S + COMPILE_S * len(problem.groups) + REPORT_S
    return fixed + one * (search / min(cores, rule.starts) + draws / threads)


def _simulation(group: AbstractGroup) -> float:
    """Processor seconds of one walker of a group."""
    tracks, samples = len(group.tracks), group.samples
    if isinstance(group, SlowGroup):
        return tracks * _slow(group)
    if isinstance(group, ReleaseGroup):
        steady = all(effect.steady for effect in group.effects)
        each = RELEASE if steady else RELEASE + SHORT * cut_of(group.effects).release
        return tracks * samples * each * (FULL if group.tolerance is not None else 1.0)
    if isinstance(group, MachineGroup):
        marched = samples * group.layout.steps * len(group.runs)
        marched *= MACHINE * (_states(group) / USUAL_STATES) ** 2
        return marched * (FULL if group.tolerance is not None else 1.0)
    return tracks * samples * MOTION


def _states(group: MachineGroup) -> int:
    """Numbers that a march of a machine carries."""
    own = sum(len(effect.scales) for effect in group.effects)
    oil = sum(place.oil for place in group.places)
    return 2 * len(group.layout.coordinates) + oil + own


def _slow(group: SlowGroup) -> float:
    """Processor seconds of one walker and track of slow records.

    Steady rigs take a step a sample where a valve moves, twice as long until they ring no more,
    and where they press against a frame under a pump; elsewhere their steps are long.
    """
    if group.tolerance is not None:
        return group.samples * FINE * FULL
    if not all(effect.steady for effect in group.effects):
        return group.samples * cut_of(group.effects).slow * SHORT
    near, moving = (int(count) for count in _short_steps(group.grid.drives))
    fine = 2 * near
    if group.tracks[0].of.contact == "frame":
        fine = max(fine, moving)
    return fine * FINE + group.samples * COARSE


@compiled
def _short_steps(drives: Drives) -> tuple[Array, Array]:
    """Count steps in which a valve moves or has just moved; these and all under a pump.

    Compiled as one: by itself each operation is a program, and together they take ten times longer.
    """
    laid = plan(drives)
    return jnp.sum(laid.near), jnp.sum(laid.near | laid.levels.any(axis=1))

"""Programs that hold many effects at once, each absent until its amplitude says otherwise.

Compiling a rig anew for every candidate would take longer than all else. So what all of them would
leave is simulated by few programs: one with every steady effect and the hidden forces and flows,
one with those of them that hardly cost time, one with all others that have no state of their own,
and one in which the laws of dry friction take turns. Effects that are not asked for stand at the
value at which they are absent. Fits take many turns, and are led to their optima in narrower
programs, in steps as short as a fit needs them.
"""

import dataclasses
import os
from collections.abc import Callable, Container, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.effects import AbstractEffect
from rigid.io.compiled import compiled
from rigid.likelihood.groups import AbstractGrid, AbstractGroup
from rigid.likelihood.per_record import of_all
from rigid.likelihood.problem import Problem
from rigid.localfit.candidates import quiet_values
from rigid.localfit.hidden_inputs import hidden_of
from rigid.localfit.one_of import one_of, sharing, turn_of
from rigid.physics.rig import acting

Effects = tuple[type[AbstractEffect], ...]
Swept = list[tuple[dict[str, np.ndarray], dict[str, np.ndarray]]]
"""Readings and their slopes by quantity, (samples, tracks, lanes), for every group."""
Parts = tuple[dict[str, Array], ...]

LANES = 16
"""Simulations side by side in one program; a sweep of more takes several turns. A turn of steady
effects with derivatives takes a third of one of 32, a turn of others as long as one of 8."""
WIDER = 24
"""Simulations side by side where there are more than LANES of a rig that is not steady, and one
turn does: it takes 1.4 times one of LANES."""


@dataclasses.dataclass(frozen=True)
class Family:
    """One program: the groups of a problem with further effects in them.

    - `effects`: those further ones. - `groups`: with all of them. - `quiet`: values by label at
      which none of the further effects is there. - `turns`: labels of those that take turns, each 1
      where it is its turn. - `width`: simulations side by side; left out,
      LANES. - `kinds`: of records that are simulated, all others come out as 0; left out, all.
    """

    effects: Effects
    groups: tuple[AbstractGroup, ...]
    quiet: Mapping[str, float]
    turns: Mapping[type[AbstractEffect], str] = dataclasses.field(default_factory=dict)
    width: int | None = None
    kinds: Container[str] | None = None

    @property
    def steady(self) -> bool:
        """Whether every effect in it is: then derivatives cost little."""
        return all(e.steady for group in self.groups for e in group.effects)

    @property
    def lanes(self) -> int:
        """Simulations side by side where there are enough."""
        return LANES if self.width is None else self.width

    def side_by_side(self, lanes: int) -> int:
        """Simulations side by side where so many are asked for."""
        wider = self.width is None and not self.steady and LANES < lanes <= WIDER
        return WIDER if wider else self.lanes

    def over(self, problem: Problem, kinds: Container[str] | None = None) -> "Family":
        """Return the program of the same effects for other records of the same model.

        - `kinds`: of the records that are simulated; left out, all.
        """
        return dataclasses.replace(_family(problem, self.effects), width=self.width, kinds=kinds)

    def simulates(self, group: AbstractGroup) -> bool:
        """Whether a group is simulated."""
        return self.kinds is None or group.tracks[0].kind in self.kinds


def families(
    problem: Problem, candidates: Iterable[type[AbstractEffect]], together: bool = False
) -> tuple[Family, ...]:
    """Part candidates into programs: steady effects and the hidden ones first, then others.

    What adds a state, or a look at more than an instant, costs all others time: of a turn with
    every steady effect three quarters. So those that do neither have a first program of their own,
    and laws of dry friction another, in which they take turns. What others than steady effects
    change is simulated in coarse steps: no fit is made by these programs.

    - `together`: all in one program.
    """
    listed = tuple(e for e in dict.fromkeys(candidates) if e not in problem.effects)
    if together:
        return (_family(problem, listed),)
    steady = tuple(e for e in listed if e.steady)
    moving = [e for e in listed if not e.steady]
    light = tuple(e for e in steady if _light(e))
    found = [_family(problem, some + hidden_of(problem)) for some in dict.fromkeys((light, steady))]
    plain = tuple(e for e in moving if not e.scales)
    lots = [plain] if plain else []
    lots += sharing(e for e in moving if e.scales)
    return (*found, *(_coarse(problem, some) for some in lots))


def _light(effect: type[AbstractEffect]) -> bool:
    """Whether an effect has no state of its own and leaves readings at their instants."""
    late = effect.delays is not AbstractEffect.delays
    return not (effect.scales or late or effect.averaging is not AbstractEffect.averaging)


def _family(problem: Problem, effects: Effects) -> Family:
    groups = []
    for group in problem.groups:
        more = acting(effects, group.tracks[0].kind)
        groups.append(dataclasses.replace(group, effects=group.effects + more))
    quiet = {label: value for effect in effects for label, value in quiet_values(effect).items()}
    quiet |= dict.fromkeys(of_all(effects, problem.tracks), 0.0)
    return Family(effects, tuple(groups), quiet)


def _coarse(problem: Problem, effects: Effects) -> Family:
    """Return the program of effects that change a little; those with states take turns."""
    taking = len(effects) > 1 and bool(effects[0].scales)
    made = _family(problem, (one_of(effects),) if taking else effects)
    turns = {effect: turn_of(effect) for effect in effects} if taking else {}
    groups = tuple(group.coarser() for group in made.groups)
    return dataclasses.replace(made, effects=effects, groups=groups, turns=turns)


def narrow(
    found: tuple[Family, ...], problem: Problem, effects: Iterable[type[AbstractEffect]]
) -> Family:
    """Return the program in which a fit with some effects costs least.

    - `found`: by `families`. - `problem`: the model without them.

    Step matrices cost the third power of a rig's states. With all steady effects that add states a
    turn takes five times as long as with one of them.
    """
    wanted, light = tuple(effects), found[0].effects
    if set(wanted) <= set(light):
        return found[0]
    if all(e.steady for e in wanted):
        return _family(problem, tuple(dict.fromkeys(light + wanted)))
    return _family(problem, wanted)


def holding(found: tuple[Family, ...], effects: Iterable[type[AbstractEffect]]) -> Family:
    """Return the first program that has all of some effects.

    Raises KeyError where none has.
    """
    wanted = set(effects)
    for family in found:
        if wanted <= set(family.effects):
            return family
    raise KeyError(sorted(e.name for e in wanted))


@compiled
def _moving(
    groups: tuple[AbstractGroup, ...], values: dict[str, Array], tangents: dict[str, Array]
) -> tuple[list[tuple], list[tuple]]:
    """What the simulation of each group takes, and how it changes along tangents of the values."""
    return jax.jvp(lambda v: [group.inputs(v) for group in groups], (values,), (tangents,))


@compiled
def _inputs(groups: tuple[AbstractGroup, ...], values: dict[str, Array]) -> list[tuple]:
    """What the simulation of each group takes."""
    return [group.inputs(values) for group in groups]


@compiled
def _swept(grid: AbstractGrid, inputs: tuple, tangents: tuple) -> Parts:
    """Readings on a grid and their derivatives; groups of one shape share the program."""
    return jax.jvp(grid.simulate, (inputs,), (tangents,))


@compiled
def _read(grid: AbstractGrid, inputs: tuple) -> dict[str, Array]:
    """Readings on a grid; groups of one shape share the program."""
    return grid.simulate(inputs)


def sweep(
    family: Family,
    values: Mapping[str, np.ndarray],
    tangents: Mapping[str, np.ndarray],
    acts: Mapping[str, np.ndarray] | None = None,
) -> Swept:
    """Simulate all records, with one derivative in each lane.

    - `values`: by label, (lanes,) each; what is left out of the family's effects is absent.
    - `tangents`: direction in each lane, by label; 0 where left out.
    - `acts`: by kind of record, the lanes that are asked for there (lanes,); what is not comes out
      as 0. Left out: all of them everywhere.
    """
    none = np.zeros(len(next(iter(values.values()))))
    along = {k: tangents.get(k, none) for k in (*family.quiet, *values)}

    def one(number: int, here: dict[str, Array], mine: np.ndarray, width: int) -> Parts:
        group = family.groups[number]
        inputs, moving = _moving(family.groups, here, _cut(along, mine, width))
        read, slopes = _swept(group.grid, inputs[number], moving[number])
        return group.own(read), group.own(slopes)

    return [(parts[0], parts[1]) for parts in _in_turns(family, values, acts, one, 2)]


def read(
    family: Family,
    values: Mapping[str, np.ndarray],
    acts: Mapping[str, np.ndarray] | None = None,
) -> list[dict[str, np.ndarray]]:
    """Simulate all records without derivatives: readings of every group, as in `Swept`.

    - `values`, `acts`: as in `sweep`. A lane takes a fifth of the time that one with a derivative
      takes where a rig is not steady.
    """

    def one(number: int, here: dict[str, Array], *_: object) -> Parts:
        group = family.groups[number]
        return (group.own(_read(group.grid, _inputs(family.groups, here)[number])),)

    return [parts[0] for parts in _in_turns(family, values, acts, one, 1)]


def _in_turns(
    family: Family,
    values: Mapping[str, np.ndarray],
    acts: Mapping[str, np.ndarray] | None,
    simulate: Callable[[int, dict[str, Array], np.ndarray, int], Parts],
    count: int,
) -> list[tuple[dict[str, np.ndarray], ...]]:
    """What `simulate` gives of every group for the lanes that are asked for, 0 for all others.

    - `simulate`: takes the number of a group, values in some lanes, the numbers of these, and to
      how many lanes they are filled up. - `count`: of what it gives; no group may be simulated.
    """
    lanes = len(next(iter(values.values())))
    width = family.side_by_side(lanes)
    every = {k: np.full(lanes, v) for k, v in family.quiet.items()} | dict(values)
    asked = [
        np.flatnonzero(np.ones(lanes) if acts is None else acts[group.tracks[0].kind])
        for group in family.groups
    ]
    jobs = [
        (number, mine[begin : begin + width])
        for number, (mine, group) in enumerate(zip(asked, family.groups, strict=True))
        for begin in range(0, len(mine) if family.simulates(group) else 0, width)
    ]

    def one(job: tuple[int, np.ndarray]) -> tuple[dict[str, np.ndarray], ...]:
        number, mine = job
        here = simulate(number, _cut(every, mine, width), mine, width)
        return jax.tree.map(lambda a: np.asarray(a)[..., : len(mine)], here)

    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        parts = list(pool.map(one, jobs))
    out = []
    for number, group in enumerate(family.groups):
        shape = (group.samples, len(group.tracks), lanes)
        found = tuple({q: np.zeros(shape) for q in group.quantities} for _ in range(count))
        for (at, mine), part in zip(jobs, parts, strict=True):
            if at == number:
                jax.tree.map(partial(_put, mine), found, part)
        out.append(found)
    return out


def _put(lanes: np.ndarray, into: np.ndarray, part: np.ndarray) -> None:
    into[..., lanes] = part


def _cut(lanes: Mapping[str, np.ndarray], mine: np.ndarray, width: int) -> dict[str, Array]:
    """One turn's lanes, filled up with the last."""
    at = np.pad(mine, (0, width - len(mine)), mode="edge")
    return {
        label: jnp.asarray(np.asarray(series, dtype=float)[at]) for label, series in lanes.items()
    }

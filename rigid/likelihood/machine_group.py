"""Runs of a machine simulated together: all joints of a run in one program, for all walkers."""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import Array

from rigid.effects import AbstractEffect
from rigid.io.errors import InputError
from rigid.likelihood.groups import AbstractGrid, AbstractGroup, flow_label
from rigid.likelihood.machine import Layout, Place
from rigid.likelihood.tracks import Track
from rigid.physics import machine_run
from rigid.physics.drive import Drive
from rigid.physics.machine import Machine, Reading
from rigid.physics.machine_run import Drives

X_START, V_START, P_START = "x_start", "v_start", "p_start"
"""Names of where a run that begins in motion begins: coordinates, their rates, pressures."""

SAME_CLOCK = 1e-6
"""Seconds by which the first samples of one run may differ from joint to joint."""


class MachineGrid(AbstractGrid):
    """What is done in the runs of a group, and where it is read, without a name.

    - `picked`: run and joint of each track.
    """

    drives: Drives
    picked: tuple[tuple[int, int], ...] = eqx.field(static=True)
    tolerance: float | None = eqx.field(static=True)

    def simulate(self, inputs: tuple) -> dict[str, Array]:
        """Return readings by quantity; `inputs` as of `MachineGroup.inputs`."""
        read = self.everywhere(inputs)
        runs, joints = (np.array(row) for row in zip(*self.picked, strict=True))
        return {q: series[:, joints, runs] for q, series in read._asdict().items()}

    def everywhere(self, inputs: tuple) -> Reading:
        """Return what sensors would read at all joints in all runs."""
        machine, start, fractions = inputs
        if self.tolerance is None:
            return machine_run.march(machine, start, fractions, self.drives)
        return machine_run.reference(machine, start, fractions, self.drives, self.tolerance)


class MachineGroup(AbstractGroup):
    """Runs of a machine, sampled alike.

    - `layout`: how the machine is put together. - `drives`: what is done in each run.
    """

    tracks: tuple[Track, ...]
    effects: tuple[type[AbstractEffect], ...] = eqx.field(static=True)
    tolerance: float | None = eqx.field(static=True)
    layout: Layout = eqx.field(static=True)
    drives: Drives
    quantities: ClassVar[tuple[str, ...]] = (
        "load",
        "stroke",
        "pressure",
        "acceleration",
        "position",
    )

    @property
    def places(self) -> tuple[Place, ...]:
        """Joints of the machine."""
        return self.layout.places

    @property
    def runs(self) -> tuple[str, ...]:
        """Names of the runs, in order."""
        return tuple(dict.fromkeys(t.name for t in self.tracks))

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the machine's joints, in order."""
        return tuple(place.name for place in self.layout.places)

    @property
    def grid(self) -> MachineGrid:
        """What is done, and where it is read."""
        picked = tuple(
            (self.runs.index(t.name), self.joints.index(t.cylinder)) for t in self.tracks
        )
        return MachineGrid(self.drives, picked, self.tolerance)

    def beginning(self, share: float) -> "MachineGroup":
        """Return the group of which only a share of each run, from its beginning, is marched."""
        asked = jnp.asarray(int(np.ceil(share * self.samples)))
        return eqx.tree_at(lambda group: group.drives.asked, self, asked)

    def inputs(self, values: Mapping[str, Array]) -> tuple[Machine, Array, Array]:
        """Return the machine, where runs start (n, runs, walkers), and what the valves pass.

        That is (levels, runs, joints, walkers).
        """
        machine = self.layout.build(self.effects, values)
        like = 0.0 * machine.inertias[0]
        return machine, self._start(values, like, len(machine.scales)), self._passed(values, like)

    def _start(self, values: Mapping[str, Array], like: Array, size: int) -> Array:
        oil = [place.name for place in self.layout.places if place.oil]
        names = [c.name for c in self.layout.coordinates]
        rows = [(X_START, n) for n in names] + [(V_START, n) for n in names]
        rows += [(P_START, n) for n in oil]
        begun = [
            jnp.stack([values.get(f"{name}[{run},{at}]", 0.0) + like for run in self.runs])
            for name, at in rows
        ]
        rest = jnp.zeros((size - len(rows), len(self.runs), *like.shape))
        return jnp.concatenate([jnp.stack(begun), rest])

    def _passed(self, values: Mapping[str, Array], like: Array) -> Array:
        levels, none = self.drives.first.shape[2], jnp.zeros_like(like)
        at = {(t.name, t.cylinder): t for t in self.tracks}

        def one(level: int, run: str, joint: str) -> Array:
            track = at.get((run, joint))
            if track is None or level not in track.open_levels:
                return none
            return values[flow_label(track, level)] + none

        return jnp.stack([
            jnp.stack([jnp.stack([one(level, run, j) for j in self.joints]) for run in self.runs])
            for level in range(levels)
        ])  # fmt: skip


def machine_group(
    tracks: Sequence[Track],
    effects: tuple[type[AbstractEffect], ...],
    tolerance: float | None,
    layout: Layout,
) -> MachineGroup:
    """Lay what is done in some runs onto the steps of a march.

    Raises InputError where the joints of one run are not read at the same instants.
    """
    runs = tuple(dict.fromkeys(t.name for t in tracks))
    joints = [place.name for place in layout.places]
    for run in runs:
        require_one_clock([t for t in tracks if t.name == run])
    size, steps = max(t.size for t in tracks), layout.steps
    levels = 1 + max((max(t.open_levels, default=0) for t in tracks), default=0)
    shape = (size - 1, steps, levels, len(runs), len(joints))
    first, last = np.zeros(shape), np.zeros(shape)
    begin, end = np.zeros((*shape[:2], *shape[3:])), np.zeros((*shape[:2], *shape[3:]))
    for track in tracks:
        run, joint = runs.index(track.name), joints.index(track.cylinder)
        assert track.given is not None  # a run has it
        count = int(track.samples) - 1
        if track.given.force is not None:
            begin[:count, :, run, joint], end[:count, :, run, joint] = _ramps(
                np.asarray(track.given.force), steps
            )
        if track.drive is None:
            continue
        if track.given.command is not None:
            first[:count, :, 1, run, joint], last[:count, :, 1, run, joint] = _ramps(
                np.asarray(track.given.command), steps
            )
            continue
        shares = _shares(track.drive, size - 1, steps, levels)
        first[..., run, joint] = last[..., run, joint] = shares
    drives = Drives(
        first=jnp.asarray(first),
        last=jnp.asarray(last),
        begin=jnp.asarray(begin),
        end=jnp.asarray(end),
        interval=tracks[0].interval,
        asked=jnp.asarray(size),
    )
    return MachineGroup(tuple(tracks), effects, tolerance, layout, drives)


def require_one_clock(tracks: Sequence[Track]) -> None:
    """Refuse joints of a run that are read at other instants than the first of them."""
    one = tracks[0]
    for other in tracks[1:]:
        begins = abs(float(other.first) - float(one.first)) <= SAME_CLOCK
        if begins and int(other.samples) == int(one.samples) and other.interval == one.interval:
            continue
        raise InputError(
            f"record '{one.name}': joint {other.cylinder} is read at {int(other.samples)} instants "
            f"from {float(other.first):g} s every {other.interval:g} s, joint {one.cylinder} at "
            f"{int(one.samples)} from {float(one.first):g} s every {one.interval:g} s; all joints "
            "of a run need one clock, cut or resample the files"
        )


def _ramps(series: np.ndarray, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """A series where each step begins and where it ends (samples - 1, steps), straight between."""
    share = np.arange(steps + 1) / steps
    nodes = series[:-1, None] + share * np.diff(series)[:, None]
    return nodes[:, :-1], nodes[:, 1:]


def _shares(drive: Drive, count: int, steps: int, levels: int) -> np.ndarray:
    """For which share of each step the valve is at each level, (count, steps, levels)."""
    length = drive.interval / steps
    edges = length * np.arange(count * steps + 1)
    moves = np.asarray(drive.switches) - float(drive.first)
    bounds = np.concatenate([[-np.inf], moves, [np.inf]])
    out = np.zeros((count * steps, levels))
    for level, low, high in zip(drive.levels, bounds[:-1], bounds[1:], strict=True):
        inside = np.minimum(edges[1:], high) - np.maximum(edges[:-1], low)
        out[:, level] += np.clip(inside, 0.0, length) / length
    return out.reshape(count, steps, levels)

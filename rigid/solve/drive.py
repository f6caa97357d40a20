"""What drives a record, known before any fit: sample times and the positions of the valve."""

import dataclasses

import numpy as np

FINE_WINDOW = 0.1
"""Seconds after a switch of the valve in which every sample is a step of its own, whatever the rig;
after them it is for as long as the rig rings on."""

STRIDE = 8
"""Samples in one long step; a power of two, so that its matrices follow by doubling."""

EDGE = 1e-9
"""Relative slack [sampling intervals] when a switch is compared with a sample."""


@dataclasses.dataclass(frozen=True)
class Drive:
    """One cylinder's part of a slow record.

    - `first` [s]: time of the first sample, at which the rig is at rest and out of load.
    - `interval` [s], `samples`: the grid the record lies on.
    - `switches` [s]: when the valve moves; `levels`: for each stretch, which of the record's flow
      fractions applies (one more than switches; 0 is shut).
    """

    first: float
    interval: float
    samples: int
    switches: tuple[float, ...]
    levels: tuple[int, ...]

    @property
    def times(self) -> np.ndarray:
        """Sample times [s], shape (samples,)."""
        return self.first + self.interval * np.arange(self.samples)


@dataclasses.dataclass(frozen=True)
class Plan:
    """How a group of drives is marched through together, a step a sample.

    - `near` (steps,): whether some drive's valve moves within the step or has just moved.
    - `levels` (steps, tracks): flow fraction that applies when the step begins.
    - `kink` (steps, tracks): 0, or 1 + the index of the switch that falls inside the step.
    - `kink_rest` (kinks,) [s]: time from the switch to the end of its step; `kink_level`: the
      flow fraction after it; `kink_place` (kinks, 2): drive and number of the switch.
    - `samples`: of the longest drive; `interval` [s].
    """

    near: np.ndarray
    levels: np.ndarray
    kink: np.ndarray
    kink_rest: np.ndarray
    kink_level: np.ndarray
    kink_place: np.ndarray
    samples: int
    interval: float

    @property
    def after(self) -> np.ndarray:
        """Flow fraction where each step ends: after the switch inside it, where there is one."""
        switched = np.concatenate([[0], self.kink_level]).astype(int)[self.kink]
        return np.where(self.kink > 0, switched, self.levels)

    def within(self, parts: int) -> tuple[np.ndarray, np.ndarray]:
        """Return which part of its step each switch falls in, and the time [s] to that part's end.

        - `parts`: into which a step is cut.
        """
        length = self.interval / parts
        since = self.interval - self.kink_rest
        part = np.clip(np.floor(since / length + EDGE).astype(int), 0, parts - 1)
        return part, (part + 1) * length - since


def plan(drives: tuple[Drive, ...]) -> Plan:
    """Lay the common grid of several drives.

    Raises ValueError where two switches of a drive fall into one sampling interval.
    """
    interval = drives[0].interval
    samples = max(max(d.samples for d in drives), 2)
    near = _near_a_switch(drives, samples, interval)
    return _with_valve(drives, near[: samples - 1], interval)


def _near_a_switch(drives: tuple[Drive, ...], samples: int, interval: float) -> np.ndarray:
    """Mark the sample intervals in which some drive needs short steps."""
    near = np.zeros(samples, dtype=bool)
    window = int(np.ceil(FINE_WINDOW / interval))
    for drive in drives:
        for switch in (drive.first, *drive.switches):
            at = int(np.floor((switch - drive.first) / interval + EDGE))
            if at < drive.samples:
                near[max(at - 1, 0) : at + window] = True
    return near


def _with_valve(drives: tuple[Drive, ...], near: np.ndarray, interval: float) -> Plan:
    """Fill in which flow fraction applies in each step and where it changes within one."""
    steps = len(near)
    nodes = np.arange(steps + 1)
    levels = np.zeros((steps, len(drives)), dtype=int)
    kink = np.zeros((steps, len(drives)), dtype=int)
    rest, after, source = [], [], []
    for track, drive in enumerate(drives):
        at = (np.asarray(drive.switches) - drive.first) / interval
        levels[:, track] = np.asarray(drive.levels)[
            np.searchsorted(at, nodes[:-1] + EDGE, side="left")
        ]
        for i, place in enumerate(at):
            step = int(np.searchsorted(nodes, place - EDGE, side="right")) - 1
            inside = nodes[min(step, steps)] + EDGE < place
            if step < 0 or step >= steps or not inside or nodes[step + 1] - place < EDGE:
                continue
            if kink[step, track]:
                raise ValueError("two valve positions within one sampling interval")
            rest.append((nodes[step + 1] - place) * interval)
            after.append(drive.levels[i + 1])
            source.append((track, i))
            kink[step, track] = len(rest)
    return Plan(
        near=near,
        levels=levels,
        kink=kink,
        kink_rest=np.array(rest),
        kink_level=np.array(after, dtype=int),
        kink_place=np.array(source, dtype=int).reshape(-1, 2),
        samples=steps + 1,
        interval=interval,
    )

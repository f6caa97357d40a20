"""What drives a rig or a machine in a test from outside, and what is told of it.

Beside a state of its own every machine has the numbers that nobody knows beforehand: loads, which
move on straight lines within a short step and so have a slope each, and flow fractions, which stay
within one. Forces and commands that were recorded are loads of which a reading tells.
"""

from dataclasses import dataclass

import numpy as np

LOAD_SIZE = 1e3
"""Typical size of the load on the rig [N]."""

PER_SECOND = 100.0
"""By how much of its own size a load moves in a second [1/s]."""

FLOW_SIZE = 0.1
"""Typical size of a flow fraction [-]."""

FIRST_LOAD, FIRST_SLOPE, FIRST_FLOW = 1e-3, 1e-2, 3.0
"""Sd at the first sample, in units of sizes: out of load, at whatever valve."""

FIRST_RECORDED = 10.0
"""The same of what was recorded: a reading tells."""

QUANTITIES = ("load", "displacement", "kappa")
"""What is told of a test, each with the place it is at, as in `load_A`."""


@dataclass(frozen=True)
class Recorded:
    """A force or a command that was recorded, and its typical size; `place`: the joint."""

    quantity: str
    place: str
    size: float


@dataclass(frozen=True)
class Inputs:
    """What drives a machine in a test.

    Numbers stand in this order: loads and what was recorded, their slopes, flow fractions.

    - `loads`: places at which a load is sought. - `flows`: those at which the valve passes a
      fraction that is sought. - `recorded`. - `size`: typical of a load [N].
    """

    loads: tuple[str, ...]
    flows: tuple[str, ...]
    recorded: tuple[Recorded, ...] = ()
    size: float = LOAD_SIZE

    @property
    def straight(self) -> int:
        """How many move on straight lines within a step, and so have slopes."""
        return len(self.loads) + len(self.recorded)

    @property
    def count(self) -> int:
        """Numbers beside the state of the machine: straight ones, their slopes, flow fractions."""
        return 2 * self.straight + len(self.flows)

    @property
    def scales(self) -> tuple[float, ...]:
        """Typical size of each number, SI."""
        straight = (*(self.size for _ in self.loads), *(one.size for one in self.recorded))
        slopes = tuple(PER_SECOND * size for size in straight)
        return (*straight, *slopes, *(FLOW_SIZE for _ in self.flows))

    @property
    def first(self) -> tuple[float, ...]:
        """Sd of each number at the first sample, in units of its size."""
        loads, read = len(self.loads), (FIRST_RECORDED,) * len(self.recorded)
        slopes = (*(FIRST_SLOPE,) * loads, *read)
        return (*(FIRST_LOAD,) * loads, *read, *slopes, *(FIRST_FLOW,) * len(self.flows))

    @property
    def sought(self) -> tuple[bool, ...]:
        """Which numbers nothing recorded tells, in the same order."""
        straight = (*(True for _ in self.loads), *(False for _ in self.recorded))
        return (*straight, *straight, *(True for _ in self.flows))

    @property
    def flow_places(self) -> range:
        """Where flow fractions are among the numbers."""
        return range(2 * self.straight, self.count)

    @property
    def told(self) -> tuple[str, ...]:
        """Names of what is told of a test: loads, displacements at them, flow fractions."""
        load, displacement, kappa = QUANTITIES
        at = [(load, self.loads), (displacement, self.loads), (kappa, self.flows)]
        return tuple(f"{quantity}_{place}" for quantity, places in at for place in places)


def per_input(inputs: Inputs, straight: float, slope: float, flow: float) -> np.ndarray:
    """Return a number for each of the inputs' numbers, by what it is."""
    many = inputs.straight
    return np.array([*[straight] * many, *[slope] * many, *[flow] * len(inputs.flows)])

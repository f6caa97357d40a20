"""What every effect has in common: what it sees and what it may do."""

import dataclasses
from abc import abstractmethod
from collections.abc import Iterable, Mapping
from typing import ClassVar, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from rigid.effects.declare import ParameterInfo
from rigid.kinds import KINDS

PLUNGER = "plunger-momentum"
MOTION = "motion"
"""The kind of record of another machine, of which one body and its force are seen."""

EQUATIONS = (
    PLUNGER,
    "cylinder-momentum",
    "oil-balance",
    "pump",
    "load-cell",
    "root",
    "contact",
    "sensor",
)


class State(NamedTuple):
    """Where the rig is; every entry broadcasts over tracks and walkers.

    - `x_cylinder`, `v_cylinder` [m, m/s]: of the cylinder, 0 where the load-cell end is unloaded.
    - `x_plunger`, `v_plunger` [m, m/s]: of plunger and indentation plate.
    - `pressure` [Pa]: oil above atmosphere.
    - `column` [m]: length of the oil column, that at zero stroke plus the stroke.
    - `x_root`, `v_root` [m, m/s]: of the plate that holds the load-cell end, 0 where it is fixed.
    - `area` [m^2]: that the pressure acts on, nominally.
    - `contact_stiffness` [N/m]: of the frame in the plunger's way, 0 where it is free.
    - `flow_fraction` [-]: what the valve passes. - `time` [s]: since the record began, or since
      the release.
    - `pump_angle` [rad]: by which the pump's beat was ahead when the record began.
    """

    x_cylinder: Array
    v_cylinder: Array
    x_plunger: Array
    v_plunger: Array
    pressure: Array
    column: Array
    x_root: Array | float = 0.0
    v_root: Array | float = 0.0
    area: Array | float = 0.0
    contact_stiffness: Array | float = 0.0
    flow_fraction: Array | float = 0.0
    time: Array | float = 0.0
    pump_angle: Array | float = 0.0

    @property
    def stroke(self) -> Array:
        """Plunger relative to cylinder [m], eq. (6)."""
        return self.x_plunger - self.x_cylinder

    @property
    def slip(self) -> Array:
        """Speed of the plunger relative to the cylinder [m/s], v_SS."""
        return self.v_plunger - self.v_cylinder

    @property
    def pumped(self) -> Array:
        """1 where the pump's oil comes in, 0 where the valve is shut or leads to the tank."""
        return jnp.where(jnp.asarray(self.flow_fraction) > 0.0, 1.0, 0.0)


class Action(NamedTuple):
    """What an effect does; what it leaves out it does not touch.

    - `between` [N]: pushes the plunger toward the ice and the cylinder back, equal and opposite.
    - `load_cell` [N]: pushes the cylinder toward the ice and is what the load cell reads.
    - `on_plunger` [N]: from outside on plunger and plate.
    - `on_cylinder` [N]: from outside on the cylinder; the load cell does not read it.
    - `inflow` [m^3/s]: oil into the chamber at a fully open valve; the valve passes a fraction.
    - `leakage` [m^3/s]: oil out of the chamber, whatever the valve.
    - `compliance` [1/Pa]: share of the relative compression of the oil per pressure.
    - `rates`: time derivatives of the effect's own states.
    """

    between: Array | float = 0.0
    load_cell: Array | float = 0.0
    on_plunger: Array | float = 0.0
    on_cylinder: Array | float = 0.0
    inflow: Array | float = 0.0
    leakage: Array | float = 0.0
    compliance: Array | float = 0.0
    rates: tuple[Array, ...] = ()


class Seen(NamedTuple):
    """What the whole rig does at an instant; sensors and the root answer to it.

    - `state`; `own`: the effect's own states. - `load` [N]: in the load-cell end.
    - `inflow` [m^3/s]: oil through the hose into the chamber. - `acceleration` [m/s^2]: of the
      plate, where there is one.
    """

    state: State
    own: tuple[Array, ...]
    load: Array | float
    inflow: Array | float
    acceleration: Array | float = 0.0


class Distortion(NamedTuple):
    """What a sensor reads beside the truth, in SI; what is left out is read truly."""

    load: Array | float = 0.0
    stroke: Array | float = 0.0
    pressure: Array | float = 0.0
    acceleration: Array | float = 0.0


class Strap(NamedTuple):
    """How the straps of releases let go; a law of `rigid.physics.strap`.

    - `duration` [s]: in which the force falls from 90 to 10 %. - `begin`, `end`: how abruptly it
      begins and ends to.
    """

    duration: Array
    begin: Array
    end: Array


class AbstractEffect(eqx.Module):
    """One physical cause that acts on the rig.

    Class variables:

    - `name` (in specs), `equation` (one of EQUATIONS), `source`.
    - `phrase`: what it is, for who has not seen the catalogue: "oil leaks past the piston".
    - `scales`: for each state of its own a typical value, in which solvers measure errors.
    - `steady`: whether the Jacobian of the motion hardly changes with anything but the oil column,
      so that the step matrices of the rig at rest serve everywhere.
    - `finer`: how many times shorter steps must be than for others, where the rig is not steady or
      a strap takes its time. `softens`: whether oil is many times softer at rest than at work.
    - `kinds`: of records in which it acts, by their names or traits ("slow": all that follow a
      valve's programme); None for all of the rig, and for those of one moving body alone if it
      pushes the plunger.
    - `bristle`: whether its one state relaxes at a rate that goes with the speed, and linearly in
      the state.
    - `beat`: of an effect that beats, the label of its frequency [Hz]. If it beats with the pump,
      the angle at which that stood is a number of each record's own; if sensors pick it up
      (`lines`), the angle of each channel. `ratios`: then, by quantity, labels of amplitudes over
      the first one, which is the load cell's.
    - `threshold`: of an effect that sets in at a pressure, the label of it [Pa].
    - `exact`: what it takes for exactly known beside its fixed parameters, for readers.
    - `place`: joint of a machine at which it acts; empty where it is of the rig or of a motion.
    """

    name: eqx.AbstractClassVar[str]
    equation: eqx.AbstractClassVar[str]
    source: eqx.AbstractClassVar[str]
    phrase: ClassVar[str] = ""
    scales: ClassVar[tuple[float, ...]] = ()
    steady: ClassVar[bool] = False
    finer: ClassVar[int] = 1
    softens: ClassVar[bool] = False
    kinds: ClassVar[tuple[str, ...] | None] = None
    bristle: ClassVar[bool] = False
    beat: ClassVar[str | None] = None
    ratios: ClassVar[Mapping[str, str]] = {}
    threshold: ClassVar[str | None] = None
    exact: ClassVar[str] = ""
    place: ClassVar[str] = ""

    @abstractmethod
    def __call__(self, state: State, own: tuple[Array, ...]) -> Action:
        """Return what the effect does in `state`, its own states being `own`."""

    def root(self, own: tuple[Array, ...]) -> tuple[Array, Array] | None:  # noqa: ARG002
        """Position and speed [m, m/s] of the root plate, from the effect that lets it move."""
        return None

    def rates(self, action: Action, seen: Seen) -> tuple[Array, ...]:  # noqa: ARG002
        """Time derivatives of the own states; overridden where they need the whole rig."""
        return action.rates

    def sense(self, seen: Seen) -> Distortion:  # noqa: ARG002
        """Return what the sensors read beside the truth."""
        return Distortion()

    def delays(self) -> Mapping[str, Array]:
        """By how much [s] the time stamps of a quantity lag behind those of the others."""
        return {}

    def strap(self) -> Strap | None:
        """Return how the straps of releases let go; None: at once, or as another effect says."""
        return None

    def averaging(self) -> tuple[Array, Array] | None:
        """Share of each reading that is a mean about its instant, over what part of an interval."""
        return None

    def lines(self) -> Mapping[str, tuple[Array, Array]]:
        """Amplitude [SI] and frequency [Hz] of what a sensor reads beside the rest, by quantity."""
        return {}

    @classmethod
    def picked_up(cls) -> bool:
        """Whether sensors pick it up, each channel by itself."""
        return cls.lines is not AbstractEffect.lines

    def friction(self, omega: Array) -> Array:
        """Complex friction coefficient mu(omega) that the effect adds [N s/m]; 0 unless told."""
        return jnp.zeros_like(omega, dtype=complex)

    @classmethod
    def gradual(cls) -> bool:
        """Whether it lets straps take their time; that of each release begins when it does."""
        return cls.strap is not AbstractEffect.strap

    @classmethod
    def acts_in(cls, kind: str) -> bool:
        """Whether the effect acts in records of a kind.

        Where one body is all there is, what pushes it can act; oil, valve, load cell, root and the
        rig's sensors are not there.
        """
        if cls.kinds is not None:
            return not KINDS[kind].traits().isdisjoint(cls.kinds)
        return KINDS[kind].of_the_rig() or cls.equation == PLUNGER

    @classmethod
    def parameters(cls) -> tuple[ParameterInfo, ...]:
        """Return the effect's parameters in order of declaration."""
        return tuple(
            f.metadata["parameter"] for f in dataclasses.fields(cls) if "parameter" in f.metadata
        )

    @classmethod
    def labels(cls) -> tuple[str, ...]:
        """Return the flat names of the parameters, one for each element."""
        return tuple(label for info in cls.parameters() for label in info.labels)

    @classmethod
    def may_lack(cls) -> bool:
        """Whether there are rigs without the effect: one of its parameters can make it absent."""
        return any(info.absent is not None for info in cls.parameters())

    @classmethod
    def build(cls, values: Mapping[str, ArrayLike]) -> "AbstractEffect":
        """Make the effect from flat values, `{"mu": ..., "mu_branch[1]": ...}` in SI.

        Elements of a vector are stacked on a first axis; later axes broadcast over walkers.
        """
        fields = {}
        for field, info in zip(dataclasses.fields(cls), cls.parameters(), strict=True):
            given = [jnp.asarray(values[label]) for label in info.labels]
            fields[field.name] = given[0] if len(given) == 1 else jnp.stack(given)
        return cls(**fields)


def delays_of(effects: Iterable[AbstractEffect]) -> dict[str, Array]:
    """By how much [s] the time stamps of each quantity lag, for those that do."""
    total: dict[str, Array] = {}
    for effect in effects:
        for quantity, delay in effect.delays().items():
            total[quantity] = total[quantity] + delay if quantity in total else delay
    return total

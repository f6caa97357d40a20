"""What a spec says, as frozen values. SI, once the record readers have converted units."""

import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, ConfigDict, Field, model_validator

from rigid.io.errors import quoted
from rigid.kinds import KINDS
from rigid.spec.base import Flag, Real, Value, Whole
from rigid.spec.machine import OF_A_MACHINE, MachineSpec, UsualSpec, effects_of, run_faults
from rigid.spec.published import PublishedSpec
from rigid.spec.record import ChannelSpec, Quantity, RecordSpec
from rigid.spec.rig import RigSpec
from rigid.spec.sentences import unknown
from rigid.spec.sheets import SensorsSpec

BODY = "plunger"
"""What moves in the rig; equations of motion are named by it."""


def _word(given: str) -> str:
    """Refuse what does not go into the name of an equation."""
    if not re.fullmatch(r"[a-z][a-z0-9-]*", given):
        raise ValueError(
            f"must be a word in small letters, as in 'carriage'; found {quoted(given)}"
        )
    return given


class ModelSpec(Value):
    """What acts on the rig.

    - `effects`: by name. - `only`: effects that act in one kind, cylinder or record alone.
    - `vary`: what a parameter varies by. - `candidates`: what may be missing.
    - `body`: what moves, in what is reported. - `usual`: sizes that priors of the catalogue go with
      where motions of a body were measured; None: as the records have them.
    """

    effects: tuple[str, ...] = (
        "load-cell-spring",
        "oil-compressibility",
        "viscous-friction",
        "pump-curve",
    )
    only: Mapping[str, str] = {}
    candidates: tuple[str, ...] | None = None
    vary: Mapping[str, Literal["kind", "cylinder", "record"]] = {}
    body: Annotated[str, AfterValidator(_word)] = BODY
    usual: UsualSpec | None = None

    def equation(self, name: str) -> str:
        """Name of an equation in what is reported: "plunger-momentum" is that of the body."""
        return name.replace(BODY, self.body, 1) if name.startswith(BODY) else name

    @model_validator(mode="after")
    def once(self) -> "ModelSpec":
        """Refuse an effect that is named twice."""
        twice = [name for name in self.effects if self.effects.count(name) > 1]
        if twice:
            raise ValueError(f"effects: {quoted(twice[0])} stands twice; name it once")
        return self


def _as_written(schema: dict[str, Any]) -> None:
    """Put into a law's JSON Schema how files write it: its name, then its arguments."""
    number: dict[str, Any] = {"type": "number"}
    arguments = {"anyOf": [number, {"type": "object", "additionalProperties": number}]}
    del schema["properties"], schema["required"]
    schema |= {"additionalProperties": arguments, "minProperties": 1, "maxProperties": 1}


class PriorSpec(Value):
    """A prior law by name with its arguments."""

    law: str
    arguments: Mapping[str, Real]

    model_config = ConfigDict(json_schema_extra=_as_written)

    @model_validator(mode="before")
    @classmethod
    def one_law(cls, given: Any) -> Any:
        """Read `{ lognormal = { median = 6e7, factor = 2.0 } }` or `{ fixed = 700e5 }`."""
        if isinstance(given, PriorSpec) or (isinstance(given, Mapping) and "law" in given):
            return given
        if not isinstance(given, Mapping) or len(given) != 1:
            raise ValueError(
                "a prior is one law, as in { lognormal = { median = 6e7, factor = 2 } }"
            )
        (law, arguments), *_ = given.items()
        if not isinstance(arguments, Mapping):
            arguments = {"value": arguments}
        return {"law": law, "arguments": arguments}


MOST_SEED = 2**63 - 1


class SamplerSpec(Value):
    """How long and how wide to sample; `walkers` 0 chooses by the number of parameters.

    - `method`: "emcee": chains; None: weighted draws where their weights do, else chains.
    """

    method: Literal["emcee"] | None = None
    seed: Annotated[Whole, Field(ge=0, le=MOST_SEED)] = 1
    ensembles: Annotated[Whole, Field(ge=2, le=256)] = 4
    walkers: Annotated[Whole, Field(ge=0, le=100_000, multiple_of=2)] = 0
    starts: Annotated[Whole, Field(ge=1, le=10_000)] = 16
    r_hat: Annotated[Real, Field(gt=1.0)] = 1.01
    ess: Annotated[Real, Field(gt=0.0)] = 1000.0
    max_steps: Annotated[Whole, Field(ge=100, le=100_000_000)] = 20000
    block: Annotated[Whole, Field(ge=10, le=1_000_000)] = 50

    @model_validator(mode="after")
    def two_blocks(self) -> "SamplerSpec":
        """Refuse a chain of a single block: the first one is warm-up."""
        if self.max_steps < 2 * self.block:
            raise ValueError(
                f"max_steps is {self.max_steps}; it must be at least two blocks, {2 * self.block}"
            )
        return self


class SolveSpec(Value):
    """By what the equations of motion are solved; `tolerance` is diffrax's, relative.

    - `method`: None: steps, and diffrax where steps do not hold for an effect of the user's own.
    - `steps`: between two samples of a machine's runs; None: so many that its swings are resolved.
    """

    method: Literal["steps", "diffrax"] | None = None
    tolerance: Annotated[Real, Field(ge=1e-12, le=1e-4)] = 1e-8
    steps: Annotated[Whole, Field(ge=1, le=1000)] | None = None


class BandsLawSpec(Value):
    """One way the rig may be: the posterior of a calibration, and how probable it is."""

    posterior: Path
    probability: Annotated[Real, Field(gt=0.0, le=1.0)]


class BandsSpec(Value):
    """What bands are made from: one posterior, or several laws with their probabilities.

    - `draws`: of each posterior. - `loads`: joints of a machine at which a load is sought.
    """

    posterior: Path | None = None
    loads: tuple[str, ...] = ()
    laws: tuple[BandsLawSpec, ...] = ()
    draws: Annotated[Whole, Field(ge=8)] = 128

    @model_validator(mode="after")
    def one_way(self) -> "BandsSpec":
        """Refuse both or neither, and probabilities that are not those of all there is."""
        if (self.posterior is None) == (not self.laws):
            raise ValueError(
                'bands: name one posterior = "...", or [[bands.laws]] with a posterior and a '
                "probability each; not both"
            )
        total = sum(law.probability for law in self.laws)
        if self.laws and abs(total - 1.0) > 1e-3:
            raise ValueError(f"probabilities of laws sum to {total:.6g}; they must sum to 1")
        return self

    @property
    def sources(self) -> tuple[tuple[Path, float], ...]:
        """Posteriors and their probabilities, which sum to 1."""
        if self.posterior is not None:
            return ((self.posterior, 1.0),)
        total = sum(law.probability for law in self.laws)
        return tuple((law.posterior, law.probability / total) for law in self.laws)

    def beside(self, folder: Path) -> "BandsSpec":
        """Take paths as relative to a folder."""
        laws = tuple(
            law.model_copy(update={"posterior": folder / law.posterior}) for law in self.laws
        )
        one = None if self.posterior is None else folder / self.posterior
        return self.model_copy(update={"posterior": one, "laws": laws})


FACTOR = Field(gt=0.0, le=1e3)


class PlanRecordSpec(Value):
    """A record that could be taken: like one of the spec's, settings times those of that record.

    - `spec`: which has the record, where it is another than this one: of a kind that was not taken
      yet, perhaps. - `ranges`: times the range of a sensor, by quantity. - `cost`: of one such
      record, in any unit.
    """

    like: str
    spec: Path | None = None
    preload: Annotated[Real, FACTOR] = 1.0
    flow: Annotated[Real, FACTOR] = 1.0
    drive: Annotated[Real, FACTOR] = 1.0
    duration: Annotated[Real, FACTOR] = 1.0
    interval: Annotated[Real, FACTOR] = 1.0
    ranges: Mapping[Quantity, Annotated[Real, FACTOR]] = {}
    cost: Annotated[Real, Field(gt=0.0)] = 1.0


class PlanSpec(Value):
    """Which record to take next.

    - `quantities`: that it is to tell: names of parameters, `abs_mu[80 Hz]`, or the greatest load
      of a test, `peak_load[press]`; the first ranks. - `tests`: spec of the tests; None: this one.
    - `limits`: of what sensors may be made to read, by quantity in SI. - `records`: what could be
      taken.
    """

    quantities: tuple[str, ...] = ()
    tests: Path | None = None
    limits: Mapping[Quantity, Annotated[Real, Field(gt=0.0)]] = {}
    records: tuple[PlanRecordSpec, ...] = ()


class SpecBody(Value):
    """The spec as its file has it; `channels` of a cylinder stand in for those of its records."""

    title: str = ""
    simulated: Flag = False
    rig: RigSpec = RigSpec()
    machine: MachineSpec | None = None
    model: ModelSpec = ModelSpec()
    priors: Mapping[str, PriorSpec] = {}
    sensors: SensorsSpec = SensorsSpec()
    channels: Mapping[str, Mapping[Quantity, ChannelSpec]] = Field(default={}, exclude=True)
    records: tuple[RecordSpec, ...] = ()
    bands: BandsSpec | None = None
    plan: PlanSpec | None = None
    sampler: SamplerSpec = SamplerSpec()
    solve: SolveSpec = SolveSpec()
    published: PublishedSpec | None = Field(default=None, exclude=True)

    @model_validator(mode="before")
    @classmethod
    def shared(cls, given: Any) -> Any:
        """Give each record without channels those of its cylinder; list what acts at joints."""
        if not isinstance(given, Mapping):
            return given
        given = _with_effects(given)
        channels, records = given.get("channels"), given.get("records")
        if not isinstance(channels, Mapping) or not isinstance(records, (list, tuple)):
            return given
        return {**given, "records": [_with_channels(record, channels) for record in records]}

    @model_validator(mode="after")
    def consistent(self) -> "SpecBody":
        """Refuse what cannot be one campaign, each mistake in a sentence."""
        says = [*_alike(self.records), *_unheld(self), *_unmeasured(self)]
        if self.machine is not None and (self.model.only or self.model.vary):
            says.append(
                "model: only and vary are the rig's; a [machine] names effects at each joint, and "
                "`shared` says which numbers are the same at all"
            )
        says += _load_faults(self.machine, () if self.bands is None else self.bands.loads)
        if says := [*says, *run_faults(self.machine, self.records)]:
            raise ValueError("\n".join(dict.fromkeys(says)))
        return self


def _with_effects(given: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a spec as TOML has it, its model's effects those that its machine's joints name."""
    machine, model = given.get("machine"), given.get("model", {})
    if not isinstance(machine, Mapping) or not isinstance(model, Mapping):
        return given
    if "effects" in model:
        raise ValueError("model: effects: each joint of a [machine] names its own; leave this out")
    effects = effects_of(machine.get("joints"))
    return given if effects is None else {**given, "model": {**model, "effects": effects}}


def _with_channels(record: Any, channels: Mapping[str, Any]) -> Any:
    """Return a record as TOML has it, with the channels of its cylinder where it has none."""
    if not isinstance(record, Mapping) or "channels" in record:
        return record
    cylinder = record.get("cylinder", RecordSpec.model_fields["cylinder"].default)
    if not isinstance(cylinder, str) or cylinder not in channels:
        return record
    return {**record, "channels": channels[cylinder]}


def _alike(records: Iterable[RecordSpec]) -> Iterator[str]:
    """Say which records stand twice, and which name runs of two kinds share."""
    seen: set[tuple[str, str]] = set()
    kinds: dict[str, str] = {}
    for r in records:
        if (r.name, r.cylinder) in seen:
            yield (
                f"records: {quoted(r.name)} on cylinder {r.cylinder} stands twice; "
                "give one of them another name"
            )
        seen.add((r.name, r.cylinder))
        if kinds.setdefault(r.name, r.kind) != r.kind:
            yield (
                f"records: {quoted(r.name)} is a {kinds[r.name]} on one cylinder and a "
                f"{r.kind} on another; one name is one run, give one of them another name"
            )


def _unheld(spec: SpecBody) -> Iterator[str]:
    """Say that nothing acts on a rig; a body that moves freely is measured all the same."""
    rigs = [r for r in spec.records if KINDS[r.kind].of_the_rig()]
    if rigs and not spec.model.effects:
        yield (
            f"model: effects is empty, but {rigs[0].name} is a {rigs[0].kind} of the rig, on "
            f"which {', '.join(ModelSpec().effects)} act; name the effects, or leave the key out"
        )


def _unmeasured(spec: SpecBody) -> Iterator[str]:
    """Say that a force, or a position that is to be explained, has no sheet of its sensor."""
    stated = spec.sensors.model_fields_set
    for r in spec.records:
        if r.kind in OF_A_MACHINE and "position" in r.channels and "position" not in stated:
            yield (
                f"sensors: a {r.kind} needs the sheet of its position sensor, as in "
                "position = { step = 1e-5, noise = 1e-5, gain_sd = 1e-3, zero_sd = 1e-4 } (m)"
            )
        if spec.sensors.force is None and "force" in r.channels:
            yield (
                f"sensors: a {r.kind} needs the sheet of its force sensor, as in "
                "force = { noise = 2.0, gain_sd = 0.01, zero_sd = 1.0 } (N)"
            )


def _load_faults(machine: MachineSpec | None, loads: tuple[str, ...]) -> Iterator[str]:
    """Say where a load is sought at what is no joint, or at one with oil."""
    if machine is None:
        if loads:
            yield "bands: loads are sought at joints of a [machine]; leave this out for the rig"
        return
    for name in loads:
        if loads.count(name) > 1:
            yield f"bands: loads: {quoted(name)} stands twice; name it once"
        if name not in machine.joints:
            yield f"bands: loads: {unknown('joint', name, [*machine.joints])}"
        elif machine.joints[name].oil:
            yield (
                f"bands: loads: there is oil at {quoted(name)}, and what acts where a load is "
                "sought is left out of a test; add a joint of its own between the same bodies"
            )


class Spec(SpecBody):
    """A spec read from `path`; `text` is the file as it stands.

    - `why_solver`: why its method of solving is the one it is, where the file leaves that open.
    """

    path: Path
    text: str
    why_solver: str = ""


def schema() -> dict[str, Any]:
    """Return the JSON Schema of a spec's file, for editors: made from what the values declare."""
    made = SpecBody.model_json_schema()
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **made,
        "title": "Spec of rigid",
    }

"""Draws of the rig and its sensors from the posterior of a calibration."""

import dataclasses
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import xarray as xr
from jax import Array
from pydantic import ValidationError

from rigid.effects import AbstractEffect
from rigid.inference.export import DIMENSIONS
from rigid.inference.posterior import load_posterior
from rigid.io.errors import InputError
from rigid.likelihood.assemble import chosen_effects, sheets
from rigid.likelihood.machine import lay_out
from rigid.likelihood.parameters import Scoped
from rigid.physics.rig import build_rig
from rigid.smoothing.field import QUANTITIES, Channel, Field, Setup
from rigid.smoothing.learning import Sheet
from rigid.smoothing.machine_plant import acting, numbers, passed, plants
from rigid.smoothing.machine_records import read_at
from rigid.smoothing.model import Calibration
from rigid.smoothing.plant import RigPlant
from rigid.smoothing.reading import SOUGHT
from rigid.smoothing.smoother import DrawBatch
from rigid.spec import Spec
from rigid.spec.machine import MachineSpec
from rigid.spec.values import SpecBody

CORE = ("M_HC", "M_Pl", "M_Fl", "S_Pl", "L_0")


@dataclasses.dataclass(frozen=True, eq=False)
class RigModel:
    """One way the rig may be: what acts on it, and draws of its numbers.

    - `name`: for tables. - `weight`: its probability. - `effects`: what acts.
    - `values`: (draws,) by flat label, sensors' gains and zeros included. - `labels`: all flat
      labels of a name, `gain[load,A]` among those of `gain`.
    - `failed`: checks that its fit failed, in a sentence; empty where it is usable.
    - `machine`: that it is a law of; None: the rig.
    """

    name: str
    weight: float
    effects: tuple[type[AbstractEffect], ...]
    values: Mapping[str, np.ndarray]
    labels: Mapping[str, tuple[str, ...]] = dataclasses.field(default_factory=dict)
    failed: str = ""
    machine: MachineSpec | None = None

    @property
    def size(self) -> int:
        """Number of draws."""
        return max(v.size for v in self.values.values())

    def only(self, rows: np.ndarray) -> "RigModel":
        """Return some of the draws, in this order."""
        size = self.size
        picked = {k: v[rows] if v.size == size else v for k, v in self.values.items()}
        return dataclasses.replace(self, values=picked)

    def centre(self) -> "RigModel":
        """Return one draw: the median of every number."""
        return dataclasses.replace(
            self, values={k: np.median(v, keepdims=True) for k, v in self.values.items()}
        )

    def with_sensors_of(self, other: "RigModel") -> "RigModel":
        """Return this rig with the sensors of another draw or draws."""
        labels = (k for name in ("gain", "zero") for k in other.labels.get(name, ()))
        sensors = {label: other.values[label] for label in labels}
        return dataclasses.replace(self, values=dict(self.values) | sensors)


def read_laws(spec: Spec, rng: np.random.Generator) -> tuple[RigModel, ...]:
    """Read every law that a spec's bands are made under, with its probability as weight.

    - `rng`: draws gains and zeros of sensors that a posterior does not know.

    Raises InputError where the spec names no posterior, or one is not of the spec's rig; a single
    posterior has to have the spec's effects, those of several laws have their own.
    """
    if spec.bands is None:
        raise InputError(
            f'{spec.path}: has no [bands] posterior = "..."; name the posterior.nc that '
            "`python -m rigid.fit` wrote"
        )
    if spec.bands.posterior is not None:
        return (read_law(spec, spec.bands.posterior, rng),)
    laws = []
    for path, probability in spec.bands.sources:
        tree = load_posterior(path)
        model = _body(path, tree).model
        law = read_law(spec.model_copy(update={"model": model}), path, rng, _fit_folder(path, tree))
        laws.append(dataclasses.replace(law, weight=probability))
    return tuple(laws)


def some(law: RigModel, spec: Spec, rng: np.random.Generator) -> RigModel:
    """Pick as many draws of a law as the spec asks for, or all there are."""
    assert spec.bands is not None  # `read_laws` has refused that
    return law.only(rng.choice(law.size, min(spec.bands.draws, law.size), replace=False))


def _fit_folder(path: Path, tree: xr.DataTree) -> Path | None:
    """Folder of the spec that a posterior is of, if it is told and still there."""
    told = tree.attrs.get("spec_folder")
    folder = None if told is None else path.parent / str(told)
    return folder if folder is not None and folder.is_dir() else None


def read_law(
    spec: Spec, path: Path, rng: np.random.Generator, folder: Path | None = None
) -> RigModel:
    """Read the law of a spec's rig from a posterior.

    - `rng`: draws gains and zeros of sensors that the posterior does not know. - `folder`: beside
      which effects of one's own are looked up; None: beside the spec.

    Raises InputError where the posterior is not one of this rig and its effects.
    """
    tree = load_posterior(path)
    _require_same(spec, path, tree)
    named = _values(tree["posterior"].to_dataset())
    values = {label: column for one in named.values() for label, column in one.items()}
    if "constant_data" in tree.children:
        for name, known in tree["constant_data"].to_dataset().data_vars.items():
            values[str(name)] = np.atleast_1d(np.asarray(known.values, dtype=float))
    at = spec if folder is None else spec.model_copy(update={"path": folder / spec.path.name})
    for name, one in _unknown_sensors(spec, values, rng).items():
        named[name] = named.get(name, {}) | one
        values |= one
    labels = {name: tuple(one) for name, one in named.items()}
    name, effects = "/".join(spec.model.effects), chosen_effects(at)
    return RigModel(name, 1.0, effects, values, labels, _failed(tree), spec.machine)


def _failed(tree: xr.DataTree) -> str:
    """Checks that the fit of a posterior failed; empty where it may be used."""
    if int(tree.attrs.get("usable", 1)):
        return ""
    return str(tree.attrs.get("failed_checks") or "its fit is not usable")


def _require_same(spec: Spec, path: Path, tree: xr.DataTree) -> None:
    """Refuse the posterior of another rig or of other effects."""
    found = str(tree.attrs.get("effects", "")).split(",")
    if sorted(found) != sorted(spec.model.effects):
        raise InputError(
            f"{path}: posterior of a rig with {', '.join(found)}; {spec.path} [model] effects has "
            f"{', '.join(spec.model.effects)}; run `python -m rigid.fit` on this spec, or name its "
            "posterior in [bands]"
        )
    body = _body(path, tree)
    if body.machine != spec.machine:
        raise InputError(
            f"{path}: posterior of another machine; [machine] is not the same there as in "
            f"{spec.path}; run `python -m rigid.fit` on this spec"
        )
    if body.rig != spec.rig:
        there, here = body.rig.model_dump(), spec.rig.model_dump()
        other = [k for k in here if here[k] != there.get(k)]
        raise InputError(
            f"{path}: posterior of another rig; [rig] {', '.join(other)} is not the same there as "
            f"in {spec.path}; run `python -m rigid.fit` on this spec"
        )


def _body(path: Path, tree: xr.DataTree) -> SpecBody:
    """The spec that a posterior is of."""
    try:
        return SpecBody.model_validate(tomllib.loads(str(tree.attrs["spec"])))
    except (KeyError, tomllib.TOMLDecodeError, ValidationError):
        raise InputError(f"{path}: does not tell of which spec it is the posterior") from None


def _values(body: xr.Dataset) -> dict[str, dict[str, np.ndarray]]:
    """Flat labels of a posterior group by name, (draws,) each."""
    out: dict[str, dict[str, np.ndarray]] = {}
    for name, variable in body.data_vars.items():
        if "frequency" in variable.dims:
            continue
        dims = [str(d) for d in variable.dims[2:]]
        own = len([d for d in dims if d.removeprefix(f"{name}_") in DIMENSIONS.get(str(name), ())])
        flat = np.asarray(variable.values).reshape(-1, *variable.shape[2:])
        for place in np.ndindex(*variable.shape[2:]):
            words = [str(variable[d].values[i]) for d, i in zip(dims, place, strict=True)]
            column = flat[(slice(None), *place)]
            if np.isfinite(column).all():
                label = _label(str(name), words[:own], words[own:])
                out.setdefault(str(name), {})[label] = column
    return out


def _label(name: str, own: Sequence[str], view: Sequence[str]) -> str:
    while own and own[-1] == "1" and name == "kappa_tank":
        own = own[:-1]
    return name + "".join(f"[{','.join(words)}]" for words in (own, view) if words)


def _unknown_sensors(
    spec: Spec, known: Mapping[str, np.ndarray], rng: np.random.Generator
) -> dict[str, dict[str, np.ndarray]]:
    """Gain, zero and noise of the field records' sensors that no calibration record read.

    - `known`: (draws,) by label.
    """
    out: dict[str, dict[str, np.ndarray]] = {"gain": {}, "zero": {}, "noise": {}}
    size = max(v.size for v in known.values())
    for one in _read_in_tests(spec):
        place, sheet = f"[{one.label}]", sheets(spec)[one.quantity]
        if f"gain{place}" not in known and f"gain{place}" not in out["gain"]:
            out["gain"][f"gain{place}"] = sheet.gain_sd * rng.standard_normal(size)
            out["zero"][f"zero{place}"] = sheet.zero_sd * rng.standard_normal(size)
        if f"noise{place}" not in known:
            out["noise"][f"noise{place}"] = np.array([sheet.noise])
    return out


def _read_in_tests(spec: Spec) -> list[Channel]:
    """What is read in the tests of a spec, test by test."""
    here = [record for record in spec.records if record.kind in SOUGHT]
    if spec.machine is not None:
        return [one for record in here for one in read_at(record)]
    return [Channel(quantity, record.cylinder) for record in here for quantity in QUANTITIES]


def draws(law: RigModel, field: Field) -> DrawBatch:
    """Return all draws of a law as one batch for a record.

    Raises InputError where the posterior has no value of a parameter for field records.
    """
    size, setup = law.size, field.setup
    seen = Scoped(law.values, (field.kind, field.place, field.label))

    def wide(names: Iterable[str]) -> dict[str, Array]:
        _require(law, seen, names)
        return {n: jnp.broadcast_to(jnp.asarray(seen[n]), (size,)) for n in names}

    if law.machine is None:
        names = [*CORE, *(n for e in law.effects for n in e.labels())]
        plant = RigPlant(rig=build_rig(law.effects, wide(names)), inputs=setup.inputs)
    else:
        layout = lay_out(law.machine)
        effects = acting(law.effects, layout, setup)
        values = wide([*numbers(effects, layout), *passed(law.values, setup)])
        plant = plants(layout, effects, setup, values, size)
    return DrawBatch(plant, Calibration(*(_sensors(law, setup, n) for n in ("gain", "zero"))))


def _require(law: RigModel, seen: Mapping[str, np.ndarray], names: Iterable[str]) -> None:
    """Refuse a posterior that lacks a number."""
    for name in names:
        if name not in seen:
            known = law.labels.get(name, ())
            told = f"only {', '.join(known)}" if known else "none at all"
            raise InputError(
                f"the posterior has no {name} for field records, {told}; fit a model in which "
                f"{name} does not vary by kind"
            )


def _sensors(law: RigModel, setup: Setup, what: str) -> Array:
    """Gain or zero of every channel (channels, draws); what was recorded has none."""
    rows = [
        jnp.zeros(law.size)
        if number in setup.recorded
        else jnp.broadcast_to(jnp.asarray(law.values[f"{what}[{one.label}]"]), (law.size,))
        for number, one in enumerate(setup.channels)
    ]
    return jnp.stack(rows)


EXACT = 1e-5
"""Sd with which what was recorded is read, in its typical size: as good as exactly."""


def sheet(spec: Spec, law: RigModel, setup: Setup) -> Sheet:
    """Noise as the calibration found it, and the converters' steps."""
    sigma, step = np.zeros((2, len(setup.channels)))
    for which, number in enumerate(setup.recorded):
        sigma[number] = EXACT * setup.inputs.recorded[which].size
    for number in setup.read:
        one = setup.channels[number]
        sigma[number] = np.median(law.values[f"noise[{one.label}]"])
        step[number] = spec.sensors[one.quantity].step
    return Sheet(sigma, step)

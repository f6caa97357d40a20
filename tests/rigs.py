"""Small rigs, drives and problems that several tests share. The numbers are the paper's."""

import dataclasses
from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np

from rigid.effects import CATALOGUE
from rigid.likelihood.channels import SensorSheet, make_pieces
from rigid.likelihood.groups import ReleaseGroup, SlowGroup
from rigid.likelihood.parameters import Parameter, Parameters, collect
from rigid.likelihood.priors import AbstractPrior, Fixed, Lognormal, Normal, Uniform, make_prior
from rigid.likelihood.problem import Problem
from rigid.likelihood.tracks import Series, Track
from rigid.physics import full, staggered
from rigid.physics.drive import Drive, side_by_side
from rigid.physics.rig import Rig, build_rig
from rigid.spec.rig import RigSpec
from rigid.spec.sheets import SHEETS as DEFAULTS

BASE = ("load-cell-spring", "oil-compressibility", "viscous-friction", "pump-curve")
MEMORY = (*BASE, "frequency-dependent-friction")

NOMINAL = {
    "M_HC": 60.0,
    "M_Pl": 10.0,
    "M_Fl": 200.0,
    "S_Pl": 44.2e-4,
    "L_0": 0.2,
    "k_frame": RigSpec().frame_stiffness.value,
    "k_oil": 2e9,
    "p_max": 700e5,
    "k_LC": 6e7,
    "mu": 1e5,
    "mu_branch[1]": 5e5,
    "mu_branch[2]": 1e5,
    "tau_branch[1]": 0.2,
    "tau_branch[2]": 8e-3,
}

SHEETS = {
    quantity: SensorSheet(s["step"], s["noise"], s["gain_sd"], s["zero_sd"])
    for quantity, s in DEFAULTS.items()
}


def effects(names=MEMORY) -> tuple:
    return tuple(CATALOGUE[name] for name in names)


def prior_draws(names, count: int, seed: int) -> list[dict[str, float]]:
    """Nominal rigs with the effects' parameters drawn from their own priors."""
    rng = np.random.default_rng(seed)
    draws = []
    for _ in range(count):
        values = dict(NOMINAL)
        for effect in effects(names):
            for info in effect.parameters():
                for label, prior in zip(info.labels, info.priors, strict=True):
                    law = make_prior(prior.law, prior.arguments, label)
                    values[label] = float(law.from_standard(jnp.asarray(rng.standard_normal())))
        draws.append(values)
    return draws


def rig_of(values, names=MEMORY, walkers: bool = False) -> Rig:
    """Scalar parameters, or a walkers' axis of length 1."""
    shaped = {k: jnp.asarray([v] if walkers else v, dtype=float) for k, v in values.items()}
    return build_rig(effects(names), shaped)


def march_still(rig: Rig, contact, fractions, drives) -> dict:
    """As `slow.march`: the pump at angle 0 when a record begins."""
    return staggered.march(rig, contact, fractions, drives, jnp.zeros_like(fractions[0]))


def in_full(rig: Rig, contact, fractions, record: Drive, tolerance: float = full.TOLERANCE) -> dict:
    """Readings (samples,) of one slow record by the full solve; `rig` has one walker."""
    levels = jnp.asarray(fractions, dtype=float)[:, None, None]
    drives, still = side_by_side((record,)), jnp.zeros((1, 1))
    out = full.march(rig, jnp.asarray([contact]), levels, drives, still, tolerance)
    return {quantity: np.asarray(series[:, 0, 0]) for quantity, series in out.items()}


def track(label: str, kind: str, samples: int, **more) -> Track:
    name, cylinder = label.split(",")
    slow = kind != "release"
    given = {
        "interval": 0.01 if slow else 1 / 1600,
        "drive": None,
        "onset": None if slow else 16,
        "first": 0.0,
        "size": samples,
    } | more
    return Track(label=label, name=name, kind=kind, cylinder=cylinder, samples=samples, **given)


def drive(samples: int, switches: tuple[float, ...], levels: tuple[int, ...]) -> Drive:
    return Drive(0.0, 0.01, samples, switches, levels, size=samples)


def converted(reading, sheet: SensorSheet, rng) -> np.ndarray:
    """What a sensor without gain and zero puts on record."""
    noisy = np.asarray(reading) + sheet.noise * rng.standard_normal(np.shape(reading))
    return np.round(noisy / sheet.step) * sheet.step if sheet.step else noisy


RECORDS_OWN = ("kappa", "kappa_tank", "preload", "release_time", "pump_angle")
KINDS_OF_RECORDS = ("frame", "free-run", "release", "field")


def parameter(label: str, law: AbstractPrior, unit: str = "SI", **more) -> Parameter:
    """A parameter of a flat label, `kappa[free-run-1,A]`, as a problem of a spec would have it."""
    name, *brackets = label.split("[")
    places = tuple(part for b in brackets for part in b.rstrip("]").split(","))
    told: dict = {"name": name, "places": places}
    if name in RECORDS_OWN:
        told |= dict(zip(("record", "cylinder"), places, strict=False))
    elif name == "noise":
        told |= {"cylinder": places[1]}
    elif places and places[-1] in KINDS_OF_RECORDS:
        told |= {"kind": places[-1], "varies": True}
    if places and places[0].isdigit():
        told |= {"number": places[0]}
    return Parameter(label, label, unit, law, **(told | more))


def parameters(free: dict[str, AbstractPrior], names=BASE, quantities=("acceleration,A",)):
    """The given numbers uncertain, noise levels at their sheets, the rest as in NOMINAL."""
    needed = [k for k in NOMINAL if "branch" not in k or "frequency-dependent-friction" in names]
    laws = {k: Fixed(NOMINAL[k]) for k in needed} | free
    for sensor in quantities:
        sheet = SHEETS[sensor.split(",")[0]]
        laws.setdefault(f"noise[{sensor}]", Lognormal(sheet.noise, 1.5))
    return collect([parameter(label, law) for label, law in laws.items()])


def problem(
    group, listed: Parameters, truth: dict[str, float], seed: int, sheets=SHEETS
) -> Problem:
    """The problem of records that the model itself made at `truth`, through the sensors."""
    values = listed.values(jnp.zeros((1, listed.size)))
    values = values | {k: jnp.asarray([v], dtype=float) for k, v in truth.items()}
    ideal, rng = group.predict(values), np.random.default_rng(seed)
    series = {}
    for i, one in enumerate(group.tracks):
        data = {
            q: converted(ideal[q][: one.samples, i, 0], sheets[q], rng) for q in group.quantities
        }
        series[one.label] = Series(data, {q: np.ones(one.samples) for q in data})
    groups = (group,)
    return Problem(group.effects, listed, groups, make_pieces(groups, series, sheets))


def release_problem(
    truth: dict[str, float], samples: int = 256, seed: int = 0, noise: float = 0.35
) -> Problem:
    """One quick release, friction viscous: k_LC, mu, preload, instant and noise uncertain."""
    one = track("release-1,A", "release", samples)
    interval = one.interval
    free = {
        "k_LC": Lognormal(6e7, 2.0),
        "mu": Lognormal(1e5, 10.0),
        "preload[release-1,A]": Normal(6000.0, 60.0),
        "release_time[release-1,A]": Uniform(15 * interval, 16 * interval),
    }
    free["noise[acceleration,A]"] = Lognormal(noise, 1.5)
    sheet = dataclasses.replace(SHEETS["acceleration"], noise=noise)
    group = ReleaseGroup((one,), effects(BASE))
    truth = {"release_time[release-1,A]": 15.4 * interval} | truth
    return problem(group, parameters(free), truth, seed, SHEETS | {"acceleration": sheet})


def frame_problem(
    samples: int = 150, seed: int = 0, names=BASE, known: Mapping[str, float] | None = None
) -> Problem:
    """A short frame compression: k_LC, mu, the flow fraction and three noise levels uncertain.

    - `names`: of its effects. - `known`: numbers of theirs that NOMINAL lacks.
    """
    one = track(
        "frame-1,A",
        "frame",
        samples,
        drive=drive(samples, (0.1, 0.803), (0, 1, 0)),
    )
    free = {
        "k_LC": Lognormal(6e7, 2.0),
        "mu": Lognormal(1e5, 10.0),
        "kappa[frame-1,A]": Lognormal(0.2, 3.0),
    }
    free |= {name: Fixed(value) for name, value in (known or {}).items()}
    sensors = tuple(f"{q},A" for q in SlowGroup.quantities)
    listed = parameters(free, quantities=sensors)
    return problem(SlowGroup((one,), effects(names)), listed, {}, seed)

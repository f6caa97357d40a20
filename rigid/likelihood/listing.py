"""Which numbers of a model are uncertain, and by how much."""

import dataclasses
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from functools import partial

from rigid.effects import CATALOGUE, AbstractEffect, declare
from rigid.effects.declare import ParameterInfo, PriorDescription
from rigid.io.errors import InputError, together
from rigid.likelihood.effect_lookup import effects_named
from rigid.likelihood.grouping import Grouping, explained
from rigid.likelihood.groups import flow_name
from rigid.likelihood.machine import able, constants, lay_out, placed_in
from rigid.likelihood.machine_runs import starts
from rigid.likelihood.parameters import Parameter, Parameters, collect, require_known
from rigid.likelihood.per_record import (
    LEAD,
    PICKUP_ANGLE,
    PUMP_ANGLE,
    beating,
    letting_go,
    picking_up,
)
from rigid.likelihood.priors import AbstractPrior, make_prior
from rigid.likelihood.tracks import Series, Track
from rigid.physics.sensors import UNITS
from rigid.spec import Spec
from rigid.spec.values import PriorSpec

RIG_SYMBOLS = {
    "M_HC": (r"M_\mathrm{HC}", "kg"),
    "M_Pl": (r"M_\mathrm{Pl}", "kg"),
    "M_Fl": (r"M_\mathrm{Fl}", "kg"),
    "S_Pl": (r"S_\mathrm{Pl}", "m^2"),
    "L_0": (r"L_0", "m"),
    "k_frame": (r"k_\mathrm{frame}", "N/m"),
    "k_oil": (r"k_\mathrm{oil}", "Pa"),
    "p_max": (r"p_\mathrm{max}", "Pa"),
}

KAPPA_PRIOR = declare.lognormal(0.2, 3.0)
"""Around the values the paper uses, 0.2 and 0.12 (before eq. 23)."""

TANK_PRIOR = declare.lognormal(-0.2, 3.0)

Effects = Iterable[type[AbstractEffect]]

ANY_ANGLE = declare.uniform(-math.pi, math.pi)

MOTION_CONSTANTS = ("M_Pl", "S_Pl")
"""Constants of one body: its mass, the area that a pressure acts on."""

NOISE_FACTOR = 1.5
"""The sheet gives the noise of one sample as 'about' so much."""


def list_parameters(
    spec: Spec,
    effects: tuple[type[AbstractEffect], ...],
    tracks: tuple[Track, ...],
    series: Mapping[str, Series],
) -> Parameters:
    """List every number of the model with its prior; the spec's word goes before the effect's."""
    physical = list(_physical(spec, effects, tracks))
    local = list({p.label: p for t in tracks for p in _local(spec, t)}.values())
    local += _starts(spec, tracks, series)
    acting = Grouping(effects, {}, spec.model.only).acting
    local += [
        _stated(spec, one)
        for effect in effects
        for one in of_records([effect], [t for t in tracks if effect in acting(t)])
    ]
    local = list({p.label: p for p in local}.values())
    noise = list(_noise(spec, tracks, series))
    listed = physical + local + noise
    names = {p.label for p in listed} | {p.base for p in listed}
    varied = {p.base for p in physical}
    together(
        lambda: require_answered(spec, names | of_candidates(spec)),
        lambda: require_known(spec.model.vary, varied, f"{spec.path} [model] vary"),
    )
    return collect(listed)


def require_answered(spec: Spec, known: set[str]) -> None:
    """Refuse priors of numbers that are not in the model.

    Raises InputError; of a number of the catalogue it says whose it is.
    """
    where = f"{spec.path} [priors]"
    for name in spec.priors:
        owners = [one.name for one in CATALOGUE.values() if name in one.labels()]
        if owners and name not in known:
            raise InputError(
                f"{where}: '{name}' is a number of {' or '.join(owners)}, and the model has none; "
                "add it to [model] effects, or for rigid.discover to [model] candidates"
            )
    require_known(spec.priors, known, where)


def of_candidates(spec: Spec) -> set[str]:
    """Labels of the parameters of effects that the spec names as missing, perhaps.

    In a machine at every joint at which they can act.
    """
    where = f"{spec.path} [model] candidates"
    named = effects_named(spec.model.candidates or (), spec.path.parent, where)
    if spec.machine is not None:
        named = tuple(
            placed_in(spec.machine, one, at.name) for one, at in able(spec.machine, named)
        )
    infos = [info for effect in named for info in effect.parameters()]
    return {label for info in infos for label in (info.name, *info.labels)}


def _stated(spec: Spec, one: Parameter) -> Parameter:
    """Return a parameter with the spec's prior for its label or its name, where it states one."""
    for name in (one.label, one.base):
        if name in spec.priors:
            stated = _described(spec.priors[name], f"{spec.path} [priors] {name}")
            return dataclasses.replace(one, prior=stated)
    return one


def given_priors(spec: Spec) -> dict[str, AbstractPrior]:
    """Priors that a spec states itself, by label."""
    made = together(
        *(
            partial(_described, prior, f"{spec.path} [priors] {name}")
            for name, prior in spec.priors.items()
        )
    )
    return dict(zip(spec.priors, made, strict=True))


def _described(prior: PriorDescription | PriorSpec, where: str = "built-in prior") -> AbstractPrior:
    return make_prior(prior.law, prior.arguments, where)


def _physical(
    spec: Spec, effects: tuple[type[AbstractEffect], ...], tracks: tuple[Track, ...]
) -> Iterator[Parameter]:
    """Constants of the rig, then parameters of the effects, spread over what they vary by."""
    fixed = list(_constants(spec, tracks))
    for one in fixed:
        yield from _spread(spec, one, tracks)
    known = {one.label for one in fixed}
    for effect in effects:
        own = _of_a_record(spec.model.only.get(effect.name), tracks)
        there = tuple(t for t in tracks if effect.acts_in(t.kind))
        for info in effect.parameters():
            for label, prior in zip(info.labels, info.priors, strict=True):
                if label not in known:
                    one = of_effect(info, label, _described(prior))
                    yield from _spread(spec, dataclasses.replace(one, **own), there or tracks)
                    if effect.place:
                        known.add(label)  # a number that joints share


def _constants(spec: Spec, tracks: tuple[Track, ...]) -> Iterator[Parameter]:
    """What a rig, a moving body or a machine is made of."""
    if spec.machine is not None:
        for place, name, symbol, unit, value in constants(spec.machine):
            prior = _described(declare.normal(value.value, value.sd), f"{spec.path} [machine]")
            label = f"{name}[{place}]"
            yield Parameter(label, at(symbol, place), unit, prior, name=name, places=(place,))
        return
    known = dict(spec.rig.known)
    if not of_the_rig(tracks):
        known = {name: known[name] for name in MOTION_CONSTANTS}
    for name, constant in known.items():
        symbol, unit = RIG_SYMBOLS[name]
        where = f"{spec.path} [rig] {name}"
        prior = _described(declare.normal(constant.value, constant.sd), where)
        yield Parameter(name, symbol, unit, prior)


def of_effect(info: ParameterInfo, label: str, prior: AbstractPrior) -> Parameter:
    """Return one number of an effect: `mu`, of several `mu_branch[1]`, of a joint `mu[left]`."""
    number = str(1 + info.labels.index(label)) if len(info.labels) > 1 else ""
    places = tuple(word for word in (number, info.place) if word)
    return Parameter(
        label,
        at(info.symbol, info.place),
        info.unit,
        prior,
        name=info.name,
        places=places,
        number=number,
        cylinder=info.place,
    )


def at(symbol: str, place: str) -> str:
    """TeX of a number that belongs to a joint or a body; of no place, the symbol itself."""
    words = re.sub(r"[^A-Za-z0-9]+", r"\\,", place)
    return rf"{symbol}^{{\mathrm{{{words}}}}}" if place else symbol


def _of_a_record(scope: str | None, tracks: tuple[Track, ...]) -> dict[str, str]:
    """Record and cylinder that an effect is confined to, where it is confined to a record."""
    found = next((t for t in tracks if t.label == scope), None)
    return {} if found is None else {"record": found.name, "cylinder": found.cylinder}


def _spread(spec: Spec, one: Parameter, tracks: tuple[Track, ...]) -> Iterator[Parameter]:
    """Yield the parameter once, or once for each kind, cylinder or record it varies by."""
    by = spec.model.vary.get(one.label)
    if by is None:
        yield _stated(spec, one)
        return
    views = {
        "kind": lambda t: {"kind": t.kind},
        "cylinder": lambda t: {"cylinder": t.cylinder},
        "record": lambda t: {"record": t.name, "cylinder": t.cylinder},
    }
    for view in {tuple(views[by](t).items()): None for t in tracks}:
        places = tuple(word for _, word in view)
        more = dict(view) | {"name": one.base, "places": one.places + places, "varies": True}
        label = f"{one.label}[{','.join(places)}]"
        yield _stated(spec, dataclasses.replace(one, label=label, **more))


def of_records(effects: Effects, tracks: Iterable[Track]) -> list[Parameter]:
    """Numbers that effects bring in for each of some records, in which all of them act."""
    listed = tuple(tracks)
    return [*_angles(effects, listed), *_leads(effects, listed)]


def _leads(effects: Effects, tracks: Iterable[Track]) -> Iterator[Parameter]:
    """By how much straps begin earlier to let go than releases begin, where they take their time.

    The instant of a release lies between two samples; where a fifth of a gradual one has gone may
    be a sample before or after.
    """
    listed = tuple(tracks)
    labels = letting_go(effects, listed)
    for t in (t for t in listed if t.label in labels):
        prior = _described(declare.normal(0.0, t.interval))
        yield of_record(LEAD, (t.name, t.cylinder), r"\delta_0", "s", prior)


def _angles(effects: Effects, tracks: Iterable[Track]) -> list[Parameter]:
    """Angles at which records found what beats: all are alike."""
    kinds, listed = tuple(effects), tuple(tracks)
    labels, prior = beating(kinds, listed), _described(ANY_ANGLE)
    found: dict[str, Parameter] = {}
    for t in (t for t in listed if t.label in labels):
        shared = labels[t.label] == f"{PUMP_ANGLE}[{t.name}]"
        places = (t.name,) if shared else (t.name, t.cylinder)
        found[labels[t.label]] = of_record(PUMP_ANGLE, places, r"\varphi_\mathrm{r}", "rad", prior)
    by_label = {t.label: t for t in listed}
    for (track, quantity), label in picking_up(kinds, listed).items():
        places = (by_label[track].name, by_label[track].cylinder)
        symbol = rf"\varphi_\mathrm{{h,{quantity}}}"
        found[label] = of_record(f"{PICKUP_ANGLE}_{quantity}", places, symbol, "rad", prior)
    return list(found.values())


def of_record(
    name: str, places: tuple[str, ...], symbol: str, unit: str, prior: AbstractPrior
) -> Parameter:
    """Return a number of a record's own.

    - `places`: the record, then the cylinder where it is one cylinder's, then the stretch.
    """
    record, cylinder = (*places[:2], "")[:2]
    label = f"{name}[{','.join(places)}]"
    return Parameter(
        label, symbol, unit, prior, name=name, places=places, record=record, cylinder=cylinder
    )


def _local(spec: Spec, track: Track) -> Iterator[Parameter]:
    """Numbers of one record: flow fractions, preload, instant of release."""
    own = (track.name, track.cylinder)
    for level in track.open_levels:
        name, places = flow_name(track, level)
        if len(places) == 1:  # with a command: a number of the joint
            one = Parameter(
                f"{name}[{places[0]}]", r"\kappa", "1", _described(declare.fixed(1.0)), name=name,
                places=places, cylinder=places[0],
            )  # fmt: skip
        else:
            prior = _described(KAPPA_PRIOR if level == 1 else TANK_PRIOR)
            one = of_record(name, places, r"\kappa", "1", prior)
        yield _stated(spec, one)
    if track.onset is None:
        return
    record = next(r for r in spec.records if (r.name, r.cylinder) == (track.name, track.cylinder))
    assert record.preload is not None  # a spec states one for every release
    prior = _described(
        declare.normal(record.preload.value, record.preload.sd), f"preload[{track.label}]"
    )
    yield _stated(spec, of_record("preload", own, r"F_0", "N", prior))
    prior = _release_law(record.release_time, track)
    yield _stated(spec, of_record("release_time", own, r"t_0", "s", prior))


def _starts(
    spec: Spec, tracks: tuple[Track, ...], series: Mapping[str, Series]
) -> Iterator[Parameter]:
    """Where runs of a machine start that are in motion when they begin."""
    if spec.machine is None:
        return
    for one in starts(lay_out(spec.machine), tracks, series):
        label, prior = f"{one.name}[{one.run},{one.at}]", declare.normal(0.0, one.size)
        yield _stated(spec, Parameter(
            label, at(one.symbol, one.at), one.unit, _described(prior), name=one.name,
            places=(one.run, one.at), record=one.run,
        ))  # fmt: skip


def _release_law(given, track: Track) -> AbstractPrior:
    """Instant of release: exact where given so, else between the samples around the onset."""
    high = float(track.onset_time)
    low = high - track.interval
    if given is None:
        prior = declare.uniform(low, high)
    elif given.sd == 0.0:
        prior = declare.fixed(given.value)
    else:
        prior = declare.truncated_normal(given.value, given.sd, low, high)
    return _described(prior, "release_time")


def _noise(
    spec: Spec, tracks: tuple[Track, ...], series: Mapping[str, Series]
) -> Iterator[Parameter]:
    """Noise level of every sensor that read anything."""
    seen = dict.fromkeys(
        (q, t.cylinder)
        for q in UNITS
        for t in tracks
        if series[t.label].has(q) and q in explained(t.of.solver)
    )
    for quantity, cylinder in seen:
        label = f"noise[{quantity},{cylinder}]"
        about = declare.lognormal(spec.sensors[quantity].noise, NOISE_FACTOR)
        prior, places = _described(about, label), (quantity, cylinder)
        yield _stated(spec, Parameter(
            label, r"\sigma", UNITS[quantity], prior, name="noise", places=places, cylinder=cylinder
        ))  # fmt: skip


def of_the_rig(tracks: tuple[Track, ...]) -> bool:
    """Whether any record is of the rig, not of one body of some machine."""
    return any(track.of.of_the_rig() for track in tracks)

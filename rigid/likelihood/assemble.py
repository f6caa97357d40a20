"""From a spec and its records to a problem."""

import dataclasses
from collections.abc import Mapping

from rigid.effects import CATALOGUE, AbstractEffect
from rigid.effects.base import MOTION
from rigid.effects.placed import origin
from rigid.io.errors import InputError
from rigid.likelihood.channels import SensorSheet, make_pieces
from rigid.likelihood.effect_lookup import effects_named
from rigid.likelihood.grouping import Grouping
from rigid.likelihood.listing import list_parameters, of_the_rig
from rigid.likelihood.machine import at_joints, lay_out
from rigid.likelihood.machine_runs import fed, resolved
from rigid.likelihood.parameters import require_known
from rigid.likelihood.problem import Problem
from rigid.likelihood.sizes import of_its_size, usual_in
from rigid.likelihood.tracks import Series, Track, make_track
from rigid.physics.inverse import FORCE
from rigid.physics.sensors import UNITS
from rigid.records.converter import coarseness
from rigid.records.record import Record
from rigid.spec import Spec


def assemble(spec: Spec, records: tuple[Record, ...]) -> Problem:
    """Make the problem that a spec states for records that have been read.

    Raises InputError for effects, priors or parameters to vary that nothing answers to.
    """
    effects = chosen_effects(spec)
    laid = [make_track(r) for r in records]
    tracks = tuple(one.track for one in laid)
    series = {one.track.label: one.series for one in laid}
    if not tracks:
        raise InputError(f"{spec.path}: no record is fitted; a fit needs at least one")
    require_at_work(spec, effects, tracks)
    read = (s.data[FORCE][s.weight[FORCE] > 0.0] for s in series.values() if s.has(FORCE))
    effects = of_its_size(effects, usual_in(spec, (track.along for track in tracks), read))
    tracks = fed(tracks, effects)
    parameters = list_parameters(spec, effects, tracks, series)
    confined(spec, effects, tracks)
    tolerance = spec.solve.tolerance if spec.solve.method == "diffrax" else None
    layout = None if spec.machine is None else lay_out(spec.machine)
    if layout is not None and spec.solve.steps is not None:
        layout = dataclasses.replace(layout, steps=spec.solve.steps)
    elif layout is not None:
        layout = resolved(layout, effects, parameters, tracks)
    grouping = Grouping(effects, dict(spec.model.vary), dict(spec.model.only), tolerance, layout)
    groups = grouping(tracks)
    pieces = make_pieces(groups, series, sheets(spec, series))
    return Problem(effects, parameters, groups, pieces)


def chosen_effects(spec: Spec) -> tuple[type[AbstractEffect], ...]:
    """Look the spec's effects up."""
    where = f"{spec.path} [model] effects"
    chosen = effects_named(spec.model.effects, spec.path.parent, where)
    if spec.machine is not None:
        named = dict(zip(spec.model.effects, chosen, strict=True))
        chosen = at_joints(spec.machine, named, f"{spec.path} [machine]")
    owners: dict[str, type[AbstractEffect]] = {}
    for effect in chosen:
        for label in effect.labels():
            other = owners.setdefault(label, effect)
            if origin(other) is not origin(effect):
                raise InputError(
                    f"{where}: '{other.name}' and '{effect.name}' are two laws for one thing, both "
                    f"have {label}; name one of them"
                )
    return chosen


def require_at_work(
    spec: Spec,
    effects: tuple[type[AbstractEffect], ...],
    tracks: tuple[Track, ...],
    among: str = "effects",
) -> None:
    """Refuse effects of the rig where no record is of it, and what a measured motion cannot show.

    - `among`: the list of `[model]` that names them.
    """
    if of_the_rig(tracks):
        return
    kinds = dict.fromkeys(track.kind for track in tracks)
    where = f"{spec.path} [model] {among}"
    for effect in effects:
        if not any(map(effect.acts_in, kinds)):
            able = (name for name, one in CATALOGUE.items() if any(map(one.acts_in, kinds)))
            raise InputError(
                f"{where}: '{effect.name}' is of the rig, all records are "
                f"{' or '.join(f'{kind}s' for kind in kinds)}; state {among} = [...], of "
                f"{', '.join(able)}"
            )
        if MOTION in kinds and (silent := _not_asked(effect)):
            raise InputError(
                f"{where}: '{effect.name}' has {silent}, which nothing asks for along a measured "
                'motion; there an effect pushes the body, or delays the "force"'
            )


def _not_asked(effect: type[AbstractEffect]) -> str:
    """What an effect says that a measured motion does not ask for; "" for nothing."""
    for name in ("sense", "averaging", "lines", "strap", "root"):
        if getattr(effect, name) is not getattr(AbstractEffect, name):
            return f"{name}()"
    late = effect.build(dict.fromkeys(effect.labels(), 1.0)).delays()
    other = next((quantity for quantity in late if quantity != FORCE), None)
    return "" if other is None else f'delays() of "{other}"'


def confined(
    spec: Spec, effects: tuple[type[AbstractEffect], ...], tracks: tuple[Track, ...]
) -> None:
    """Refuse effects confined to what is not there."""
    where = f"{spec.path} [model] only"
    require_known(spec.model.only, (effect.name for effect in effects), where)
    for name, scope in spec.model.only.items():
        require_known([scope], {s for t in tracks for s in t.scope}, f"{where} {name}")


def sheets(spec: Spec, series: Mapping[str, Series] | None = None) -> dict[str, SensorSheet]:
    """Sensor sheets by quantity.

    - `series`: what was read, by the label of the track. Where every reading of a quantity falls on
      a multiple of the stated step, the converter was coarser than its sheet says, and a sample is
      an interval of the width that it really had.
    """
    out = {}
    for quantity, sheet in spec.sensors.stated.items():
        if quantity in UNITS:
            read = [s for s in (series or {}).values() if s.has(quantity)]
            values = [s.data[quantity][s.weight[quantity] > 0] for s in read]
            step = sheet.step * coarseness(values, sheet.step)
            out[quantity] = SensorSheet(
                step, sheet.noise, sheet.gain_sd, sheet.zero_sd, stated_step=sheet.step
            )
    return out

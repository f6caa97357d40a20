"""Priors of the catalogue for a body whose motion was measured, in place of those for the rig."""

from collections.abc import Iterable

import numpy as np
from jax import Array

from rigid.effects import CATALOGUE, AbstractEffect
from rigid.effects.placed import RIG, Scales, sized
from rigid.io.errors import InputError
from rigid.likelihood.listing import given_priors
from rigid.likelihood.problem import Problem
from rigid.physics.inverse import FORCE, Along
from rigid.spec import Spec


def of_its_size(
    effects: Iterable[type[AbstractEffect]], usual: Scales
) -> tuple[type[AbstractEffect], ...]:
    """Return effects with priors for what is usual; those of the user's own keep theirs."""
    return tuple(
        sized(effect, usual) if CATALOGUE.get(effect.name) is effect else effect
        for effect in effects
    )


def usual_in(spec: Spec, along: Iterable[Along | None], forces: Iterable[np.ndarray]) -> Scales:
    """Return what is usual in the body whose motions were measured; where there is none, the rig's.

    - `along`: motion of every record, None where it was not measured. - `forces`: that were read
      [N].

    Raises InputError where the spec states sizes of what is none.
    """
    runs = list(along)
    measured = [run for run in runs if run is not None]
    if len(measured) == len(runs):
        return scales_of(spec, measured, list(forces))
    if spec.model.usual is not None:
        raise InputError(
            f"{spec.path} [model] usual: it is for motions of a body, and not all records are "
            "motions; leave it out, a machine has a [machine] usual of its own"
        )
    return RIG


def usual_of(spec: Spec, problem: Problem) -> Scales:
    """Return the same from a problem that was put together."""
    forces = (one for one in problem.pieces if one.quantity == FORCE)
    read = (np.asarray(one.data)[np.asarray(one.weight) > 0.0] for one in forces)
    return usual_in(spec, (track.along for track in problem.tracks), read)


def scales_of(spec: Spec, along: list[Along], forces: list[np.ndarray]) -> Scales:
    """What is usual in measured motions: as the spec states it, or as the records have it.

    Force, speed and pressure are then root mean squares, the stroke is half of how far the body
    goes, to two digits. Where the mass takes more force than acts, a swing that hardly anything
    shakes, it is that of the mass.
    """
    stated = spec.model.usual
    if stated is not None:
        pressure = RIG.pressure if stated.pressure is None else stated.pressure
        return Scales(stated.force, stated.stroke, stated.speed, pressure)
    prior = given_priors(spec).get("M_Pl")
    mass = spec.rig.M_Pl.value if prior is None else float(prior.from_standard(0.0))
    found = (
        max(_rms(forces), mass * _rms([run.acceleration for run in along])),
        0.5 * max(float(np.ptp(run.position)) for run in along),
        _rms([run.velocity for run in along]),
        _rms([run.pressure for run in along]) or RIG.pressure,
    )
    return Scales(*(float(f"{size:.2g}") for size in found))


def _rms(parts: Iterable[Array | np.ndarray]) -> float:
    return float(np.sqrt(np.mean(np.square(np.concatenate([np.asarray(one) for one in parts])))))

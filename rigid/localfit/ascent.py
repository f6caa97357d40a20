"""Hypotheses led to their optima side by side: each turn of the program serves them all."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from rigid.localfit.expansion import Point, expand, lanes_needed
from rigid.localfit.families import Family
from rigid.localfit.local import LOUDEST, LocalFit, fitted_noise, with_noise
from rigid.localfit.trust_region import Bend, model_of, moved_within, promised

LONGEST = 2.0
"""Largest change of an entry of w in one step."""
MOST_TURNS, MOST_STEPS = 25, 48
"""Turns of several hypotheses, and of one, at most."""
BETWEEN, LITTLE = 6, 0.3
"""Turns of one hypothesis after which its noise levels follow. One that has come up by less than
the second in as many is done: what leaps at its samples has no top that a step could come to."""
CLOSE, CLOSER = 0.2, 0.02
"""Done when the top of the model is less above than this in log-posterior: where the integral goes
on from there to the top of the parabola, and where it does not."""
SHORTER, POOR, WELL = 0.3, 0.25, 0.8
"""After a step that brings less than the second share of what it promised, the next has at most the
first share of its length (so has each further step that is tried in the same turn); after one that
brings more than the third, it may have twice its length."""
MOST_TRIES = 4
"""Steps of one hypothesis that are tried in one turn, where lanes are free."""
SHORTEST = 0.003
"""Length, in prior sds, below which no more steps are tried."""
TWICE, ROOM = 2.0, 50.0
"""A fit is given up where so many times what its model promises, and so many nats, do not bring it
up to a rival: a bent valley can bring more than what is promised where it begins."""


class Tried(NamedTuple):
    """A step of w, the log-posterior that it promised, and what came of it."""

    step: Float[np.ndarray, " size"]
    gain: float
    local: LocalFit


class Climb(NamedTuple):
    """How far a fit has come.

    - `best`: the highest so far. - `here`: where the next step begins. - `radius`: how far a step
      from the highest may go. - `close`: what the top may be above the best at the end.
    - `rival`: log-posterior of another fit; one that will not come up to it is given up.
    - `bold`: whether a place that is lower may be gone on from.
    - `bend`: of the step that led to the best; None before there was one.

    Records of a thousand noise sds bend every valley: a step along it ends beside it, lower, but
    with slopes by which the next one may end further up than where both began. So from a place
    that is lower, but promises more, one further step is taken before it is given up (the watchdog
    of Chamberlain, Powell, Lemarechal and Pedersen 1982, Math. Program. Study 16); after one in
    vain no other is, until a step has kept its promise.
    """

    best: LocalFit
    here: LocalFit
    radius: float
    close: float = CLOSE
    rival: float = -np.inf
    bold: bool = True
    bend: Bend | None = None

    @property
    def open(self) -> bool:
        """Whether there is more to come.

        It is the model's top, however far, that tells: a step that is short because longer ones
        have failed promises little wherever the top is.
        """
        if self.here is not self.best:
            return True
        if self.radius < SHORTEST:
            return False
        return promised(self.best) > self.close and not given_up(self.best, self.rival)

    @property
    def reach(self) -> float:
        """How far the next step may go."""
        return self.radius if self.here is self.best else min(2.0 * self.radius, LONGEST)

    def after(self, tried: Sequence[Tried]) -> "Climb":
        """Where it goes on after steps."""
        lengths = [float(np.abs(one.step).max()) for one in tried]
        heights = [one.local.value if one.local.finite else -np.inf for one in tried]
        top = int(np.argmax(heights))
        _, gain, one = tried[top]
        straight = self.here is self.best
        if heights[top] > self.best.value:
            rise = heights[top] - self.here.value
            longer = min(_times(rise, gain) * lengths[top], LONGEST)
            radius = longer if straight else max(longer, self.radius)
            bold = self.bold or rise > WELL * gain
            bend = Bend.between(self.here, one)
            return self._replace(best=one, here=one, radius=radius, bold=bold, bend=bend)
        if straight and self.bold and np.isfinite(heights[0]):
            first = tried[0].local
            if first.value + promised(first) > self.best.value + self.close:
                return self._replace(here=first, radius=lengths[-1])
        radius = SHORTER * (lengths[-1] if straight else self.radius)
        return self._replace(here=self.best, radius=radius, bold=self.bold and straight)


def _times(rise: float, gain: float) -> float:
    """How much longer than a step the next may be, by what came of its promise `gain`."""
    if rise > WELL * gain:
        return 2.0
    return 1.0 if rise > POOR * gain else SHORTER


def led(program: Family, found: Sequence[LocalFit], turns: int = MOST_TURNS) -> list[LocalFit]:
    """Lead hypotheses to their optima and their noise levels to theirs.

    - `turns`: of the program, at most, before the noise levels move; half as many after.
    """
    return settled(program, descended(program, found, turns), turns // 2)


def settled(program: Family, found: Sequence[LocalFit], turns: int) -> list[LocalFit]:
    """Lead noise levels to their optima, then hypotheses to theirs."""
    return descended(program, [with_noise(one, fitted_noise(one)) for one in found], turns)


def refined(
    local: LocalFit, most: int = MOST_STEPS, rival: float = -np.inf, loudest: float = LOUDEST
) -> LocalFit:
    """Lead one hypothesis and its noise levels to their optima, CLOSER.

    Noise levels follow every few turns: what a fit far from its optimum leaves over is no noise,
    but beside it the model must not be taken for exact, or steps are short and valleys narrow.

    - `most`: turns. - `rival`: as in `Climb`. - `loudest`: greatest noise level, in prior sds.
    """
    program = local.family
    climb = Climb(local, local, LONGEST, CLOSER, rival)
    while most > 0:
        begun, (climb,), used = climb.best, *_climbed(program, [climb], min(BETWEEN, most))
        other = with_noise(climb.best, fitted_noise(climb.best, loudest))
        gained, by_noise = other.value - begun.value, other.value - climb.best.value
        climb, most = climb._replace(best=other, here=other), most - used
        if not climb.open:
            if by_noise < CLOSER:
                break
            climb = climb._replace(radius=LONGEST)
        elif used == BETWEEN and gained < LITTLE:
            break
    return climb.best


def given_up(local: LocalFit, rival: float) -> bool:
    """Whether a fit is too far below the log-posterior of a rival to be led on."""
    if not local.finite or local.value + ROOM >= rival:
        return False  # there is no model where nothing could be simulated
    return local.value + TWICE * promised(local) + ROOM < rival


def descended(
    program: Family, found: Sequence[LocalFit], turns: int = MOST_TURNS, close: float = CLOSE
) -> list[LocalFit]:
    """Lead hypotheses uphill, noise levels held, for so many turns of the program at most."""
    climbs = [Climb(one, one, LONGEST, close) for one in found]
    return [climb.best for climb in _climbed(program, climbs, turns)[0]]


def _climbed(program: Family, climbs: list[Climb], turns: int) -> tuple[list[Climb], int]:
    """Take climbs on by so many turns of the program at most; give also how many it took."""
    for used in range(turns):
        open_ = [i for i, climb in enumerate(climbs) if climb.open]
        if not open_:
            return climbs, used
        needed = sum(lanes_needed(program, climbs[i].here.hypothesis) for i in open_)
        tries = min(MOST_TRIES, max(1, program.lanes // needed))
        steps = {i: _steps(climbs[i], tries) for i in open_}
        points = [
            Point.beside(climbs[i].here, climbs[i].here.w + step)
            for i in open_
            for step, _ in steps[i]
        ]
        tried = iter(expand(program, points))
        for i in open_:
            climbs[i] = climbs[i].after([Tried(*pair, next(tried)) for pair in steps[i]])
    return climbs, turns


def _steps(climb: Climb, tries: int) -> list[tuple[Float[np.ndarray, " size"], float]]:
    """Steps of w, each SHORTER than the one before, and what they promise."""
    model = model_of(climb.here, climb.bend if climb.here is climb.best else None)
    found = [moved_within(model, climb.reach)]
    for _ in range(tries - 1):
        found.append(moved_within(model, SHORTER * float(np.abs(found[-1][0]).max())))
    return found

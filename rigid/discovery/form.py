"""Whether the records want an effect in another form than its law has.

What an effect with another law leaves is like the signature of the one that is named, and stronger
here and weaker there. So the contribution of the named one is let vary: times 1 + g, where g is an
unknown function of the time of a record or of one of its states, piecewise linear, with heights
that are Gaussian with a common sd. A law that is not exact leaves a small g; one that stands for
another cause, a g of order one.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.special import logsumexp

from rigid.discovery.disagreement import TIME, states_of
from rigid.effects import AbstractEffect
from rigid.localfit.evidence import mean_of, of_gaussian
from rigid.localfit.hidden_inputs import bump
from rigid.localfit.local import LocalFit
from rigid.localfit.screening import Around, screen

OF_THE_LAW, OF_ANOTHER = (0.0, 0.03, 0.1, 0.3), (0.5, 1.0, 2.0)
"""Sds of g of a law that is not exact, and of the law of another cause; all as probable."""
HEIGHTS = 6
"""Of a piecewise linear function over what it goes by."""
CLEARLY = 3.0
"""Nats from which on another form is told: odds of 20."""
ENDS = (0.005, 0.995)
"""Quantiles between which it has them: spikes would stretch it."""


class OtherForm(NamedTuple):
    """How much better the records are explained by an effect in another form than its law has.

    - `over`: what the form goes by. - `log_bayes`: of another law against one that is not exact.
    """

    over: str
    log_bayes: float


def other_form(local: LocalFit, effect: type[AbstractEffect]) -> OtherForm | None:
    """Let the contribution of an effect vary; None where it contributes nothing.

    - `local`: a fit that has it, and all else that came in: what else is missing would be taken for
      its form.
    """
    contribution = contributed(local, effect)
    if not contribution.any():
        return None
    logs = {over: _logs(local, columns) for over, columns in _varied(local, contribution)}
    if not logs:
        return None
    curves = np.array(list(logs.values()))
    own, others = curves[:, : len(OF_THE_LAW)], curves[:, len(OF_THE_LAW) :]
    over = list(logs)[int(np.argmax(np.asarray(logsumexp(others, axis=1))))]
    return OtherForm(over, float(mean_of(others.ravel()) - mean_of(own.ravel())))


def contributed(local: LocalFit, effect: type[AbstractEffect]) -> Float[np.ndarray, " n"]:
    """What an effect adds to every reading of a fit, to first order in its amplitudes."""
    values, labels = local.hypothesis.values(local.w), local.hypothesis.labels
    out = np.zeros(len(local.residual))
    for info in effect.parameters():
        for label in info.labels:
            if info.absent is not None and label in values:
                value, slope = values[label]
                out += local.design[:, labels.index(label)] * ((value - info.absent) / slope)
    return out


def _varied(
    local: LocalFit, contribution: Float[np.ndarray, " n"]
) -> Iterator[tuple[str, Float[np.ndarray, "n k"]]]:
    """What a contribution changes by where it varies over each state, and over time."""
    layout, found = local.layout, {}
    for number, channel in enumerate(layout.channels):
        rows = np.flatnonzero((layout.channel == number) & layout.read)
        states = states_of(local, layout.channels, channel, rows)
        for name, state in states.items():
            found.setdefault((name, ""), []).append((rows, state))
        found.setdefault((TIME, channel.track), []).append((rows, layout.time[rows]))
    parts: dict[str, list[np.ndarray]] = {}
    for (name, _), pieces in found.items():
        rows = np.concatenate([one for one, _ in pieces])
        state = np.concatenate([one for _, one in pieces])
        low, high = np.quantile(state, ENDS) if len(state) else (0.0, 0.0)
        if high > low:
            columns = np.zeros((len(contribution), HEIGHTS))
            columns[rows] = _bumps(state, low, high) * contribution[rows, None]
            parts.setdefault(name, []).append(columns)
    yield from ((name, np.concatenate(some, axis=1)) for name, some in parts.items())


def _bumps(state: Float[np.ndarray, " m"], low: float, high: float) -> Float[np.ndarray, "m k"]:
    """Triangles over a state, each as wide as they are apart; beyond the ends, as at them."""
    centres = np.linspace(low, high, HEIGHTS)
    inside = np.clip(state, low, high)[:, None]
    return np.asarray(bump(inside, centres, centres[1] - centres[0]))


def _logs(local: LocalFit, columns: Float[np.ndarray, "n k"]) -> Float[np.ndarray, " sds"]:
    """Log Bayes factors of heights of each sd against none."""
    around = Around(local.terms.score, local.terms.curvature, local.design, local.gradient)
    found = screen(around, columns)
    values, axes = np.linalg.eigh(found.information)
    variances = np.square([*OF_THE_LAW, *OF_ANOTHER])[:, None]
    return of_gaussian(np.maximum(values, 0.0), found.slope @ axes, variances)

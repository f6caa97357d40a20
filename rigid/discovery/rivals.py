"""Which effects are fitted in full at a turn, and what that changes in the odds."""

from collections.abc import Iterable, Mapping

from rigid.discovery.refit import MOST, NO_LEAD, Lead, Refit, contained, lead_of, worth_refitting
from rigid.discovery.turn import Turn
from rigid.discovery.weighing.discrepancy import beside
from rigid.discovery.weighing.explain import UNNAMED, Explained
from rigid.discovery.weighing.odds import Odds, odds
from rigid.discovery.weighing.pairs import UNSURE, Pairs, pairs

NEAR = 2
"""Effects that are fitted in full, at most, for what they explain near the priors alone."""


def turn_odds(
    turn: Turn, changes: Mapping[str, float] | None = None, both: Pairs | None = None
) -> Odds:
    """What the records say at a turn, with what was added before it in view; as `odds`."""
    return beside(odds(turn.found, changes, both), turn.before)


def fitted_in_full(turn: Turn, known: Mapping[str, Refit]) -> tuple[Odds, dict[str, Refit]]:
    """Fit the few best effects in full, and then the likeliest until it is one that was fitted.

    - `known`: fits of the few best that were made before; mostly none.

    What a signature promises may vanish in the fit: then others come before it. A law that the
    likeliest contains, and that is behind it, is fitted again from there: it may be behind for no
    other reason than that its first fit ended in another place.
    """
    found = turn.found
    both, refits, again = pairs(found), dict(known), set()

    def fitted() -> dict[str, float]:
        return {name: one.log_bayes for name, one in refits.items() if not one.another}

    def no_effects() -> dict[str, float]:
        # What is no law of the effect speaks for it as little as for any other.
        return {n: -max(found.effects[n], 0.0) for n, one in refits.items() if one.another}

    def said() -> Odds:
        hidden = {UNNAMED: turn.hidden_pooled}  # fits are weighed by two likelihoods, so is this
        return turn_odds(turn, changed(found, fitted()) | no_effects() | hidden, both)

    if not known:
        names = _unlike(found, (), worth_refitting(said().evidence, found.effects))[:MOST]
        refits |= turn.refits(names)
        if turn.near is not None:
            alone = turn.near.found.effects
            more = _unlike(found, names, worth_refitting(alone, alone))[:NEAR]
            refits |= turn.refits(more, _best(refits), turn.near)
    for _ in range(MOST if refits else 0):
        evidence = said().evidence
        first = max(evidence, key=lambda name: evidence[name])
        if evidence[first] <= 0.0:
            break
        if first not in refits:
            refits |= turn.refits([first], _best(refits))
        elif refits[first].another:
            break
        elif more := unsure_twins(found, fitted(), first):
            refits |= turn.refits(more, _best(refits), twin=refits[first])
        elif more := [n for n in contained(refits, first) if n not in again]:
            again |= set(more)
            led = turn.refits(more, _best(refits), twin=refits[first])
            refits |= {n: max(refits[n], one, key=_worth) for n, one in led.items()}
        else:
            break
    return said(), refits


def _worth(one: Refit) -> tuple[bool, float]:
    """By what the better of two fits with an effect is told: one that is a law of it goes first."""
    return not one.another, one.log_bayes


def _unlike(found: Explained, before: Iterable[str], names: Iterable[str]) -> list[str]:
    """Those of some effects that have the signature of none before them in the list."""
    out: list[str] = []
    for name in names:
        if name in found.effects and not _twins(found, (*before, *out), name):
            out.append(name)
    return out


def unsure_twins(found: Explained, fitted: Mapping[str, float], name: str) -> list[str]:
    """Twins of an effect to fit in full: those that are less behind than a fit of it has changed.

    - `fitted`: the log Bayes factors of those that were, `name` among them.

    Signatures are of small amplitudes. By how much one twin is ahead of another they say as well as
    they have said what a fit in full brings.
    """
    change = abs(fitted[name] - found.effects[name])
    if change < UNSURE:
        return []
    behind = {n: found.effects[name] - found.effects[n] for n in found.alike(name)}
    twins = [n for n, by in behind.items() if n not in fitted and by < change]
    return sorted(twins, key=lambda n: behind[n])[: MOST - 1]


def _best(refits: Mapping[str, Refit]) -> Lead:
    """The lead of the best fit so far."""
    leads = (lead_of(name, one) for name, one in refits.items())
    return max(leads, key=lambda one: one.height, default=NO_LEAD)


def changed(found: Explained, fitted: Mapping[str, float]) -> dict[str, float]:
    """What fitting in full changed in the log Bayes factor of each effect and of its twins.

    - `fitted`: the log Bayes factors of those that were.
    """
    own = {name: log - found.effects[name] for name, log in fitted.items()}
    twins = {name: _twins(found, fitted, name) for name in found.effects}
    return {name: own[like[0]] for name, like in twins.items() if like} | own


def _twins(found: Explained, fitted: Iterable[str], name: str) -> list[str]:
    """Effects fitted in full whose signature is that of the effect `name`.

    Of such effects only the likeliest is fitted; what that changed holds for the others.
    """
    alike = found.alike(name)
    return [n for n in fitted if n in alike]

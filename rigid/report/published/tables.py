"""Findings as sentences and rows of text."""

import numpy as np

from rigid.plots.metrology import minus, superscript
from rigid.published.catalogue import CAUSES
from rigid.published.inference import OPENED, READINGS
from rigid.published.run import Findings, Told
from rigid.published.story import PRIOR_SETS
from rigid.report.published.output import REFERENCE, factors
from rigid.spec import Spec

Table = tuple[str, tuple[str, ...], tuple[tuple[str, ...], ...]]
"""Heading, heads, rows."""

WORDS = {
    "mu": "μ",
    "inverse_M_root": "mass of the root plate per cylinder",
    "pitch_ratio": "(ρ/d)²",
    "pitch_lever": "e/d",
    "mu_branch[1]": "μ₁",
    "mu_branch[2]": "μ₂",
    "tau_branch[1]": "τ₁",
    "tau_branch[2]": "τ₂",
    "L_rod": "oil column of the rod side",
    "toe_ratio": "k_LC at 6 kN over k_LC",
    "mu_slow": "μ of slow motion",
    "F_C": "force",
    "F_return": "force",
    "R_hose": "resistance",
}
UNITS = {"1": "", "1/kg": "kg", "Pa s/m^3": "Pa s/m³"}
"""As shown; a number per kg is shown as a mass."""

BROKEN = {"small", "locked"}
"""Stories that the summary names apart from the others."""

PUBLISHED = 3.7e3  # N s/m; paper, eq. (17)


def in_short(found: Findings, spec: Spec) -> tuple[str, ...]:
    """The findings in a few sentences, every number of them computed."""
    published = spec.published
    assert published is not None
    own = found.told[PRIOR_SETS[0], REFERENCE].draws["mu"]
    middle = float(np.median(own))
    return (
        f"If one constant μ on a fixed root made the release, it is {three(own)} N s/m: "
        f"{middle / PUBLISHED:.0f} times eq. (17), and {published.mu_A.value / middle:.0f} and "
        f"{published.mu_B.value / middle:.0f} times less than the two values of eq. (18).",
        f"ln B of a small μ and of a locked plunger: {_gaps(found, BROKEN)}. All other hypotheses, "
        f"with any μ: {_gaps(found, _others(found))}.",
        "ln B of free running by the friction of the release against the best other cause, under "
        f"one constant μ: {_by_prior(found, _same_gap)}. The other causes lie within "
        f"{_by_prior(found, _cause_gap)} of each other.",
    )


def _others(found: Findings) -> set[str]:
    return {t.story.key for t in found.of(PRIOR_SETS[0])} - BROKEN


def _gaps(found: Findings, keys: set[str]) -> str:
    values = [v for p in PRIOR_SETS for k, (v, _) in factors(found, p).items() if k in keys]
    return minus(f"{min(values):.1f} to {max(values):.1f} under the two priors")


def _by_prior(found: Findings, of) -> str:
    return minus(" and ".join(f"{of(found.told[p, REFERENCE]):.1f} ({p})" for p in PRIOR_SETS))


def _same_gap(told: Told) -> float:
    return told.pairs["same"].log - max(e.log for k, e in told.pairs.items() if k != "same")


def _cause_gap(told: Told) -> float:
    logs = [e.log for k, e in told.pairs.items() if k != "same"]
    return max(logs) - min(logs)


def needs(told: Told) -> tuple[str, ...]:
    """The story's own numbers, median and 90 %."""
    return tuple(_number(q.label, told.draws[q.label], q.unit) for q in told.story.quantities)


def cause_needs(number: int, told: Told) -> tuple[str, ...]:
    """The common number of a cause, where it has one and draws of it."""
    cause, common = CAUSES[number], told.common[told.cause == number]
    if not cause.parameter or not len(common):
        return ()
    return (_number(cause.parameter, common, cause.unit),)


def _number(label: str, values: np.ndarray, unit: str) -> str:
    shown = 1.0 / values if unit == "1/kg" else values
    return f"{WORDS[label]}: {three(shown)} {UNITS.get(unit, unit)}".strip()


def tables(found: Findings) -> tuple[Table, ...]:
    """Evidence by prior, by reading of the text, and of pairs with causes of free running."""
    made = [_evidence_table(found, prior) for prior in PRIOR_SETS]
    made += [_reading_table(found, prior) for prior in PRIOR_SETS]
    return (*made, *(_cause_table(found, prior) for prior in PRIOR_SETS))


def _evidence_table(found: Findings, prior: str) -> Table:
    against = factors(found, prior)
    heads = ("Hypothesis", "ln B", "± Monte Carlo", "μ [N s/m]", "period [ms]",
             "falls by e in [ms]", "least oil pressure [bar]", "oil above vacuum")  # fmt: skip
    rows = tuple(
        (
            t.story.title, minus(f"{against[t.story.key][0]:.2f}"),
            f"{against[t.story.key][1]:.2f}", kept(three(t.draws["mu"])),
            kept(ranged(t.draws["period"] * 1e3)), kept(ranged(t.draws["e_folding"] * 1e3)),
            kept(ranged(t.draws["p_least"] * 1e-5)), f"{t.held:.1%}",
        )
        for t in found.of(prior)
    )  # fmt: skip
    return f"Under the {prior} prior, against one constant μ (median, 90 %)", heads, rows


def _reading_table(found: Findings, prior: str) -> Table:
    base = found.told[prior, REFERENCE].readings
    rows = tuple(
        (t.story.title, *(_factor(t.readings[r].log - base[r].log) for r in READINGS))
        for t in found.of(prior)
    )
    return f"ln B by reading of the text, {prior} prior", ("Hypothesis", *READINGS), rows


def _factor(value: float) -> str:
    return minus(f"{value:.2f}") if value > 0.1 * OPENED else "none"


def _cause_table(found: Findings, prior: str) -> Table:
    heads = ("Hypothesis on the release", *(c.title for c in CAUSES))
    rows = tuple(
        (
            t.story.title,
            *(minus(f"{t.pairs[c.key].log - t.release.log:.2f}") for c in CAUSES),
        )
        for t in found.of(prior)
    )
    return f"ln density of both S p / v by cause, {prior} prior", heads, rows


def three(values: np.ndarray) -> str:
    """Median and 90 %, with three digits, large and small numbers by powers of ten."""
    low, middle, high = np.quantile(values, (0.05, 0.5, 0.95))
    power = int(np.floor(np.log10(abs(middle))))
    if -3 < power < 3:
        return minus(f"{middle:.3g} ({low:.3g} to {high:.3g})")
    low, middle, high = (x / 10.0**power for x in (low, middle, high))
    return minus(f"{middle:.2f} ({low:.2f} to {high:.2f})·10{superscript(str(power))}")


def ranged(values: np.ndarray) -> str:
    """Median and 90 %, with one digit after the point."""
    low, middle, high = np.quantile(values, (0.05, 0.5, 0.95))
    return minus(f"{middle:.1f} ({low:.1f} to {high:.1f})")


def kept(text: str) -> str:
    """The text in two lines at most: median, range."""
    return text.replace(" ", "\N{NO-BREAK SPACE}").replace("\N{NO-BREAK SPACE}(", " (")

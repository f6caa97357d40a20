"""What goes into a paper as it stands: methods and results in words, a table, references."""

import textwrap
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rigid.effects import AbstractEffect
from rigid.inference.calibrate import Calibrated
from rigid.inference.summary import Result
from rigid.io.files import write_text
from rigid.io.provenance import commit
from rigid.io.version import __version__
from rigid.kinds import KINDS
from rigid.plots import metrology
from rigid.report import wording
from rigid.report.content import Alternative, ForPaper, KeyNumber
from rigid.spec import Spec

WIDTH = 92
PAPER_KEY, SOFTWARE_KEY = "rig-paper", "rigid"
PRINTED_THERE = "paper, "
"""Begins the source of an effect that the paper of the rig prints."""
TITLE = (
    "On the influence of the hydraulic characteristics of the rig during full-scale compression "
    "and indentation tests on sea ice"
)
PLAIN = {
    "\\": r"\textbackslash{}", "{": r"\{", "}": r"\}", "&": r"\&", "%": r"\%", "$": r"\$",
    "#": r"\#", "_": r"\_", "^": r"\textasciicircum{}", "~": r"\textasciitilde{}",
    "\N{NO-BREAK SPACE}": "~", "\N{NARROW NO-BREAK SPACE}": r"\,", "\N{PLUS-MINUS SIGN}": r"$\pm$",
    "\N{MINUS SIGN}": "$-$", "\N{MULTIPLICATION SIGN}": r"$\times$", "\N{MIDDLE DOT}": r"$\cdot$",
    "\N{EN DASH}": "--", "\N{MICRO SIGN}": r"\textmu{}", "\N{GREEK SMALL LETTER MU}": r"$\mu$",
    "\N{GREEK SMALL LETTER KAPPA}": r"$\kappa$",
}  # fmt: skip
RAISED = dict(zip("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789", strict=True))


def latex(text: str) -> str:
    """Text as LaTeX sets it: nothing of it is a command."""
    out, raised = [], ""
    for sign in f"{text}\0":
        if sign in RAISED:
            raised += RAISED[sign]
            continue
        if raised:
            out.append(f"$^{{{raised}}}$")
            raised = ""
        out.append(PLAIN.get(sign, sign))
    return "".join(out).removesuffix("\0")


def for_paper(
    spec: Spec,
    done: Calibrated,
    found: Result,
    numbers: Sequence[KeyNumber],
    choices: Sequence[Alternative],
) -> ForPaper:
    """Gather all of it from a run's own numbers."""
    return ForPaper(
        methods=methods(spec, done, found),
        results=results(spec, found, numbers, choices),
        latex=table(spec, numbers),
        bibtex=references(done.problem.effects),
    )


def methods(spec: Spec, done: Calibrated, found: Result) -> str:
    """How it was done, in one paragraph."""
    counted = Counter(KINDS[record.kind].name for record in done.records)
    kinds = wording.listed([f"{n} {kind}" for kind, n in counted.items()])
    ensembles, steps, walkers, size = done.draws.z.shape
    readings = sum(int(np.isfinite(c.data).sum()) for c in done.shown)
    effects = wording.listed([name.replace("-", " ") for name in spec.model.effects])
    rows = [row.summary for row in found.parameters]
    r_hat = max((s.r_hat for s in rows if s.r_hat is not None), default=None)
    ess = min((s.ess_bulk for s in rows if s.ess_bulk is not None), default=None)
    version = f"rigid {__version__}" + (f" (commit {commit()})" if commit() else "")
    invented = " The records are simulated; no rig was measured." if spec.simulated else ""
    if done.draws.weighed:
        drawn = ensembles * steps * walkers
        sampled_by = (
            f"The posterior was sampled by {drawn} weighted draws in {ensembles} independent lots"
        )
    else:
        sampled_by = (
            f"The posterior was sampled by {ensembles} independent ensembles of {walkers} walkers "
            f"({steps} steps kept after {done.draws.warmup} of warm-up)"
        )
    sentences = [
        f"The {size} uncertain parameters of the rig were identified jointly from "
        f"{len(done.records)} records ({kinds}; {readings} samples in all) with {version}.",
        f"The model consists of {effects}.",
        "Gains and zeros of the sensors were integrated out; rounding by the converter and the "
        "autocorrelation of the noise are part of the likelihood.",
        f"{sampled_by}; the largest R-hat between them is {metrology.ratio(r_hat, 3)} and the "
        f"least effective sample size is {metrology.ratio(ess, 0)}.",
    ]
    if done.solver is not None:
        sentences.append(f"Checked against a full numerical solution: {done.solver.says}.")
    return " ".join(sentences) + invented


def results(
    spec: Spec, found: Result, numbers: Sequence[KeyNumber], choices: Sequence[Alternative]
) -> str:
    """What came out, in one paragraph."""
    told = []
    for number in numbers:
        ends = "" if number.range else f" (90 % credible interval {_interval(number)})"
        told.append(f"{number.label}: {wording.main_form(number)}{ends}")
    usable = "" if found.usable else "The result must not be used as it stands. "
    gap = (
        f"One-step-ahead residuals are {metrology.ratio(found.gap.overall)} times the noise that "
        "the sensors' sheets state."
    )
    kept = [
        f"No record settles this: with {c.label}, k_LC would be "
        f"{metrology.median_and_interval((c.q05, c.median, c.q95), c.unit)}."
        for c in choices
        if not c.used
    ]
    invented = ["These are results of simulated records."] if spec.simulated else []
    return usable + " ".join([f"The posterior gives {'; '.join(told)}.", gap, *kept, *invented])


def _interval(number: KeyNumber) -> str:
    return metrology.interval(number.q05, number.q95, number.unit)


def table(spec: Spec, numbers: Sequence[KeyNumber]) -> str:
    """A LaTeX table of the key numbers, with no package but LaTeX's own."""
    rows = []
    for number in numbers:
        ends = "--" if number.range else latex(_interval(number))
        symbol = f"${number.symbol}$" if number.symbol else ""
        value = latex(wording.main_form(number))
        rows.append(f"    {latex(number.label)} & {symbol} & {value} & {ends} \\\\")
    said = " Simulated records." if spec.simulated else ""
    body = "\n".join(rows)
    return f"""\\begin{{table}}
  \\caption{{{latex(spec.title or spec.path.stem)}: posterior median and standard deviation.{said}}}
  \\begin{{tabular}}{{llrr}}
    \\hline
    Quantity & Symbol & Value & 90\\,\\% interval \\\\
    \\hline
{body}
    \\hline
  \\end{{tabular}}
\\end{{table}}
"""


def references(effects: Sequence[type[AbstractEffect]]) -> str:
    """BibTeX of this software, of the paper of the rig, and of the sources of the effects."""
    version = f"{__version__}" + (f", commit {commit()}" if commit() else "")
    entries = [
        _entry(
            "misc",
            SOFTWARE_KEY,
            author="{The rigid contributors}",
            title="{rigid}: {Bayesian} parameter identification for hydraulic test rigs",
            note=f"Software, version {version}, Apache License 2.0",
        ),
    ]
    listed = [(e.name.replace("-", " "), e.source) for e in effects]
    printed = [(name, source) for name, source in listed if source.startswith(PRINTED_THERE)]
    if printed:
        equations = "; ".join(f"{name}: {s.removeprefix(PRINTED_THERE)}" for name, s in printed)
        said = latex(f"Equations of the rig. {equations}")
        # BibTeX passes over what stands outside of an entry.
        entries.append("Authors and year are to be added; this program does not have them.")
        entries.append(_entry("misc", PAPER_KEY, title=f"{{{TITLE}}}", note=said))
    entries += [
        _entry("misc", name.replace(" ", "-"), title=f"{{{name}}}", note=latex(f"Source: {source}"))
        for name, source in listed
        if (name, source) not in printed
    ]
    return "\n".join(entries)


def _entry(kind: str, key: str, **fields: str) -> str:
    lines = ",\n".join(f"  {name} = {{{value}}}" for name, value in fields.items())
    return f"@{kind}{{{key},\n{lines}\n}}\n"


def write_for_paper(paper: ForPaper | None, folder: Path) -> None:
    """Write `for-paper.txt`, `for-paper.tex` and `for-paper.bib` beside the page.

    Raises EnvironmentFaultError where the folder cannot be written.
    """
    if paper is None:
        return
    paragraphs = (textwrap.fill(text, WIDTH) + "\n" for text in (paper.methods, paper.results))
    write_text(folder / "for-paper.txt", "\n".join(paragraphs))
    write_text(folder / "for-paper.tex", paper.latex)
    write_text(folder / "for-paper.bib", paper.bibtex)

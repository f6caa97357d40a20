"""The page of the open world, from its rows: what breaks first, by population."""

from collections.abc import Mapping, Sequence

from rows import OneCode

Row = Mapping
HEAD = """\
# The open world: fits by population

Campaigns of the [second simulator](populations.md), which shares no code with the package nor with
its generator, fitted as `rigid.fit` does. All of it is simulated. Populations stand apart and are
never mixed. What discovery says of them: [by population](open_world_discovery.md).
"""
QUANTITIES = ("k_LC", "k_oil", "mu", "abs_mu[0.01 Hz]", "abs_mu[80 Hz]")


def page(code: OneCode, origin: str) -> str:
    """Write the page.

    - origin: where the seeds are from.
    """
    left = f" {sum(code.others.values())} rows of other commits are left out." * bool(code.others)
    made = f"`python tests/studies/open_world.py`, code of {code.commit}.{left}\n"
    parts = [HEAD, f"{origin}\n", made]
    if code.rows:
        parts += [_fits(code.rows), _channels(code.rows)]
    return "\n".join(parts)


def _by_population(rows: Sequence[Row]) -> dict[str, list[Row]]:
    ordered = sorted(rows, key=lambda row: row["case"]["number"])
    return {
        name: [row for row in ordered if row["case"]["population"] == name]
        for name in dict.fromkeys(row["case"]["population"] for row in ordered)
    }


def _away(entry: Row, factor: float = 1.0) -> float:
    """How far the median lies from the truth, in posterior sds."""
    return (entry["median"] - factor * entry["truth"]) / entry["sd"]


def _held(entry: Row, factor: float = 1.0) -> bool:
    return entry["q05"] <= factor * entry["truth"] <= entry["q95"]


def _kappas(row: Row) -> list[Row]:
    return [e for name, e in row["answer"]["parameters"].items() if name.startswith("kappa[")]


def _fits(fits: Sequence[Row]) -> str:
    lines = [
        "## Fits\n",
        "Beside each quantity: how many 90 % intervals hold the truth, and by how many posterior\n"
        "sds the median that is farthest lies from it. kappa counts every record; *kappa q* is\n"
        "the same with the truth's pump in place of the model's. *Gap*: least to greatest.\n"
        "*Starts*: of the search, for each fit.\n"
        "*Release*: greatest error of a release's time [ms].\n",
        "| population | fits | starts | usable | gap | k_LC | k_oil | mu | abs mu, 0 Hz "
        "| abs mu, 80 Hz | kappa | kappa q | release | failed checks |",
        "|---" * 14 + "|",
    ]
    for population, rows in _by_population(fits).items():
        good = [row for row in rows if "refused" not in row["answer"]]
        if not good:
            said = rows[0]["answer"]["refused"].splitlines()[0]
            lines.append(f"| {population} | 0 of {len(rows)} |" + " |" * 11 + f" refused: {said} |")
            continue
        answers = [row["answer"] for row in good]
        gaps = [answer["gap"] for answer in answers]
        cells = [population, f"{len(good)} of {len(rows)}"]
        cells.append(" ".join(str(row.get("starts", 16)) for row in good))
        cells += [f"{sum(a['usable'] for a in answers)}", f"{min(gaps):.3f}-{max(gaps):.3f}"]
        cells += [_cell([(a["parameters"][q], 1.0) for a in answers]) for q in QUANTITIES]
        cells.append(_cell([(e, 1.0) for row in good for e in _kappas(row)]))
        cells.append(_cell([(e, row["scale"]) for row in good for e in _kappas(row)]))
        late = [
            abs(e["median"] - e["truth"])
            for a in answers
            for name, e in a["parameters"].items()
            if name.startswith("release_time")
        ]
        cells.append(f"{1e3 * max(late):.2f}")
        failed = sorted({name for a in answers for name, ok, _ in a["checks"] if not ok})
        cells.append(", ".join(failed) or "none")
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _cell(entries: Sequence[tuple[Row, float]]) -> str:
    held = sum(_held(e, factor) for e, factor in entries)
    worst = max((_away(e, factor) for e, factor in entries), key=abs)
    return f"{held} of {len(entries)}, {worst:+.1f}"


def _channels(fits: Sequence[Row]) -> str:
    lines = [
        "## Where residuals are largest\n",
        "The channel with the greatest gap of each fit; *without*: its gap when its five largest\n"
        "residuals are left out; *largest*: size (in units of the sheet's noise) and time of the\n"
        "largest; *lag 1*: autocorrelation of residuals one step ahead.\n",
        "| population | seed | record | channel | gap | without | largest | lag 1 "
        "| strap lets go |",
        "|---" * 9 + "|",
    ]
    for population, rows in _by_population(fits).items():
        for row in rows:
            if "refused" in row["answer"]:
                continue
            c = max(row["answer"]["channels"], key=lambda channel: channel["gap"])
            at, size = c["largest"][0]
            straps = ", ".join(f"{1e3 * s[2]:.1f} ms" for s in row["straps"] if s[2]) or "at once"
            lines.append(
                f"| {population} | {row['case']['seed']} | {c['record']} | {c['quantity']} "
                f"| {c['gap']:.2f} | {c['without_largest']:.2f} | {size:+.1f} at {at:.4f} s "
                f"| {c['lag_1']:.2f} | {straps} |"
            )
    return "\n".join(lines) + "\n"

"""How often an ideal observer of the same records finds what is missing, and names it.

    python tests/studies/ideal_observer.py --campaigns 6 --out docs/studies/ideal_observer

The measure that power is held against. The observer knows the catalogue, all priors and the noise,
and is given a world in which all that the reckoning assumes is true: readings change in proportion
to amplitudes, laws are exact, noise is Gaussian, as loud and as slow as the fit found. There
the odds of `rigid.discovery.weighing` are the posterior, which no method can better on the whole.
It searches the same shapes, places and hidden things, and calls an alarm by the same rule.

Campaigns of the generator in which nothing is missing give the signatures. Of each effect a setting
is drawn among those that are screened; its amplitude is what makes it as strong as is asked; slopes
of all signatures are those of that plus noise. A line a campaign in OUT.K.jsonl, the page in
OUT.md; resumable. Effects whose frequency is searched (a line) are left out: of all the settings of
such a search the screening keeps the best alone.
"""

import argparse
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from discovery_bars import of, rightly, share, table
from discovery_cases import NAMES, Case, make
from discovery_page import STRENGTHS, answered
from rows import carry_out, lines_of, of_one_commit

if TYPE_CHECKING:
    from rigid.discovery.outcome import Outcome
    from rigid.discovery.weighing.explain import Explained

FIRST_SEED = 995_000
"""No other study has seeds from here on."""
DRAWS = 2
"""Of each effect and strength in each campaign."""
HEAD = """\
# What an ideal observer finds

The [benchmark of discovery](discovery.md) is held against this. The observer knows the catalogue,
all priors and the noise, and its world is the one that the reckoning assumes: readings change in
proportion to amplitudes, laws are exact, noise is Gaussian. There the odds are the posterior. It
searches the same shapes, places and hidden things as `rigid discover` does and calls an alarm by
the same rule, so that its false alarms are as many. Signatures are those of campaigns of the
generator; all of it is simulated. Effects with a line whose frequency is searched are left out.

`python tests/studies/ideal_observer.py --campaigns {campaigns}`, code of {commit} ({date}):
{draws} draws.
"""
BESIDE = """\
## Beside the benchmark

What `rigid discover` found of the same effects in the rows of `{command}`, code of {commits}, over
what the observer finds. There most causes have another form than the law, the fit is not a
parabola, and noise has to be told from what is missing.
"""


class Setting(NamedTuple):
    """One campaign, of which all draws are made at once."""

    number: int

    @property
    def seed(self) -> int:
        return FIRST_SEED + self.number


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--campaigns", type=int, default=6)
    parser.add_argument("--part", default="0/1", help="K/N: every N-th campaign from the K-th on")
    parser.add_argument("--table", action="store_true", help="write the page, run nothing")
    parser.add_argument("--rows", nargs="*", type=Path, default=[], help="of the benchmark")
    parser.add_argument("--out", type=Path, default=Path("docs/studies/ideal_observer"))
    return parser.parse_args()


def observed(setting: Setting) -> dict:
    """Everything an ideal observer says in the world of one campaign."""
    from rigid.study.study import load

    with tempfile.TemporaryDirectory() as folder:
        made = make(Case(0, "clean", first=setting.seed), Path(folder))
        outcome = load(made.spec).discover(seed=setting.seed, quiet=True).outcome
        return {"draws": list(drawn(outcome, setting.seed))}


def drawn(outcome: "Outcome", seed: int) -> Iterator[dict]:
    """Every effect at every strength, DRAWS times."""
    from rigid.discovery.weighing.explain import null_draws

    found = outcome.last
    rng = np.random.default_rng([seed, 20])
    noise = iter(null_draws(found.screening.information, seed + 500_000))
    lines = {one.effect.name for one in found.listed if one.chance}
    for name in (n for n in NAMES if n not in lines):
        mine = [i for i, one in enumerate(found.listed) if one.effect.name == name]
        mine = [i for i in mine if found.screening.information[i, i] > 0.0]
        for strength in STRENGTHS if mine else ():
            for _ in range(DRAWS):
                told = said(found, int(rng.choice(mine)), strength, next(noise))
                yield {"effect": name, "strength": strength} | told


def said(found: "Explained", number: int, strength: float, noise: np.ndarray) -> dict:
    """What the observer says of a candidate at a strength.

    - `number`: of the candidate. - `noise` (k,): slopes where nothing is missing.
    """
    from rigid.discovery.weighing.odds import odds
    from rigid.discovery.weighing.pairs import pairs
    from rigid.discovery.weighing.verdict import is_missing

    one, screening = found.listed[number], found.screening
    # The sign that its prior allows: that of the amplitude one prior sd up.
    sign = np.sign(one.departure(1.0)) or 1.0
    amplitude = sign * strength / screening.size[number]
    weighed = found.seen(noise + screening.information[:, number] * amplitude)
    told = odds(weighed, both=pairs(weighed))
    chances = dict(told.probability)
    alarm = is_missing(told.nothing, weighed.p_value)
    first = max(chances, key=lambda name: chances[name])
    return {
        "alarm": alarm,
        "p_value": weighed.p_value,
        "first": first,
        "probability": round(chances[first], 4),
        "right": first in weighed.alike(one.effect.name),
    }


def page(rows: Sequence[dict], campaigns: int, benchmark: Sequence[dict] = ()) -> str:
    """Write the page; rows of one commit.

    - `benchmark`: rows of `discovery.py`.
    """
    code = of_one_commit(rows)
    draws = [draw for row in code.rows for draw in row["draws"]]
    told = {"campaigns": campaigns, "commit": code.commit, "date": code.date[:10]}
    lines, sections = [], [HEAD.format(draws=len(draws), **told)]
    for strength in STRENGTHS:
        some = [d for d in draws if d["strength"] == strength]
        found = share(some, lambda d: d["alarm"])
        named = share(some, lambda d: d["alarm"] and d["right"])
        lines.append(f"| {strength:g} | {found} | {named} |")
    head = "| strength | found | | bounds | found, right name first | | bounds |"
    sections.append("## Power\n\n" + table(head, lines))
    names, few = list(dict.fromkeys(d["effect"] for d in draws)), (3.0, 5.0, 8.0)
    lines = []
    for name in names:
        mine = [[d for d in draws if d["effect"] == name and d["strength"] == s] for s in few]
        cells = [
            f"{sum(d['alarm'] for d in some)}, {sum(d['alarm'] and d['right'] for d in some)} "
            f"of {len(some)}"
            for some in mine
        ]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    head = "| effect | " + " | ".join(f"strength {s:g}: found, named" for s in few) + " |"
    sections.append("## By effect\n\n" + table(head, lines))
    if benchmark:
        sections.append(beside(draws, benchmark))
    return "\n".join(sections)


def beside(draws: Sequence[dict], benchmark: Sequence[dict]) -> str:
    """What discovery found of the same effects, over what the observer finds."""
    names = {d["effect"] for d in draws}
    singles = [r for r in answered(of(benchmark, "single")) if set(r["case"]["hide"]) <= names]
    lines = []
    for strength in STRENGTHS:
        ideal = [d for d in draws if d["strength"] == strength]
        real = [r for r in singles if r["case"]["strength"] == strength]
        found = [r for r in real if r["answer"]["verdict"] != "nothing-missing"]
        cells = [
            _ratio(len(found), len(real), sum(d["alarm"] for d in ideal), len(ideal)),
            _ratio(
                sum(map(rightly, found)),
                len(real),
                sum(d["alarm"] and d["right"] for d in ideal),
                len(ideal),
            ),
        ]
        lines.append(f"| {strength:g} | " + " | ".join(cells) + " |")
    firsts = {row["case"]["first"] for row in benchmark}
    told = {
        "command": "discovery.py --first-seed " + ", ".join(map(str, sorted(firsts))),
        "commits": ", ".join(sorted({row["commit"] for row in benchmark})),
    }
    head = "| strength | found | over the observer | right name first | over the observer |"
    return BESIDE.format(**told) + "\n" + table(head, lines)


def _ratio(count: int, total: int, ideal: int, draws: int) -> str:
    """Count, and its share over the observer's with a standard error; both binomial."""
    if not total or not ideal:
        return f"{count} of {total} | -"
    one, other = count / total, ideal / draws
    error = np.sqrt(
        one * (1.0 - one) / total / other**2 + one**2 * (1.0 - other) / draws / other**3
    )
    return f"{count} of {total} | {one / other:.2f} ± {error:.2f}"


def main() -> None:
    args = options()
    part, parts = (int(x) for x in args.part.split("/"))
    if not args.table:
        from rigid.io.runtime import prepare

        prepare()
        path = args.out.with_name(f"{args.out.name}.{part}.jsonl")
        mine = [Setting(n) for n in range(args.campaigns)][part::parts]
        carry_out(path, mine, lambda one: {"case": one._asdict()} | observed(one), summary)
    rows = lines_of(sorted(args.out.parent.glob(f"{args.out.name}.*.jsonl")))
    text = page(rows, args.campaigns, lines_of(args.rows))
    args.out.with_suffix(".md").write_text(text, encoding="utf-8")


def summary(row: dict) -> str:
    draws = row["draws"]
    return f"{sum(d['alarm'] for d in draws)} alarms of {len(draws)}"


if __name__ == "__main__":
    main()

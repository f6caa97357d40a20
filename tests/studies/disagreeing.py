"""Are the p-values of "where model and records disagree" right?

    python tests/studies/disagreeing.py --part 0/2

Simulates campaigns in which nothing is missing, clean and flawed, and some with one effect hidden,
runs discovery on each and looks for disagreements as the command does. Where nothing is missing,
the least p-value of a campaign should be below 0.05 in one of twenty. Writes OUT.K.jsonl, a line a
campaign, and OUT.md; resumable. Seeds are from FIRST_SEED on; no development used them. `--page`
writes the page alone.
"""

import argparse
import datetime
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from discovery import discovered
from discovery_bars import Row, of, share, table
from discovery_cases import NAMES, Case, make
from discovery_scores import NO_ANSWER
from rows import carry_out, lines_of

from rigid.generator.conditions import NULLS

FIRST_SEED, ORDER = 970_000, 2026
"""Of the campaigns; of the order in which they run, of which any beginning is a fair sample."""
CLEAN, OF_EACH, STRENGTH = 60, 10, 8.0
LEVELS = (0.01, 0.05, 0.1, 0.25, 0.5)
HEAD = """\
# Where model and records disagree: are the p-values right?

Simulated campaigns, by code that shares nothing with the model; discovery fits each and compares
its records with what is expected of them ([discovery.md](../../discovery.md)). Where nothing is
missing, the p-value that counts all that was looked at should be below 0.05 somewhere in a campaign
in one of twenty, below 0.5 in one of two. Bounds are one-sided, 95 %, after Clopper and Pearson.

`python tests/studies/disagreeing.py`, code of {commits}, {today}: {done} of {planned} campaigns,
seeds from {first}.
"""


class Campaign(Case):
    """A campaign with seeds of this study."""

    @property
    def seed(self) -> int:
        """One seed a campaign."""
        return FIRST_SEED + self.number


def campaigns() -> list[Campaign]:
    """List them: clean, flawed, and every effect once."""
    found = [Campaign(0, "clean") for _ in range(CLEAN)]
    found += [Campaign(0, "hard", condition=name) for name in NULLS for _ in range(OF_EACH)]
    found += [Campaign(0, "single", (name,), STRENGTH) for name in NAMES]
    return [case._replace(number=number) for number, case in enumerate(found)]


def one_campaign(case: Campaign) -> dict:
    """Make a campaign, run discovery on it, and keep what the comparison says."""
    from rigid.report.discovery.compared import compared

    row = {"case": case._asdict(), "seed": case.seed}
    with tempfile.TemporaryDirectory() as name:
        try:
            made = make(case, Path(name))
        except ValueError as error:
            return row | {"verdict": "unreachable", "says": str(error)}
        answer, outcome = discovered(made, case.seed)
        if outcome is None:
            return row | {"verdict": answer["verdict"], "says": answer.get("says")}
        found = compared(outcome, case.seed)
    first, after = found.before[0], found.after
    return row | {
        "verdict": answer["verdict"],
        "least": min(one.p_value for one in found.before),
        "least_after": None if after is None else min(one.p_value for one in after.values()),
        "alone": [round(one.alone, 4) for one in found.before],
        "surest": [first.record, first.quantity, first.over],
    }


def page(rows: Sequence[Row], planned: int) -> str:
    """Write the page."""
    looked = [row for row in rows if row["verdict"] not in NO_ANSWER]
    groups = {
        "clean": of(looked, "clean"),
        "flawed, all": of(looked, "hard"),
        **{
            name: [row for row in looked if row["case"]["condition"] == name] for name in NULLS
        },
    }  # fmt: skip
    head = HEAD.format(
        commits=", ".join(sorted({row["commit"] for row in rows})) or "no commit",
        today=datetime.datetime.now(datetime.UTC).date().isoformat(),
        done=len(rows),
        planned=planned,
        first=FIRST_SEED,
    )
    shares = [
        f"| {name} | {len(group)} | "
        + " | ".join(_count(group, lambda row, p=level: row["least"] <= p) for level in LEVELS)
        + " |"
        for name, group in groups.items()
    ]
    columns = " | ".join(f"below {level:g}" for level in LEVELS)
    nulls = [*groups["clean"], *groups["flawed, all"]]
    bounds = [
        f"| {title} | {share(group, lambda row: row['least'] <= 0.05)} |"
        for title, group in (("clean", groups["clean"]), ("flawed", groups["flawed, all"]))
    ]
    parts = [
        head,
        "## Least p-value of a campaign in which nothing is missing\n",
        table(f"| nothing is missing | campaigns | {columns} |", shares),
        table("| below 0.05 | campaigns | | bounds |", bounds),
        _alone(nulls),
        _hidden(of(looked, "single")),
        f"Not looked at: {len(rows) - len(looked)}, refused or not to be made so strong.\n",
    ]
    return "\n".join(parts)


def _count(rows: Sequence[Row], true: Callable[[Row], bool]) -> str:
    return f"{sum(map(true, rows))}" if rows else "-"


def _alone(rows: Sequence[Row]) -> str:
    if not rows:
        return "No campaign without a missing effect has been looked at yet.\n"
    alone = np.concatenate([row["alone"] for row in rows])
    told = ", ".join(f"{100 * np.mean(alone <= p):.1f} % below {p:g}" for p in LEVELS)
    return f"Of {len(alone)} comparisons in them, {told}, if nothing else had been looked at.\n"


def _hidden(rows: Sequence[Row]) -> str:
    added = [row for row in rows if row["least_after"] is not None]
    lines = [
        f"| as specified | {share(rows, lambda row: row['least'] <= 0.05)} |",
        f"| with what was added | {share(added, lambda row: row['least_after'] <= 0.05)} |",
    ]
    head = f"## With one effect hidden, strength {STRENGTH:g}\n\n"
    return head + table("| disagreement below 0.05 | campaigns | | bounds |", lines)


def options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--part", default="0/1", help="K/N: every N-th campaign from the K-th on")
    parser.add_argument("--out", type=Path, default=Path("docs/studies/discovery/disagreeing"))
    parser.add_argument("--page", action="store_true", help="write the page from what there is")
    return parser.parse_args()


def main() -> int:
    args = options()
    part, parts = (int(x) for x in args.part.split("/"))
    listed = campaigns()
    if not args.page:
        from rigid.io.runtime import prepare

        prepare()
        order = np.random.default_rng(ORDER).permutation(len(listed))
        carry_out(
            args.out.with_name(f"{args.out.name}.{part}.jsonl"),
            [listed[i] for i in order[part::parts]],
            one_campaign,
            lambda row: (row["verdict"], row.get("least"), row.get("surest")),
        )
    rows = lines_of(sorted(args.out.parent.glob(f"{args.out.name}.*.jsonl")))
    args.out.with_suffix(".md").write_text(page(rows, len(listed)), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())

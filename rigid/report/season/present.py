"""From batch.json to the terminal's table and to what the page shows."""

from collections.abc import Mapping
from typing import Any

from rigid.inference.drift import ALPHA, DIFFERS, DRIFTS, STEADY
from rigid.report.content import BAD, GOOD, Check, Front
from rigid.report.made import made_of
from rigid.report.season.output import FAILED, NOT_FITTED, USABLE
from rigid.report.season.section import SeasonContent

FIRST = ("k_LC", "mu", "abs_mu")
"""Quantities that come first, by the beginning of their labels."""
MOST_COLUMNS = 4
"""Quantities that the terminal shows."""


def chosen(made: Mapping[str, Any]) -> list[str]:
    """Labels by rank: what changes, then what people come for, then the rest."""

    def rank(item: tuple[str, Mapping[str, Any]]) -> tuple[bool, int]:
        label, one = item
        near = [n for n, name in enumerate(FIRST) if label.startswith(name)]
        return one["verdict"] == STEADY, near[0] if near else len(FIRST)

    return [label for label, _ in sorted(made["quantities"].items(), key=rank)]


def content(made: Mapping[str, Any]) -> SeasonContent:
    """Gather the section."""
    return SeasonContent(
        title=f"Campaigns of {made['folder']}",
        simulated=made["simulated"],
        front=front(made),
        provenance=made_of(made["folder"], "", None, (), cpu_s=made["cost"]["cpu_s"]),
        checks=tuple(_check(one) for one in made["campaigns"] if one["status"] != NOT_FITTED),
        found=made,
        ranked=tuple(chosen(made)),
        alpha=ALPHA,
    )


def front(made: Mapping[str, Any]) -> Front:
    """Question, verdict, which campaigns cannot be used, what to do."""
    bad = [one for one in made["campaigns"] if one["status"] not in (USABLE, NOT_FITTED)]
    return Front(
        asked=f"Are the fits of {made['folder']} usable, and does the rig stay the same?",
        state=GOOD if made["usable"] else BAD,
        ruling=ruling(made),
        why=tuple(f"{one['name']}: {'; '.join(one['why'])}" for one in bad),
        cannot=(
            "All fits share the priors of the rig. The tests for drift ignore that, so that small "
            "changes can be missed.",
        ),
        next=(*map(_mend, bad[:1]), *_ends(made)),
        figure="season",
    )


def _mend(one: Mapping[str, Any]) -> str:
    return f"Read the report of {one['name']}, or correct its spec, then run again with `--resume`."


def _ends(made: Mapping[str, Any]) -> tuple[str, ...]:
    """What shows where a change came from, if there is one."""
    usable = [one["name"] for one in made["campaigns"] if one["status"] == USABLE]
    changed = [k for k, v in made["quantities"].items() if v["verdict"] != STEADY]
    if not changed or len(usable) < 2:
        return ()
    first, last = usable[0], usable[-1]
    return (f"See what else moved: `rigid compare {first} {last}` in the folder of this page.",)


def _check(one: Mapping[str, Any]) -> Check:
    says = "; ".join(one["why"]) or "every check of its report holds"
    return Check(one["name"], one["status"] == USABLE, says)


def ruling(made: Mapping[str, Any]) -> str:
    """The verdict in sentences."""
    asked = [one for one in made["campaigns"] if one["status"] != NOT_FITTED]
    good = sum(one["status"] == USABLE for one in asked)
    failed = sum(one["status"] == FAILED for one in asked)
    first = f"{good} of {len(asked)} campaigns gave a usable result"
    first += f"; {failed} could not be fitted." if failed else "."
    drifting = [k for k, v in made["quantities"].items() if v["verdict"] == DRIFTS]
    differing = [k for k, v in made["quantities"].items() if v["verdict"] == DIFFERS]
    if drifting:
        first += f" Drifting over the season: {', '.join(drifting)}."
    if differing:
        first += f" Different between campaigns, without a trend: {', '.join(differing)}."
    if good > 1 and not (drifting or differing):
        first += " No quantity of the rig changes beyond its uncertainty."
    return first


def table(made: Mapping[str, Any]) -> str:
    """What the command prints."""
    columns = chosen(made)[:MOST_COLUMNS]
    wide = max(len("campaign"), *(len(one["name"]) for one in made["campaigns"])) + 2
    unit = {k: made["quantities"][k]["unit"] for k in columns}
    head = "".join(f"{f'{k} [{unit[k]}]':>28}" for k in columns)
    lines = [f"{'campaign':{wide}}{'status':12}{'gap':>7}{head}"]
    for one in made["campaigns"]:
        gap = f"{one['gap']:7.3f}" if one.get("gap") is not None else f"{'-':>7}"
        cells = "".join(_cell(one.get("parameters", {}).get(k)) for k in columns)
        lines.append(f"{one['name']:{wide}}{one['status']:12}{gap}{cells}")
        lines += [f"{'':{wide}}{why}" for why in one["why"]]
    note = "simulated data; " if made["simulated"] else ""
    return "\n".join([*lines, "", note + ruling(made)]) + "\n"


def _cell(found: Mapping[str, Any] | None) -> str:
    if found is None:
        return f"{'-':>28}"
    return f"{found['median']:>12.5g}{'':1}({found['q05']:.4g}-{found['q95']:.4g})".rjust(28)

"""result.json of the paper computed again, and the table on standard output."""

from typing import Any

from rigid.io.files import plain
from rigid.io.provenance import versions
from rigid.published.run import Findings
from rigid.published.walk.items import GIVEN
from rigid.published.walk.walk import Walk
from rigid.report.paper.content import check, counts
from rigid.report.published.output import as_dict
from rigid.spec import Spec


def result(spec: Spec, found: Walk, findings: Findings | None, wall: float) -> dict[str, Any]:
    """Gather result.json: the keys of a fit, and `items`.

    - `findings`: of the fit to the printed numbers; None: what it would give is empty.
    """
    made = _without_fit(spec, found, wall) if findings is None else as_dict(spec, findings, wall)
    made["checks"] = [check(found).values(), *made["checks"]]
    made["usable"] = all(one["ok"] for one in made["checks"])
    made["verdicts"] = counts(found)
    made["items"] = [item.values() for item in found.listed]
    return plain(made)


def _without_fit(spec: Spec, found: Walk, wall: float) -> dict[str, Any]:
    return {
        "schema": 1,
        "spec": spec.path.stem,
        "usable": True,
        "simulated": False,
        "checks": [],
        "parameters": {},
        "gap": {"overall": None, "records": {}},
        "cost": {"wall_s": wall, "failed_solves": 0},
        "seed": found.seed,
        "versions": versions(),
        "sha256": {},
    }


def table(found: Walk) -> str:
    """Text for standard output: what is computed beside the print, and how often which verdict."""
    lines = [f"{'place':42}{'what':58}{'printed':>14}{'computed':>14}  verdict"]
    for item in found.listed:
        if item.verdict == GIVEN:
            continue
        printed = "-" if item.printed is None else f"{item.printed:.5g}"
        place = item.place.replace("section ", "").replace("text ", "")
        told = item.verdict if item.explained else f"{item.verdict}, no reason is known"
        lines.append(
            f"{place[:40]:42}{item.what[:56]:58}{printed:>14}{item.computed:14.5g}  {told}"
        )
    lines.append(", ".join(f"{count} {verdict}" for verdict, count in counts(found).items()))
    return "\n".join(lines) + "\n"

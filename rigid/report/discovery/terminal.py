"""The result of discovery as a table for the terminal."""

from typing import Any

from rigid.plots.metrology import chance
from rigid.report.discovery.compared import channel_of, place_of


def table(made: dict[str, Any]) -> str:
    """Lines for standard output; `made` is what goes to discovery.json.

    Below the verdict stand the disagreements between model and records that are beyond chance, or
    the one that comes nearest to it.
    """
    lines = [f"verdict: {made['verdict']}"]
    for one in made["disagreements"]:
        lines.append(
            f"   {channel_of(one)} over {one['over']}, {place_of(one)}: p {chance(one['p_value'])}"
        )
    for number, step in enumerate(made["steps"], start=1):
        where = step["where"]
        lines.append(
            f"{number}. {step['effect'] or 'no effect of the catalogue'} "
            f"(probability {chance(step['probability'], 2)}); shows in {where['record']},"
            f"{where['cylinder']} {where['channel']}; equation {where['equation']}"
        )
        for other in step["alternatives"]:
            lines.append(f"   or {other['effect']} (probability {chance(other['probability'], 2)})")
        for one in step["refused"]:
            lines.append(f"   {one['effect']} is not named: {one['why']}")
        for label, found in step["parameters"].items():
            lines.append(
                f"   {label} = {found['median']:.4g} ({found['q05']:.4g} to {found['q95']:.4g}) "
                f"{found['unit']}"
            )
        if step["gap"]:
            g = step["gap"]
            lines.append(
                f"   gap {g['before']:.4f} -> {g['after']:.4f}; left out {g['held_out_before']:.4f}"
                f" -> {g['held_out_after']:.4f}; elpd {g['elpd_difference']:+.1f} "
                f"(se {g['elpd_se']:.1f})"
            )
        if step["next_record"]:
            lines.append(f"   next record: {step['next_record']}")
        if step["spec"]:
            lines.append(f"   spec with it: {step['spec']}")
    lines.append(f"gap: {made['gap']['initial']:.4f} -> {made['gap']['final']:.4f}")
    return "\n".join(lines) + "\n"

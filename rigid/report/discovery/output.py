"""discovery.json of the contract, and the spec with what was found in it."""

import dataclasses
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rigid.discovery.outcome import Judged, Outcome, Step
from rigid.discovery.refit import Refit
from rigid.discovery.turn import Absorption
from rigid.discovery.weighing.explain import NOTHING, UNNAMED, Explained
from rigid.discovery.workflow import LIKELY
from rigid.io.files import finite
from rigid.likelihood.effect_lookup import effects_named, name_in_specs
from rigid.likelihood.listing import MOTION_CONSTANTS, given_priors
from rigid.likelihood.priors import AbstractPrior
from rigid.localfit.hypothesis import Hypothesis
from rigid.localfit.leave_one_out import gap
from rigid.localfit.samples import aside_of
from rigid.report.noise_found import noise_found
from rigid.report.taken import taken
from rigid.spec import Spec

SCHEMA = 1
SPEC_NAME = "extended.toml"
RULED_OUT = -20.0
"""Log Bayes factor below which an effect is out of the question."""


def added_labels(hypothesis: Hypothesis, name: str) -> list[str]:
    """Labels of what an added effect brought in."""
    effect = next(e for e in hypothesis.added if e.name == name)
    return [label for label in effect.labels() if label in hypothesis.labels]


def quoted(hypothesis: Hypothesis) -> list[str]:
    """Labels of numbers that a user would quote: of the effects, and every record's flow.

    Of a measured motion its mass and its area as well: what is missing may have moved them.
    """
    problem = hypothesis.problem
    names = {label for effect in problem.effects for label in effect.labels()}
    body = () if problem.of_the_rig else MOTION_CONSTANTS
    asked = {*names, "kappa", *body}
    return [p.label for p in hypothesis.parameters if p.label in names or p.base in asked]


def as_dict(spec: Spec, outcome: Outcome, extended: Path | None) -> dict[str, Any]:
    """What goes to discovery.json."""
    layout = outcome.base.layout
    return {
        "schema": SCHEMA,
        "verdict": outcome.verdict,
        "simulated": spec.simulated,
        "p_value": finite((outcome.steps[0].explained if outcome.steps else outcome.last).p_value),
        "probabilities": outcome.steps[0].probability
        if outcome.steps
        else outcome.last_probability,
        "steps": [
            _step(spec, step, extended) | {"other_form": _other_form(outcome, step)}
            for step in outcome.steps
        ],
        "gap": {
            "initial": finite(gap(outcome.base)),
            "final": finite(gap(outcome.final)),
            "floor": 1.0,
        },
        "rejected": rejected(outcome),
        "noise": noise_found(outcome.final),
        **taken(spec, layout.problem, aside_of(layout), outcome.final.hypothesis.added),
    }


def _step(spec: Spec, step: Step, extended: Path | None) -> dict[str, Any]:
    where = step.place
    out: dict[str, Any] = {
        "where": {
            "record": where.record,
            "cylinder": where.cylinder,
            "channel": where.channel,
            "time_s": list(where.time_s) if where.time_s else None,
            "frequency_Hz": list(where.frequency_Hz) if where.frequency_Hz else None,
            "equation": spec.model.equation(step.equation),
        },
        "effect": step.chosen,
        "probability": finite(step.probability[step.chosen or UNNAMED]),
        "alternatives": alternatives(step),
        "refused": [{"effect": name, "why": why} for name, why in step.refused.items()],
        "absorbed": step.absorbed is not None,
    }
    if step.came_in is None or step.judged is None:
        return out | {
            "parameters": {}, "moved": {}, "gap": None, "next_record": None, "spec": None
        }  # fmt: skip
    path = None if extended is None or step.chosen is None else str(extended)
    return out | _added(step, step.came_in, step.judged) | {"spec": path}


def _other_form(outcome: Outcome, step: Step) -> dict[str, Any] | None:
    """Whether the records want the effect of a step in another form, and over what."""
    one = outcome.forms.get(step.chosen or "")
    return None if one is None else {"over": one.over, "log_bayes": finite(one.log_bayes)}


def _added(step: Step, one: Refit | Absorption, judged: Judged) -> dict[str, Any]:
    """What a step brought in, what it moved, and the gap before and after."""
    difference, error = judged.elpd
    brought = [] if step.chosen is None else added_labels(one.after.hypothesis, step.chosen)
    return {
        "parameters": {label: one.after.interval(label) for label in brought},
        "moved": {
            label: {
                "before": one.before.interval(label)["median"],
                "after": one.after.interval(label)["median"],
            }
            for label in quoted(one.before.hypothesis)
        },
        "gap": {
            "before": judged.gap[0],
            "after": judged.gap[1],
            "held_out_before": judged.held_out_gap[0],
            "held_out_after": judged.held_out_gap[1],
            "elpd_difference": difference,
            "elpd_se": error,
        },
        "next_record": step.next_record,
    }


def alternatives(step: Step) -> list[dict[str, Any]]:
    """Other explanations of a step that keep some probability, the likeliest first."""
    rest = {
        k: v
        for k, v in step.probability.items()
        if k not in (NOTHING, UNNAMED, step.chosen) and v > LIKELY
    }
    return [
        {"effect": name, "probability": rest[name]} for name in sorted(rest, key=lambda k: -rest[k])
    ]


def rejected(outcome: Outcome) -> list[dict[str, str]]:
    """Every effect that was not kept, and why."""
    chosen = {step.chosen for step in outcome.steps}
    first = outcome.steps[0].explained if outcome.steps else outcome.last
    steps = outcome.steps
    told = {a["effect"] for step in steps for a in alternatives(step)}
    return [
        {"effect": name, "why": _why(first, name, steps[0] if steps else None)}
        for name in first.effects
        if name not in chosen | told
    ]


def _why(found: Explained, name: str, step: Step | None) -> str:
    number = found.best_of(name)
    strength = float(found.screening.strength[number])
    one = found.listed[number]
    sides = np.sign(np.asarray(one.prior.from_standard(np.array([-3.0, 3.0]))) - one.absent)
    if abs(strength) > 3.0 and np.all(sides == -np.sign(strength)):
        return f"the records ask for a sign that physics forbids (strength {strength:+.1f})"
    if found.effects[name] < RULED_OUT:
        return f"would be seen if it were there: strength {strength:+.1f} is all that shows"
    if step is None or found.effects[name] < 0.0:
        return (
            f"explains nothing: strength {strength:+.1f}, log Bayes factor "
            f"{found.effects[name]:.1f} against its absence"
        )
    best = step.chosen or "something hidden"
    if name in step.refits and (ahead := step.refits[name].ahead):
        return f"explains far less than {ahead}: its fit was given up before its optimum"
    if name in step.refits and (another := step.refits[name].another):
        return f"explains what it does as another law only: {another}"
    logs = step.refits[name].log_bayes if name in step.refits else found.effects[name]
    return f"explains less than {best}: log Bayes factor {logs:.1f} against its absence"


def extended_spec(spec: Spec, outcome: Outcome, folder: Path) -> str:
    """Text of the spec with the effects that were found, its files named from `folder`.

    Everything else stays as it was written, comments included.
    """
    text = spec.text.removeprefix("\ufeff")
    laws = {k: v for k, v in outcome.final.hypothesis.given.items() if k not in given_priors(spec)}
    if spec.machine is not None:
        for effect in outcome.final.hypothesis.added:
            text = at_joint(text, effect.place, name_in_specs(effect, folder))
        return _with_files(with_laws(text, laws), spec, folder)
    given = effects_named(spec.model.effects, spec.path.parent, f"{spec.path} [model] effects")
    every = (*given, *outcome.final.hypothesis.added)
    listed = "".join(f'    "{name_in_specs(effect, folder)}",\n' for effect in every)
    effects = f"effects = [\n{listed}]"
    only = {k: v for k, v in outcome.final.hypothesis.only.items() if k not in spec.model.only}
    if re.search(r"(?m)^effects\s*=\s*\[[^\]]*\]", text):
        text = re.sub(r"(?m)^effects\s*=\s*\[[^\]]*\]", lambda _: effects, text, count=1)
    elif re.search(r"(?m)^\[model\]\s*$", text):
        text = re.sub(r"(?m)^\[model\]\s*$", lambda _: f"[model]\n{effects}", text, count=1)
    else:
        text = f"[model]\n{effects}\n\n{text}" if text.startswith("[") else _headed(text, effects)
    if only:
        pairs = ", ".join(f'{k} = "{v}"' for k, v in {**spec.model.only, **only}.items())
        text = re.sub(r"(?m)^only\s*=.*\n", "", text)
        text = text.replace(effects, f"{effects}\nonly = {{ {pairs} }}", 1)
    return _with_files(with_laws(text, laws), spec, folder)


def at_joint(text: str, joint: str, name: str) -> str:
    """Add an effect to those of a joint of a machine, in the joint's own table.

    Where the joint stands in the table of another, a comment at the end says what to add.
    """
    word = re.escape(joint)
    head = re.search(rf'(?m)^\[\s*machine\s*\.\s*joints\s*\.\s*"?{word}"?\s*\].*\n', text)
    if head is None:
        return f'{text.rstrip()}\n\n# Add "{name}" to the effects of joint {joint}.\n'
    end = re.compile(r"(?m)^\s*\[").search(text, head.end())
    stop = len(text) if end is None else end.start()
    block = text[head.end() : stop]
    listed = re.search(r"(?m)^effects\s*=\s*\[(?P<names>[^\]]*)\]", block)
    if listed is None:
        block = f'effects = ["{name}"]\n{block}'
    else:
        names = listed["names"].rstrip().rstrip(",")
        more = f"{names}, " if names.strip() else ""
        block = f'{block[: listed.start()]}effects = [{more}"{name}"]{block[listed.end() :]}'
    return text[: head.end()] + block + text[stop:]


def with_laws(text: str, laws: Mapping[str, AbstractPrior]) -> str:
    """Put priors of what was added into a spec, by label."""
    if not laws:
        return text
    lines = "".join(
        f'"{label}" = {{ {law.name} = {{ '
        + ", ".join(f"{f.name} = {float(getattr(law, f.name))!r}" for f in dataclasses.fields(law))
        + " } }\n"
        for label, law in laws.items()
    )
    header = re.search(r"(?m)^\[\s*priors\s*\].*\n", text)
    if header:
        return text[: header.end()] + lines + text[header.end() :]
    return f"{text.rstrip()}\n\n[priors]\n{lines}"


def _headed(text: str, effects: str) -> str:
    """Put a table of the model before the first table of a spec."""
    at = re.search(r"(?m)^\[", text)
    cut = at.start() if at else len(text)
    return f"{text[:cut]}[model]\n{effects}\n\n{text[cut:]}"


def _with_files(text: str, spec: Spec, folder: Path) -> str:
    """Name the records' files from another folder."""
    here = spec.path.resolve().parent

    def moved(match: re.Match[str]) -> str:
        path = (here / match["name"]).resolve()
        return f'{match["key"]}"{Path(_relative(path, folder.resolve())).as_posix()}"'

    return re.sub(r'(?m)^(?P<key>\s*(?:file|posterior)\s*=\s*)"(?P<name>[^"]+)"', moved, text)


def _relative(path: Path, folder: Path) -> str:
    import os.path

    return os.path.relpath(path, folder)

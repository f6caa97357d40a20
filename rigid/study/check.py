"""What a spec and its records would make a fit do, without running it."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from rigid.inference.demand import demand
from rigid.io.files import finite
from rigid.jobs.memory import available
from rigid.likelihood.parameters import Parameter
from rigid.likelihood.problem import Problem, walkers
from rigid.physics.sensors import UNITS
from rigid.records.record import Record
from rigid.smoothing.reading import read_fields
from rigid.spec import Spec
from rigid.study.result import CommandResult

SCHEMA = 1
RULES = ("starts", "ensembles", "block", "max_steps", "r_hat", "ess")
BYTES = 8
"""Of a number in the chain."""

NORMAL_Q95 = 1.6448536269514722
"""95 % quantile of the standard normal."""


@dataclass(frozen=True, eq=False)
class Checked(CommandResult):
    """A spec and its records, read and put together.

    - `spec`; `records`: as read; `problem`: None for a spec of published numbers or of field
      records alone.
    """

    spec: Spec
    records: tuple[Record, ...]
    problem: Problem | None

    @cached_property
    def result(self) -> Mapping[str, Any]:
        """All that `table` says, for programs."""
        return {
            "schema": SCHEMA,
            "spec": self.spec.path.stem,
            "simulated": self.spec.simulated,
            "effects": list(self.spec.model.effects),
            "records": [_record(one) for one in self.records],
            "field_records": self._fields(),
            "parameters": [] if self.problem is None else _parameters(self.problem),
            "sampler": None if self.problem is None else self._sampler(self.problem),
            "why_solver": self.spec.why_solver or None,
        }

    def table(self) -> str:
        """Return what the command prints."""
        found = self.result
        lines = [f"effects: {', '.join(found['effects'])}", ""]
        if self.spec.published is not None:
            lines[0] = "numbers that a paper prints; no record is fitted"
        for one in found["records"]:
            channels = ", ".join(f"{c['quantity']} ({c['samples']})" for c in one["channels"])
            lines.append(
                f"{one['record'] + ',' + one['cylinder']:24}{one['kind']:10}"
                f"{one['duration_s']:10.4g} s{one['rate_Hz']:10.4g} Hz  {channels}"
            )
            lines += [f"    {note}" for note in one["notes"]]
        sought = "field" if self.spec.machine is None else "test"
        lines += [f"{name:24}{sought}; for bands" for name in found["field_records"]]
        wide = max([30, *(len(one["name"]) for one in found["parameters"])]) + 2
        if found["parameters"]:
            head = f"{'unit':10}{'prior':18}{'5 %':>12}{'median':>12}{'95 %':>12}"
            lines += ["", f"{'parameter':{wide}}{head}"]
        for one in found["parameters"]:
            figures = "".join(f"{one[key]:12.5g}" for key in ("q05", "median", "q95"))
            lines.append(f"{one['name']:{wide}}{one['unit']:10}{one['prior']:18}{figures}")
        if found["sampler"] is not None:
            told = found["sampler"]
            says = [_sentence(told), told["takes"], self.spec.why_solver]
            lines += ["", *filter(None, says)]
        return "\n".join(lines) + "\n"

    def _fields(self) -> list[str]:
        """Names of the field records that bands would be made of; each is read."""
        if self.spec.bands is None:
            return []
        return [test[0].name for test in read_fields(self.spec)]

    def _sampler(self, problem: Problem) -> dict[str, Any]:
        """How wide the sampler is, and what its chain takes on disk at most."""
        rule, size = self.spec.sampler, problem.parameters.size
        wide = rule.walkers or walkers(problem)
        step = rule.ensembles * wide * (size + 1) * BYTES
        takes = demand(problem, rule)
        return {
            "parameters": size,
            "samples": int(sum(np.count_nonzero(np.asarray(p.weight)) for p in problem.pieces)),
            **{name: getattr(rule, name) for name in RULES},
            "walkers": wide,
            "chain_bytes_per_block": step * rule.block,
            "chain_bytes_at_most": step * rule.max_steps,
            "takes": takes.says,
            "memory_bytes": takes.memory,
            "memory_free_bytes": available(),
            "seconds": takes.seconds,
        }


def _record(one: Record) -> dict[str, Any]:
    return {
        "record": one.name,
        "cylinder": one.cylinder,
        "kind": one.kind,
        "file": one.path.name,
        "sha256": one.sha256,
        "duration_s": float(one.time[-1] - one.time[0]),
        "rate_Hz": 1.0 / one.interval,
        "channels": [
            {
                "quantity": quantity,
                "unit": UNITS.get(quantity, "m"),
                "column": channel.column,
                "samples": int(np.count_nonzero(channel.valid)),
            }
            for quantity, channel in one.channels.items()
        ],
        "notes": list(one.notes),
    }


def _parameters(problem: Problem) -> list[dict[str, Any]]:
    """Every number of the model with its prior; those that are exact have one value."""
    listed = problem.parameters
    return [_prior(p, p.prior.name) for p in listed.sampled] + [
        _prior(p, "exact") for p in listed.known
    ]


def _prior(p: Parameter, prior: str) -> dict[str, Any]:
    ends = np.array([-NORMAL_Q95, 0.0, NORMAL_Q95])
    low, middle, high = sorted(float(v) for v in np.broadcast_to(p.prior.from_standard(ends), (3,)))
    figures = {"q05": finite(low), "median": finite(middle), "q95": finite(high)}
    return {"name": p.label, "unit": p.unit, "symbol": p.symbol, "prior": prior, **figures}


def _sentence(told: Mapping[str, Any]) -> str:
    block, most = (told[f"chain_bytes_{key}"] / 2**20 for key in ("per_block", "at_most"))
    return (
        f"a fit would search from {told['starts']} starts, and sample {told['parameters']} "
        f"parameters against {told['samples']} samples with {told['ensembles']} ensembles of "
        f"{told['walkers']} walkers until R-hat is below {told['r_hat']:g} and the effective "
        f"sample size {told['ess']:g}, for {told['max_steps']} steps at most; the chain takes "
        f"{block:.3g} MiB for every {told['block']} steps, {most:.4g} MiB at most"
    )

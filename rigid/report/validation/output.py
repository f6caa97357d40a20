"""validation.json: every test and check of a validation."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from rigid.io.files import finite
from rigid.spec import Spec
from rigid.validation.agreement import Agreement
from rigid.validation.misfit import Effect
from rigid.validation.tested import Tested
from rigid.validation.verdict import Verdict

SCHEMA = 1


def as_dict(
    spec: Spec, found: Verdict, beside: Agreement | None, misfits: Sequence[Effect]
) -> dict[str, Any]:
    """What goes to validation.json."""
    return {
        "schema": SCHEMA,
        "spec": spec.path.stem,
        "simulated": True,
        "usable": found.usable,
        "checks": [check.values() for check in found.checks],
        "design": asdict(found.design),
        "replicates": found.replicates,
        "unreliable": found.unreliable,
        "failed": found.failed,
        "refused_draws": found.refused,
        "quantities": {one.name: _tested(one) for one in found.tested},
        "slopes": None if found.slopes is None else asdict(found.slopes),
        "together": [asdict(one) for one in found.held],
        "fast_beside_full": None if beside is None else asdict(beside) | {"ok": beside.ok},
        "discovery": None if found.alarms is None else asdict(found.alarms),
        "misfit": [_effect(one) for one in misfits],
        "cpu_s": finite(round(found.cpu_s, 1)),
        "seed": found.design.seed,
    }


def _tested(one: Tested) -> dict[str, Any]:
    return {
        "n": len(one.ranks),
        "p": finite(one.p),
        "p_adjusted": finite(one.adjusted),
        "ok": one.ok,
        "says": one.says,
        "gained": finite(one.gained),
        "coverage": [
            {key: getattr(share, key) for key in ("level", "share", "low", "high", "p")}
            for share in one.coverage
        ],
    }


def _effect(one: Effect) -> dict[str, Any]:
    return {
        "constant": one.constant,
        "by": one.by,
        "parameter": one.parameter,
        "n": one.coverage.n,
        "share_90": one.coverage.share,
        "low": one.coverage.low,
        "high": one.coverage.high,
        "error": finite(one.error),
        "expected": finite(one.expected),
    }

"""How often discovery finds something missing from campaigns from which nothing is."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rigid.inference.summary import FALSE_ALARMS, Check
from rigid.validation.coverage import CONFIDENCE, clopper_pearson

NOTHING = "nothing-missing"


@dataclass(frozen=True)
class Alarms:
    """What discovery said of clean campaigns.

    - `campaigns`: that it came to an end with; `failed`: others. - `count`: false alarms.
    - `low`, `high`: Clopper-Pearson band of their rate. - `blamed`: alarms by what was blamed.
    - `cpu_s`: CPU time of all.
    """

    campaigns: int
    failed: int
    count: int
    low: float
    high: float
    blamed: Mapping[str, int]
    cpu_s: float

    @property
    def says(self) -> str:
        """What was found, in a sentence."""
        failed = f"; {self.failed} more campaigns failed" if self.failed else ""
        if not self.campaigns:
            return f"discovery came to no end with any campaign{failed}"
        listed = ", ".join(f"{name} {n}" for name, n in self.blamed.items())
        blamed = f", blamed on {listed}" if listed else ""
        return (
            f"discovery raised {self.count} false alarm{'' if self.count == 1 else 's'} in "
            f"{self.campaigns} clean campaigns{blamed}: a rate of "
            f"{100 * self.count / self.campaigns:.2g} %, with {CONFIDENCE:.0%} confidence from "
            f"{100 * self.low:.2g} to {100 * self.high:.2g} %{failed}"
        ).replace("% confidence", " % confidence")

    @property
    def check(self) -> Check:
        """Whether the rate can be the one that discovery is made for."""
        if not self.campaigns:
            return Check("alarms", False, f"{self.says}; look at the rows")
        if self.low <= FALSE_ALARMS:
            return Check("alarms", True, self.says)
        return Check(
            "alarms",
            False,
            f"{self.says}, more than the {100 * FALSE_ALARMS:g} % that it is made for; do not take "
            "what it names from this spec's records for missing",
        )


def alarms(rows: Sequence[Mapping[str, Any]]) -> Alarms:
    """Count the alarms of a study.

    - `rows`: as `rigid.jobs.run.run` gives them; values have `verdict` and `blamed`.
    """
    done = [row["value"] for row in rows if row["failed"] is None]
    raised = [value for value in done if value["verdict"] != NOTHING]
    low, high = clopper_pearson(len(raised), len(done))
    return Alarms(
        campaigns=len(done),
        failed=len(rows) - len(done),
        count=len(raised),
        low=low,
        high=high,
        blamed=dict(Counter(value["blamed"] or value["verdict"] for value in raised).most_common()),
        cpu_s=math.fsum(row["cost"]["cpu_s"] or 0.0 for row in rows),
    )

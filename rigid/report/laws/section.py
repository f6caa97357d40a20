"""The section on friction models: what it is on the page, and its content."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from rigid.report.content import Content
from rigid.report.laws import figures
from rigid.report.section import Kind

KIND = Kind("laws", 40, "Laws of friction", "laws.html.j2", figures)


@dataclass(frozen=True, eq=False)
class LawShown:
    """One law against the first.

    - `name`. - `evidence` (variants,): difference of log evidence, priors as stated first.
    - `difference`, `error` (records,): of the log predictive density of each left-out record.
    """

    name: str
    evidence: Float[np.ndarray, " variants"]
    difference: Float[np.ndarray, " records"]
    error: Float[np.ndarray, " records"]


@dataclass(frozen=True, eq=False, kw_only=True)
class LawsContent(Content):
    """The section, complete; every difference is to the first law.

    - `notes`: sentences. - `laws`: (name, log evidence, its error, probability, log predictive
      density, its error, tied). - `priors`: what is done to the amplitudes' priors.
    - `chances`: (name, probability under each). - `parameters`: (law, name, unit, q05, median,
      q95). - `shown`, `records`: for the figure.
    """

    notes: tuple[str, ...]
    laws: tuple[tuple[str, float, float, float, float, float, bool], ...]
    priors: tuple[str, ...]
    chances: tuple[tuple[str, tuple[float, ...]], ...]
    parameters: tuple[tuple[str, str, str, float, float, float], ...]
    shown: tuple[LawShown, ...]
    records: tuple[str, ...]

"""Parts of sums among the parameters: numbers of which records tell the sum better than the parts.

The friction at rest of a friction with memory is such a sum, mu(0) = mu_inf + sum mu_i. Effects say
which of their parameters are parts of one.
"""

from collections.abc import Iterator

from rigid.likelihood.parameters import Parameter
from rigid.likelihood.priors import Lognormal
from rigid.likelihood.problem import Problem


def sums_of(problem: Problem) -> Iterator[tuple[str, list[Parameter]]]:
    """Yield every sum's name and its parts, those that are sampled, positive and lognormal.

    A part that varies by kind of record is one of several sums and stays as it is.
    """
    part_of = {
        label: info.part_of
        for effect in problem.effects
        for info in effect.parameters()
        if info.part_of is not None
        for label in info.labels
    }
    for total in dict.fromkeys(part_of.values()):
        parts = [
            p
            for p in problem.parameters.sampled
            if part_of.get(p.label) == total
            and isinstance(p.prior, Lognormal)
            and float(p.prior.median) > 0.0
        ]
        if len(parts) > 1:
            yield total, parts

"""A fit with the programs that simulate what could be added to it."""

import dataclasses
from collections.abc import Iterable

from rigid.effects import AbstractEffect
from rigid.localfit.families import Family, narrow
from rigid.localfit.local import LocalFit


@dataclasses.dataclass(frozen=True)
class Fitted:
    """What every step of a discovery starts from.

    - `local`: the fit. - `programs`: of all candidates and of the hidden forces and flows.
    """

    local: LocalFit
    programs: tuple[Family, ...]

    def program(self, effects: Iterable[type[AbstractEffect]]) -> Family:
        """Return the program in which a fit with some effects costs least."""
        return narrow(self.programs, self.local.layout.problem, effects)

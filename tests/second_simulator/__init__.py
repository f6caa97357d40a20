"""A second simulator of calibration campaigns, which shares no code with rigid or its generator.

Its states are the mass of the oil and the momenta of both bodies, pressure follows from an equation
of state, SciPy's Radau integrates with dense output, and the sensors are an analogue chain. What
rigid and its own generator have in common by habit does not hold here.
"""

from .campaign import campaign
from .populations import POPULATIONS, Population

__all__ = ["POPULATIONS", "Population", "campaign"]

"""Simulated calibration campaigns, made by other code than the model that is fitted to them.

Nothing here imports the rest of `rigid` and nothing of it imports this: another formulation of
the friction, another integrator, the equations written down a second time. What agrees between
the two is then not a shared mistake.
"""

from rigid.generator.campaign import campaign
from rigid.generator.conditions import Conditions
from rigid.generator.core import Action, Motion, Piece
from rigid.generator.draw import Truth, draw

__all__ = [
    "Action",
    "Conditions",
    "Motion",
    "Piece",
    "Truth",
    "campaign",
    "draw",
]

"""Whether a test begins where the smoother takes it to begin."""

import numpy as np

from rigid.io.errors import InputError
from rigid.smoothing.field import Field
from rigid.spec.sheets import SensorsSpec

MOST_OFF = 6.0
"""Standard deviations of noise and zero beyond which the start is not at rest."""


def require_at_rest(field: Field, sensors: SensorsSpec, where: str) -> None:
    """Refuse a test whose first sample is not that of a machine at rest; a valve may be open then.

    - `sensors`: their sheets. - `where`: heads the message, before the cylinder or the joint.
    """
    for i in field.setup.read:
        one, begin = field.setup.channels[i], field.reading[0, i]
        sheet = sensors[one.quantity]
        spread = float(np.hypot(sheet.noise + sheet.step, sheet.zero_sd))
        if field.known[0, i] and abs(begin) > MOST_OFF * spread:
            raise InputError(
                f"{where} {one.place}, begins with a {one.quantity} of {begin:.4g} (SI); it must "
                "begin at rest and out of load, cut with `rows` where it does"
            )

"""The paper's rig as a spec states it: its constants, each with what is not known of it."""

from typing import Annotated, Literal

from rigid.spec.base import POSITIVE, Known, Value, uncertain, within

YOUNG = 200e9  # Pa; paper, after eq. (16)
BEAM_AREA = (0.13 + 2 * 0.06) * 0.006  # m^2; S_B = (b + 2 w) h, eq. (15), "Calibration experiments"
FRAME_LENGTH = 2.1  # m; L_f, same place
FRAME_SHARE = 0.03  # sd; table of uncertainties
BEAMS = {"two-per-cylinder": 2, "two-shared": 1}
"""Beams that carry one cylinder's load: the factor 2 of eq. (15), or half of it if both cylinders
press on the same two beams."""


MASS_SHARE, OIL_SHARE, COLUMN_SHARE = 0.03, 0.05, 0.02
"""Relative sds where a spec states none; docs/spec.md, table of uncertainties."""


def _relative(value: float, share: float) -> Known:
    return Known(value=value, sd=share * value)


class RigSpec(Value):
    """Constants of the rig; masses [kg], area [m^2], moduli and pressures [Pa], lengths [m].

    Defaults: paper, eq. (1), and L_0 of the modal analysis; uncertainties as documented in
    docs/spec.md.
    """

    M_HC: Annotated[Known, uncertain(MASS_SHARE), POSITIVE, within(1e-3, 1e6, "kg")] = _relative(
        60.0, MASS_SHARE
    )
    M_Pl: Annotated[Known, uncertain(MASS_SHARE), POSITIVE, within(1e-3, 1e6, "kg")] = _relative(
        10.0, MASS_SHARE
    )
    M_Fl: Annotated[Known, uncertain(MASS_SHARE), POSITIVE, within(1e-3, 1e6, "kg")] = _relative(
        200.0, MASS_SHARE
    )
    S_Pl: Annotated[Known, uncertain(0.0), POSITIVE, within(1e-8, 10.0, "m^2")] = Known(
        value=44.2e-4
    )
    k_oil: Annotated[Known, uncertain(OIL_SHARE), POSITIVE, within(1e5, 1e12, "Pa")] = _relative(
        2e9, OIL_SHARE
    )
    L_0: Annotated[Known, uncertain(COLUMN_SHARE), POSITIVE, within(1e-4, 100.0, "m")] = _relative(
        0.20, COLUMN_SHARE
    )
    p_max: Annotated[Known, uncertain(0.0), POSITIVE, within(1e3, 1e11, "Pa")] = Known(value=700e5)
    k_frame: Annotated[Known, uncertain(FRAME_SHARE), POSITIVE, within(1.0, 1e14, "N/m")] | None = (
        None
    )
    frame_beams: Literal["two-per-cylinder", "two-shared"] = "two-per-cylinder"

    @property
    def frame_stiffness(self) -> Known:
        """Stiffness of the calibration frame against one cylinder [N/m], from eq. (15)."""
        if self.k_frame is not None:
            return self.k_frame
        beams = BEAMS[self.frame_beams]
        return _relative(beams * YOUNG * BEAM_AREA / FRAME_LENGTH, FRAME_SHARE)

    @property
    def known(self) -> dict[str, Known]:
        """All constants by their symbol."""
        names = ("M_HC", "M_Pl", "M_Fl", "S_Pl", "k_oil", "L_0", "p_max")
        return {name: getattr(self, name) for name in names} | {"k_frame": self.frame_stiffness}

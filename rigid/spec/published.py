"""Numbers that a paper prints, as the input of a fit: each with what its printing allows."""

from typing import Annotated

from pydantic import Field

from rigid.spec.base import Real, Value

Positive = Annotated[Real, Field(gt=0.0)]


class Printed(Value):
    """A printed number.

    - `value`: as printed, SI. - `half_width`: half of the stretch that is rounded to it.
    - `sd`: of reading it off a record before it was rounded.
    - `place`: in the paper. - `why`: half_width and sd are what they are.
    """

    value: Positive
    half_width: Positive
    sd: Positive
    place: str
    why: str


class PublishedSpec(Value):
    """What a paper publishes of a rig without its records.

    - `frame_load` [N] at `frame_stroke` [m], the offset taken off; `preload` [N] of the release.
    - `release_period` [s], `release_duration` [s], `release_oscillations` [1].
    - `mu_A`, `mu_B` [N s/m]: S p / v in free running.
    - `kappa_A`, `kappa_B` [1]: flow fractions of another test, from which speeds are borrowed.
    """

    frame_load: Positive
    preload: Positive
    frame_stroke: Printed
    release_period: Printed
    release_duration: Printed
    release_oscillations: Printed
    mu_A: Printed
    mu_B: Printed
    kappa_A: Printed
    kappa_B: Printed

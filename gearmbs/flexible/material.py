"""Elastic materials of shafts, beams and meshes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from gearmbs.dae.problem import ModelError
from gearmbs.schema.described import Described
from gearmbs.schema.quantities import Measure
from gearmbs.units import Quantity, doubt_of_material
from gearmbs.wording import warn

# The error of everything that describes, reads or reduces a body that deforms.


class FlexibleError(ModelError):
    """A flexible body, its file or its reduction is wrong; the message names place, value and remedy."""


MOST_SHEAR = 0.52
"""Shear modulus over Young's: 1/2 at a Poisson's ratio of zero, and what sources round."""


@dataclass(frozen=True)
class ElasticMaterial(Described):
    """An isotropic elastic material.

    Parameters
    ----------
    youngs_modulus, density : float or str
        Pa and kg/m^3, or text with a unit.
    poisson_ratio : float
        Between 0 and 0.5.
    shear_modulus : float or str, optional
        Pa; default E / (2 (1 + nu)). Give it to follow a source that rounds it.
    name : str

    Raises
    ------
    FlexibleError
        For values that no material has.

    Warns
    -----
    UserWarning
        For a modulus or density that no solid has: other units are meant (`gearmbs.units.doubt_of_material`).
    """

    error: ClassVar[type[ValueError]] = FlexibleError

    youngs_modulus: Annotated[Quantity, Measure("pressure", above=0)] = 2.1e11
    poisson_ratio: Annotated[Quantity, Measure(low=0, below=0.5)] = 0.3
    density: Annotated[Quantity, Measure("density", 0)] = 7850.0
    shear_modulus: Annotated[Quantity, Measure("pressure", above=0)] = None
    name: str = "steel"

    def __post_init__(self) -> None:
        super().__post_init__()
        e = self.youngs_modulus
        doubt = doubt_of_material(e, self.density)
        if doubt:
            warn(f"ElasticMaterial '{self.name}': {doubt}")
        if self.shear_modulus is None:
            object.__setattr__(self, "shear_modulus", e / (2.0 * (1.0 + self.poisson_ratio)))
        if self.shear_modulus > MOST_SHEAR * e:
            warn(
                f"ElasticMaterial '{self.name}': shear_modulus is {self.shear_modulus:.4g} Pa beside E = {e:.4g} Pa; "
                "of an isotropic material it is at most E / 2",
            )


STEEL = ElasticMaterial()
"""2.1e11 Pa, 0.3, 7850 kg/m^3."""

# Modal damping: one number, a number for each mode, bands of frequency.


Damping = float | str | Sequence[float] | Sequence[tuple[float, float]]
"""Types that `damping_ratios` takes."""

ADAMS = ((100.0, 0.01), (1000.0, 0.1), (np.inf, 1.0))
"""Bands that ADAMS assumes where nothing is given: 1 % below 100 Hz, 10 % below 1000 Hz, critical above."""


def damping_ratios(frequencies: np.ndarray, damping: Damping) -> np.ndarray:
    """Return the damping ratio of each mode.

    Parameters
    ----------
    frequencies : ndarray, shape (n,)
        Hz.
    damping : float, sequence of float, sequence of (float, float), or "adams"
        One ratio for all modes; one for each; pairs of a frequency (Hz) and the ratio of the modes below it, in rising
        order, the last also for those above; or the bands that ADAMS assumes (`ADAMS`). Interface shapes at many kHz
        hold the step of an integrator down unless they are damped: bands are made for that.

    Raises
    ------
    FlexibleError
        For negative ratios, bands that do not rise, and a wrong number of values.
    """
    frequencies = np.asarray(frequencies, dtype=float)
    if isinstance(damping, str):
        if damping != "adams":
            raise FlexibleError(f"damping = {damping!r}; give a ratio, one for each mode, bands or 'adams'")
        damping = ADAMS
    given = np.asarray(damping, dtype=float)
    if given.ndim == 2 and given.shape[1] == 2:
        limits, values = given.T
        if np.any(np.diff(limits) <= 0.0):
            raise FlexibleError(f"damping: the limits {limits.tolist()} Hz must rise")
        out = values[np.minimum(np.searchsorted(limits, frequencies, side="right"), limits.size - 1)]
    elif given.ndim == 0:
        out = np.full(frequencies.shape, float(given))
    elif given.shape == frequencies.shape:
        out = given.copy()
    else:
        raise FlexibleError(f"damping: {given.size} values for {frequencies.size} modes; give one, one each, or pairs")
    if not np.all(np.isfinite(out) & (out >= 0.0)):
        raise FlexibleError(f"damping: ratios {out[~(out >= 0.0)].tolist()}; give 0 or more")
    return out

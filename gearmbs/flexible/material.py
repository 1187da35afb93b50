"""Elastic materials of shafts, beams and meshes."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from gearmbs._shown import Written
from gearmbs.flexible.errors import FlexibleError
from gearmbs.mechanism.quantities import quantity
from gearmbs.units import Quantity, doubt_of_material

MOST_SHEAR = 0.52
"""Shear modulus over Young's: 1/2 at a Poisson's ratio of zero, and what sources round."""


@dataclass(frozen=True)
class ElasticMaterial(Written):
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

    youngs_modulus: Quantity = 2.1e11
    poisson_ratio: float = 0.3
    density: Quantity = 7850.0
    shear_modulus: Quantity = None
    name: str = "steel"

    def __post_init__(self) -> None:
        e = quantity(self.youngs_modulus, "Pa", "ElasticMaterial.youngs_modulus")
        rho = quantity(self.density, "kg/m^3", "ElasticMaterial.density")
        if not (np.isfinite(e) and e > 0.0):
            raise FlexibleError(f"ElasticMaterial.youngs_modulus is {e} Pa; it must be positive")
        if not (np.isfinite(rho) and rho >= 0.0):
            raise FlexibleError(f"ElasticMaterial.density is {rho} kg/m^3; it must not be negative")
        ratio = quantity(self.poisson_ratio, "dimensionless", "ElasticMaterial.poisson_ratio")
        if not 0.0 <= ratio < 0.5:
            raise FlexibleError(f"ElasticMaterial.poisson_ratio is {ratio}; give 0 up to 0.5")
        doubt = doubt_of_material(e, rho)
        if doubt:
            warnings.warn(f"ElasticMaterial '{self.name}': {doubt}", stacklevel=3)
        g = self.shear_modulus
        g = e / (2.0 * (1.0 + self.poisson_ratio)) if g is None else quantity(g, "Pa", "ElasticMaterial.shear_modulus")
        if not (np.isfinite(g) and g > 0.0):
            raise FlexibleError(f"ElasticMaterial.shear_modulus is {g} Pa; it must be positive")
        if g > MOST_SHEAR * e:
            warnings.warn(
                f"ElasticMaterial '{self.name}': shear_modulus is {g:.4g} Pa beside E = {e:.4g} Pa; of an isotropic "
                "material it is at most E / 2",
                stacklevel=3,
            )
        for field, value in (("youngs_modulus", e), ("poisson_ratio", ratio), ("density", rho), ("shear_modulus", g)):
            object.__setattr__(self, field, value)


STEEL = ElasticMaterial()
"""2.1e11 Pa, 0.3, 7850 kg/m^3."""

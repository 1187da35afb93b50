"""Bodies that deform: shafts by sections, finite-element models, their reduction, beams of large motion."""

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.flexible.beam import BeamSection, shear_coefficient
    from gearmbs.flexible.damping import damping_ratios
    from gearmbs.flexible.errors import FlexibleError
    from gearmbs.flexible.fe_model import FiniteElementModel, MassProperties
    from gearmbs.flexible.interfaces import Interface
    from gearmbs.flexible.material import ElasticMaterial
    from gearmbs.flexible.modal_model import ModalModel, Seat
    from gearmbs.flexible.reduction import reduce_model
    from gearmbs.flexible.rotor import Campbell, Rotor, Support, UnbalanceResponse, WhirlModes
    from gearmbs.flexible.shaft import Disc, Shaft, ShaftSection

_HOMES = {
    "BeamSection": ".beam",
    "Campbell": ".rotor",
    "Disc": ".shaft",
    "ElasticMaterial": ".material",
    "FiniteElementModel": ".fe_model",
    "FlexibleError": ".errors",
    "Interface": ".interfaces",
    "MassProperties": ".fe_model",
    "ModalModel": ".modal_model",
    "Rotor": ".rotor",
    "Seat": ".modal_model",
    "Shaft": ".shaft",
    "ShaftSection": ".shaft",
    "Support": ".rotor",
    "UnbalanceResponse": ".rotor",
    "WhirlModes": ".rotor",
    "damping_ratios": ".damping",
    "reduce_model": ".reduction",
    "shear_coefficient": ".beam",
}

__all__ = [
    "BeamSection",
    "Campbell",
    "Disc",
    "ElasticMaterial",
    "FiniteElementModel",
    "FlexibleError",
    "Interface",
    "MassProperties",
    "ModalModel",
    "Rotor",
    "Seat",
    "Shaft",
    "ShaftSection",
    "Support",
    "UnbalanceResponse",
    "WhirlModes",
    "damping_ratios",
    "reduce_model",
    "shear_coefficient",
]

late(__name__, _HOMES)

"""Bodies that deform: shafts by sections, finite-element models, their reduction, beams of large motion."""

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.flexible.ansys import read_ansys
    from gearmbs.flexible.beam import BeamSection, shear_coefficient
    from gearmbs.flexible.bodies import box_housing, planet_carrier, thin_rimmed_wheel
    from gearmbs.flexible.check import ModelReport, check_model
    from gearmbs.flexible.damping import damping_ratios
    from gearmbs.flexible.errors import FlexibleError
    from gearmbs.flexible.fe_model import FiniteElementModel, MassProperties
    from gearmbs.flexible.interfaces import Interface
    from gearmbs.flexible.large_beam import BeamChain, LargeBeam, add_beam
    from gearmbs.flexible.material import ElasticMaterial
    from gearmbs.flexible.matrices import from_matrices, read_abaqus, read_calculix
    from gearmbs.flexible.matrix_text import read_nodes
    from gearmbs.flexible.mnf import mnf_of, read_mnf, write_mnf
    from gearmbs.flexible.mnf_content import ModalNeutralFile
    from gearmbs.flexible.modal_model import ModalModel
    from gearmbs.flexible.nastran import read_op2, read_op4
    from gearmbs.flexible.nastran_modes import read_op2_modes
    from gearmbs.flexible.nastran_stress import read_op2_stresses
    from gearmbs.flexible.reduction import reduce_model
    from gearmbs.flexible.reduction_check import ReductionReport, check_reduction
    from gearmbs.flexible.rotor import Campbell, Rotor, Support, UnbalanceResponse, WhirlModes
    from gearmbs.flexible.seats import Seat
    from gearmbs.flexible.shaft import Disc, Shaft, ShaftSection
    from gearmbs.flexible.solid import block_mesh, nodes_where, ring_mesh, solid_model
    from gearmbs.flexible.stress import StressModes
    from gearmbs.flexible.surface import BodySurface

__all__ = [
    "BeamChain",
    "BeamSection",
    "BodySurface",
    "Campbell",
    "Disc",
    "ElasticMaterial",
    "FiniteElementModel",
    "FlexibleError",
    "Interface",
    "LargeBeam",
    "MassProperties",
    "ModalModel",
    "ModalNeutralFile",
    "ModelReport",
    "ReductionReport",
    "Rotor",
    "Seat",
    "Shaft",
    "ShaftSection",
    "StressModes",
    "Support",
    "UnbalanceResponse",
    "WhirlModes",
    "add_beam",
    "block_mesh",
    "box_housing",
    "check_model",
    "check_reduction",
    "damping_ratios",
    "from_matrices",
    "mnf_of",
    "nodes_where",
    "planet_carrier",
    "read_abaqus",
    "read_ansys",
    "read_calculix",
    "read_mnf",
    "read_nodes",
    "read_op2",
    "read_op2_modes",
    "read_op2_stresses",
    "read_op4",
    "reduce_model",
    "ring_mesh",
    "shear_coefficient",
    "solid_model",
    "thin_rimmed_wheel",
    "write_mnf",
]

late(
    __name__,
    {
        "BeamChain": ".large_beam",
        "BeamSection": ".beam",
        "BodySurface": ".surface",
        "Campbell": ".rotor",
        "Disc": ".shaft",
        "ElasticMaterial": ".material",
        "FiniteElementModel": ".fe_model",
        "FlexibleError": ".errors",
        "Interface": ".interfaces",
        "LargeBeam": ".large_beam",
        "MassProperties": ".fe_model",
        "ModalModel": ".modal_model",
        "ModalNeutralFile": ".mnf_content",
        "ModelReport": ".check",
        "ReductionReport": ".reduction_check",
        "Rotor": ".rotor",
        "Seat": ".seats",
        "Shaft": ".shaft",
        "ShaftSection": ".shaft",
        "StressModes": ".stress",
        "Support": ".rotor",
        "UnbalanceResponse": ".rotor",
        "WhirlModes": ".rotor",
        "add_beam": ".large_beam",
        "block_mesh": ".solid",
        "box_housing": ".bodies",
        "check_model": ".check",
        "check_reduction": ".reduction_check",
        "damping_ratios": ".damping",
        "from_matrices": ".matrices",
        "mnf_of": ".mnf",
        "nodes_where": ".solid",
        "planet_carrier": ".bodies",
        "read_abaqus": ".matrices",
        "read_ansys": ".ansys",
        "read_calculix": ".matrices",
        "read_mnf": ".mnf",
        "read_nodes": ".matrix_text",
        "read_op2": ".nastran",
        "read_op2_modes": ".nastran_modes",
        "read_op2_stresses": ".nastran_stress",
        "read_op4": ".nastran",
        "reduce_model": ".reduction",
        "ring_mesh": ".solid",
        "shear_coefficient": ".beam",
        "solid_model": ".solid",
        "thin_rimmed_wheel": ".bodies",
        "write_mnf": ".mnf",
    },
)

"""Bodies that deform: shafts by sections, finite-element models, their reduction, beams of large motion."""

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.flexible.beam import BeamSection, shear_coefficient
    from gearmbs.flexible.check import ModelReport, ReductionReport, check_model, check_reduction
    from gearmbs.flexible.fe_model import FiniteElementModel, MassProperties
    from gearmbs.flexible.files.ansys import read_ansys
    from gearmbs.flexible.files.matrices import from_matrices, read_abaqus, read_calculix, read_nodes
    from gearmbs.flexible.files.mnf import ModalNeutralFile, mnf_of, read_mnf, write_mnf
    from gearmbs.flexible.files.nastran import read_op2, read_op4
    from gearmbs.flexible.files.nastran_modes import read_op2_modes, read_op2_stresses
    from gearmbs.flexible.interfaces import BodySurface, Interface
    from gearmbs.flexible.large_beam import BeamChain, LargeBeam, add_beam
    from gearmbs.flexible.material import ElasticMaterial, FlexibleError, damping_ratios
    from gearmbs.flexible.modal_model import ModalModel, Seat
    from gearmbs.flexible.reduction import reduce_model
    from gearmbs.flexible.rotor import Campbell, Rotor, Support, UnbalanceResponse, WhirlModes
    from gearmbs.flexible.shaft import Disc, Shaft, ShaftSection
    from gearmbs.flexible.solid import (
        block_mesh,
        box_housing,
        nodes_where,
        planet_carrier,
        ring_mesh,
        solid_model,
        thin_rimmed_wheel,
    )
    from gearmbs.flexible.stress import StressModes

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
        "BodySurface": ".interfaces",
        "Campbell": ".rotor",
        "Disc": ".shaft",
        "ElasticMaterial": ".material",
        "FiniteElementModel": ".fe_model",
        "FlexibleError": ".material",
        "Interface": ".interfaces",
        "LargeBeam": ".large_beam",
        "MassProperties": ".fe_model",
        "ModalModel": ".modal_model",
        "ModalNeutralFile": ".files.mnf",
        "ModelReport": ".check",
        "ReductionReport": ".check",
        "Rotor": ".rotor",
        "Seat": ".modal_model",
        "Shaft": ".shaft",
        "ShaftSection": ".shaft",
        "StressModes": ".stress",
        "Support": ".rotor",
        "UnbalanceResponse": ".rotor",
        "WhirlModes": ".rotor",
        "add_beam": ".large_beam",
        "block_mesh": ".solid",
        "box_housing": ".solid",
        "check_model": ".check",
        "check_reduction": ".check",
        "damping_ratios": ".material",
        "from_matrices": ".files.matrices",
        "mnf_of": ".files.mnf",
        "nodes_where": ".solid",
        "planet_carrier": ".solid",
        "read_abaqus": ".files.matrices",
        "read_ansys": ".files.ansys",
        "read_calculix": ".files.matrices",
        "read_mnf": ".files.mnf",
        "read_nodes": ".files.matrices",
        "read_op2": ".files.nastran",
        "read_op2_modes": ".files.nastran_modes",
        "read_op2_stresses": ".files.nastran_modes",
        "read_op4": ".files.nastran",
        "reduce_model": ".reduction",
        "ring_mesh": ".solid",
        "shear_coefficient": ".beam",
        "solid_model": ".solid",
        "thin_rimmed_wheel": ".solid",
        "write_mnf": ".files.mnf",
    },
)

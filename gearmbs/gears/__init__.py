"""Wheels and pairs: geometry, mass, placement in space, faults, and analyses that need no dynamics."""

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.gears import faults
    from gearmbs.gears.contact_element import GearContact
    from gearmbs.gears.contact_model import ContactLaw, ContactModel, FlankFriction
    from gearmbs.gears.geometry import PairGeometry, Placement
    from gearmbs.gears.ideal_mesh import IdealMesh
    from gearmbs.gears.mesh import OperatingPoint
    from gearmbs.gears.pair import GearPair
    from gearmbs.gears.planetary.elastic_ring import ElasticRim, RimModes, RingMeshes
    from gearmbs.gears.planetary.planetary_set import PlanetarySet, planetary
    from gearmbs.gears.planetary.rig import Support, planetary_mechanism
    from gearmbs.gears.spec import GearSpec, Material, involute
    from gearmbs.gears.transmission import TransmissionError, kinematic_transmission_error, loaded_transmission_error

__all__ = [
    "ContactLaw",
    "ContactModel",
    "ElasticRim",
    "FlankFriction",
    "GearContact",
    "GearPair",
    "GearSpec",
    "IdealMesh",
    "Material",
    "OperatingPoint",
    "PairGeometry",
    "Placement",
    "PlanetarySet",
    "RimModes",
    "RingMeshes",
    "Support",
    "TransmissionError",
    "faults",
    "involute",
    "kinematic_transmission_error",
    "loaded_transmission_error",
    "planetary",
    "planetary_mechanism",
]

late(
    __name__,
    {
        "ContactLaw": ".contact_model",
        "ContactModel": ".contact_model",
        "ElasticRim": ".planetary.elastic_ring",
        "FlankFriction": ".contact_model",
        "GearContact": ".contact_element",
        "GearPair": ".pair",
        "GearSpec": ".spec",
        "IdealMesh": ".ideal_mesh",
        "Material": ".spec",
        "OperatingPoint": ".mesh",
        "PairGeometry": ".geometry",
        "Placement": ".geometry",
        "PlanetarySet": ".planetary.planetary_set",
        "RimModes": ".planetary.elastic_ring",
        "RingMeshes": ".planetary.elastic_ring",
        "Support": ".planetary.rig",
        "TransmissionError": ".transmission",
        "faults": ".faults:",
        "involute": ".spec",
        "kinematic_transmission_error": ".transmission",
        "loaded_transmission_error": ".transmission",
        "planetary": ".planetary.planetary_set",
        "planetary_mechanism": ".planetary.rig",
    },
)

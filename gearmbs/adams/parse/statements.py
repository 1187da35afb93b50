"""The statements of a deck that this program understands, as typed records.

Every field carries the keyword and kind it is read from; values stay in the deck's units (angles in
radians).  ``given`` says which arguments stood in the deck.
"""

from __future__ import annotations

from gearmbs.adams.parse.statement import Statement
from gearmbs.adams.parse.statements_contact import Contact, Graphics
from gearmbs.adams.parse.statements_control import Gse, Lse, Tfsiso
from gearmbs.adams.parse.statements_curves import CurveStatement, Cvcv, Matrix, Ptcv
from gearmbs.adams.parse.statements_data import (
    Array,
    Diff,
    Equilibrium,
    InitialConditions,
    Integrator,
    Kinematics,
    Output,
    Plant,
    PlantInput,
    PlantOutput,
    Request,
    Results,
    Spline,
    Variable,
)
from gearmbs.adams.parse.statements_events import Sensor, String
from gearmbs.adams.parse.statements_flexible import FeLoad, FeNode, FePart, FlexBody, Material, Mforce
from gearmbs.adams.parse.statements_forces import (
    Accgrav,
    Beam,
    Bushing,
    Field,
    Friction,
    Gforce,
    Sforce,
    SpringDamper,
    Vforce,
    Vtorque,
)
from gearmbs.adams.parse.statements_model import (
    Coupler,
    Gcon,
    Gear,
    Joint,
    Jprim,
    Marker,
    Motion,
    Part,
    PointMass,
    Units,
)

STATEMENTS: dict[str, type[Statement]] = {
    "ACCGRAV": Accgrav,
    "ARRAY": Array,
    "BEAM": Beam,
    "BUSHING": Bushing,
    "CONTACT": Contact,
    "COUPLER": Coupler,
    "CURVE": CurveStatement,
    "CVCV": Cvcv,
    "DIFF": Diff,
    "EQUILIBRIUM": Equilibrium,
    "FE_LOAD": FeLoad,
    "FE_PART": FePart,
    "FIELD": Field,
    "FLEX_BODY": FlexBody,
    "FRICTION": Friction,
    "GCON": Gcon,
    "GEAR": Gear,
    "GFORCE": Gforce,
    "GRAPHICS": Graphics,
    "GSE": Gse,
    "IC": InitialConditions,
    "INTEGRATOR": Integrator,
    "JOINT": Joint,
    "JPRIM": Jprim,
    "KINEMATICS": Kinematics,
    "LSE": Lse,
    "MARKER": Marker,
    "MATERIAL": Material,
    "MATRIX": Matrix,
    "MFORCE": Mforce,
    "MOTION": Motion,
    "OUTPUT": Output,
    "PART": Part,
    "PINPUT": PlantInput,
    "POINT_MASS": PointMass,
    "POUTPUT": PlantOutput,
    "PTCV": Ptcv,
    "REQUEST": Request,
    "RESULTS": Results,
    "SENSOR": Sensor,
    "SFORCE": Sforce,
    "SPLINE": Spline,
    "SPRINGDAMPER": SpringDamper,
    "STRING": String,
    "TFSISO": Tfsiso,
    "UNITS": Units,
    "VARIABLE": Variable,
    "VFORCE": Vforce,
    "VTORQUE": Vtorque,
}
KEYWORD_OF = {cls: keyword for keyword, cls in STATEMENTS.items()}

WITHOUT_ID = frozenset("ACCGRAV EQUILIBRIUM IC INTEGRATOR KINEMATICS OUTPUT RESULTS UNITS".split())
"""Statements that stand once and have no id."""

ON_DEMAND = frozenset(["GRAPHICS", "MATERIAL"])
"""Statements that are read only as far as others name them."""

IGNORED = frozenset("PREFERENCES DEBUG FEMDATA FE_NODE LSOLVER SECTION".split())
"""Statements without effect on the numbers computed here."""

UNSUPPORTED = frozenset(
    """CLEARANCE EXTERNAL_SYSTEM MREQUEST
    NFORCE NODE NORMAL_MODE_ANALYSIS PSTATE SURFACE TIRE UCON""".split()
)
"""Statements of ADAMS that change the motion and are not modelled here."""

__all__ = [
    "IGNORED",
    "KEYWORD_OF",
    "ON_DEMAND",
    "STATEMENTS",
    "UNSUPPORTED",
    "WITHOUT_ID",
    "Accgrav",
    "Array",
    "Beam",
    "Bushing",
    "Contact",
    "Coupler",
    "CurveStatement",
    "Cvcv",
    "Diff",
    "Equilibrium",
    "FeLoad",
    "FeNode",
    "FePart",
    "Field",
    "FlexBody",
    "Friction",
    "Gcon",
    "Gear",
    "Gforce",
    "Graphics",
    "Gse",
    "InitialConditions",
    "Integrator",
    "Joint",
    "Jprim",
    "Kinematics",
    "Lse",
    "Marker",
    "Material",
    "Matrix",
    "Mforce",
    "Motion",
    "Output",
    "Part",
    "Plant",
    "PlantInput",
    "PlantOutput",
    "PointMass",
    "Ptcv",
    "Request",
    "Results",
    "Sensor",
    "Sforce",
    "Spline",
    "SpringDamper",
    "Statement",
    "String",
    "Tfsiso",
    "Units",
    "Variable",
    "Vforce",
    "Vtorque",
]

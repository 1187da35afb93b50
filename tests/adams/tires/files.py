"""Property files of tires and a road, with round numbers, and a rig that drives a wheel over the road."""

from __future__ import annotations

from pathlib import Path

COEFFICIENTS = {
    "PCX1": 1.6, "PDX1": 1.2, "PDX2": -0.1, "PDX3": 0.5, "PEX1": 0.3, "PEX2": 0.1, "PEX3": -0.05, "PEX4": 0.02,
    "PKX1": 22.0, "PKX2": 0.5, "PKX3": 0.2, "PHX1": 0.001, "PHX2": 0.0005, "PVX1": 0.002, "PVX2": 0.001, "RBX1": 12.0,
    "RBX2": -11.0, "RCX1": 1.1, "REX1": 0.4, "REX2": -0.2, "RHX1": 0.004, "PTX1": 2.0, "PTX2": 1.0, "PTX3": 0.5,
    "QSX1": 0.001, "QSX2": 0.8, "QSX3": 0.05, "PCY1": 1.3, "PDY1": 1.0, "PDY2": -0.15, "PDY3": 1.5, "PEY1": -0.9,
    "PEY2": -0.3, "PEY3": 0.1, "PEY4": -4.0, "PKY1": -20.0, "PKY2": 2.0, "PKY3": 0.3, "PHY1": 0.003, "PHY2": 0.001,
    "PHY3": 0.03, "PVY1": 0.02, "PVY2": -0.01, "PVY3": -0.3, "PVY4": -0.2, "RBY1": 7.0, "RBY2": 9.0, "RBY3": -0.02,
    "RCY1": 1.05, "REY1": -0.3, "REY2": 0.2, "RHY1": 0.002, "RHY2": 0.001, "RVY1": -0.02, "RVY2": 0.03, "RVY3": -0.2,
    "RVY4": 12.0, "RVY5": 1.9, "RVY6": -10.0, "PTY1": 2.1, "PTY2": 2.0, "QSY1": 0.01, "QSY2": 0.002, "QSY3": 0.001,
    "QSY4": 0.0001, "QBZ1": 10.0, "QBZ2": -1.5, "QBZ3": -0.4, "QBZ4": 0.05, "QBZ5": 0.4, "QBZ9": 9.0, "QBZ10": 0.1,
    "QCZ1": 1.2, "QDZ1": 0.09, "QDZ2": -0.01, "QDZ3": -0.05, "QDZ4": 0.7, "QDZ6": -0.006, "QDZ7": 0.005, "QDZ8": -0.18,
    "QDZ9": 0.03, "QEZ1": -1.5, "QEZ2": 0.3, "QEZ3": 0.1, "QEZ4": 0.25, "QEZ5": -3.0, "QHZ1": 0.004, "QHZ2": 0.002,
    "QHZ3": 0.12, "QHZ4": 0.06, "SSZ1": 0.03, "SSZ2": 0.004, "SSZ3": 0.5, "SSZ4": -0.2, "QTZ1": 0.2, "MBELT": 5.0,
    "LMUX": 0.95, "LKY": 1.1, "LGAY": 0.9, "LTR": 1.05, "LS": 0.9, "LVYKA": 1.2, "LGAZ": 0.8,
}  # fmt: skip
HEAD = "[UNITS]\nLENGTH = 'meter'\nFORCE = 'newton'\nANGLE = 'radians'\nMASS = 'kg'\nTIME = 'second'\n"
PAC2002 = (
    HEAD + "[MODEL]\nPROPERTY_FILE_FORMAT = 'PAC2002'\nUSE_MODE = {mode}\nVXLOW = 1\nLONGVL = 15\nTYRESIDE = 'LEFT'\n"
    "[DIMENSION]\nUNLOADED_RADIUS = 0.32  $free radius\nWIDTH = 0.2\n"
    "[VERTICAL]\nVERTICAL_STIFFNESS = 2e5\nVERTICAL_DAMPING = 100\nBREFF = 8\nDREFF = 0.25\nFREFF = 0.07\n"
    "FNOMIN = 4000\n"
    "[LONGITUDINAL_COEFFICIENTS]\n"
    + "".join(f"{name} = {value}  ! of the test\n" for name, value in COEFFICIENTS.items())
)
A = [1.6, -30.0, 1200.0, 2000.0, 10.0, 0.006, -0.02, 0.8, 0.002, 0.013, 0.004, 10.0, 1.2, 6.0]
B = [1.65, -9.0, 1400.0, 30.0, 180.0, 0.09, 0.004, -0.06, 0.2, 0.03, -0.18]
C = [2.3, 1.5, 6.4, -3.5, -0.09, 0.1, 0.003, -0.0001, 0.1, -1.3, 0.025, -0.024, 0.03, -0.065, 0.02, 0.9, -0.1, -3.3]
PAC89 = (
    HEAD.replace("meter", "mm") + "[MODEL]\nPROPERTY_FILE_FORMAT = 'PAC89'\nUSE_MODE = {mode}\n"
    "[DIMENSION]\nUNLOADED_RADIUS = 320.0\nWIDTH = 200.0\n"
    "[PARAMETER]\nVERTICAL_STIFFNESS = 200.0\nVERTICAL_DAMPING = 0.1\nLATERAL_STIFFNESS = 190.0\n"
    "ROLLING_RESISTANCE = 0.01\n"
    "[LATERAL_COEFFICIENTS]\n" + "".join(f"a{k} = {x}\n" for k, x in enumerate(A))
    + "[LONGITUDINAL_COEFFICIENTS]\n" + "".join(f"b{k} = {x}\n" for k, x in enumerate(B))
    + "[ALIGNING_COEFFICIENTS]\n" + "".join(f"c{k} = {x}\n" for k, x in enumerate(C))
)  # fmt: skip
FLAT = (
    "[MDI_HEADER]\nFILE_TYPE = 'rdf'\n"
    + HEAD.replace("meter", "mm")
    + "[MODEL]\nMETHOD = '2D'\nFUNCTION_NAME = 'ARC901'\n"
    "ROAD_TYPE = 'flat'\n[GRAPHICS]\nLENGTH = 26000.0\n[PARAMETERS]\nMU = 1.0\n"
)
RIG = """\
model create model_name = rig
defaults units length = {unit} angle = deg force = newton mass = kg time = sec
marker create marker_name = .rig.ground.road_mark location = 0, 0, 0 orientation = 0d, 0d, 0d
floating_marker create floating_marker_name = .rig.ground.under
marker create marker_name = .rig.ground.start location = {place} orientation = 0d, 90d, 0d
ude create instance instance_name = .rig.road definition_name = .MDI.Forces.vpg_road location = 0, 0, 0
variable modify variable_name = .rig.road.ref_marker object_value = .rig.ground.road_mark
variable modify variable_name = .rig.road.road_property_file string_value = "C:/roads/flat.rdf"
ude create instance instance_name = .rig.tire definition_name = .MDI.Forces.vpg_tire location = {place} &
   orientation = {turned}
variable modify variable_name = .rig.tire.side string_value = "{side}"
variable modify variable_name = .rig.tire.ref_marker object_value = (.rig.road.ref_marker.object_value)
variable modify variable_name = .rig.tire.road_property_file string_value = (.rig.road.road_property_file)
variable modify variable_name = .rig.tire.j_fmarker object_value = .rig.ground.under
variable modify variable_name = .rig.tire.wheel_tire_mass real_value = 20
variable modify variable_name = .rig.tire.Ixx_Iyy real_value = 0.8
variable modify variable_name = .rig.tire.Izz real_value = 1.0
variable modify variable_name = .rig.tire.property_file string_value = "tire.tir"
{more}
"""
DRIVEN = """\
ude create instance instance_name = .rig.drive definition_name = .MDI.Constraints.general_motion
variable modify variable_name = .rig.drive.i_marker object_value = .rig.tire.wheel_part.wheel_cm
variable modify variable_name = .rig.drive.j_marker object_value = .rig.ground.start
"""


def driven(ahead: str = "0", left: str = "0", up: str = "0", spin: str = "0", camber: float = 0.0) -> str:
    """Return the motion of a wheel over the road; spin is forwards, camber in degrees."""
    functions = {"t1": ahead, "t2": up, "t3": f"-({left})", "r1": f"{camber}*DTOR", "r2": "0", "r3": f"-({spin})"}
    lines = [
        f"variable modify variable_name = .rig.drive.{name}_type integer_value = 1\n"
        f'variable modify variable_name = .rig.drive.{name}_func string_value = "{function}"\n'
        for name, function in functions.items()
    ]
    return DRIVEN + "".join(lines)


QUARTER_CAR = """\
model create model_name = rig
defaults units length = mm angle = deg force = newton mass = kg time = sec
part create rigid_body name_and_position part_name = .rig.plate location = 0, 0, 0
marker create marker_name = .rig.plate.cm location = 0, 0, 0 orientation = 0d, 0d, 0d
part create rigid_body mass_properties part_name = .rig.plate mass = 1 center_of_mass_marker = cm ixx = 1 iyy = 1 &
   izz = 1
floating_marker create floating_marker_name = .rig.plate.under
part create rigid_body name_and_position part_name = .rig.axle location = 0, 0, 326
marker create marker_name = .rig.axle.cm location = 0, 0, 326 orientation = 0d, 0d, 0d
part create rigid_body mass_properties part_name = .rig.axle mass = 25 center_of_mass_marker = cm ixx = 1e5 iyy = 1e5 &
   izz = 1e5
part create rigid_body name_and_position part_name = .rig.body location = 0, 0, 726
marker create marker_name = .rig.body.cm location = 0, 0, 726 orientation = 0d, 0d, 0d
part create rigid_body mass_properties part_name = .rig.body mass = 300 center_of_mass_marker = cm ixx = 1e5 iyy = 1e5 &
   izz = 1e5
marker create marker_name = .rig.body.lower location = 0, 0, 626 orientation = 0d, 0d, 0d
marker create marker_name = .rig.ground.origin location = 0, 0, 0 orientation = 0d, 0d, 0d
constraint create joint translational joint_name = .rig.road_up i_marker_name = .rig.plate.cm &
   j_marker_name = .rig.ground.origin
constraint create joint translational joint_name = .rig.body_up i_marker_name = .rig.body.cm &
   j_marker_name = .rig.ground.origin
constraint create joint translational joint_name = .rig.axle_up i_marker_name = .rig.axle.cm &
   j_marker_name = .rig.body.cm
constraint create motion_generator motion_name = .rig.bump type_of_freedom = translational joint_name = .rig.road_up &
   function = "{road}"
ude create instance instance_name = .rig.road definition_name = .MDI.Forces.vpg_road location = 0, 0, 0
variable modify variable_name = .rig.road.road_property_file string_value = "flat.rdf"
ude create instance instance_name = .rig.tire definition_name = .MDI.Forces.vpg_tire location = 0, 0, 326 &
   orientation = 0, 90, 0
variable modify variable_name = .rig.tire.ref_marker object_value = .rig.plate.cm
variable modify variable_name = .rig.tire.road_property_file string_value = (.rig.road.road_property_file)
variable modify variable_name = .rig.tire.j_fmarker object_value = .rig.plate.under
variable modify variable_name = .rig.tire.wheel_tire_mass real_value = 25
variable modify variable_name = .rig.tire.Ixx_Iyy real_value = 8e5
variable modify variable_name = .rig.tire.Izz real_value = 1e6
variable modify variable_name = .rig.tire.property_file string_value = "tire.tir"
marker create marker_name = .rig.tire.wheel_part.hub location = 0, 0, 326 orientation = 0d, 0d, 0d
constraint create joint fixed joint_name = .rig.held i_marker_name = .rig.tire.wheel_part.hub &
   j_marker_name = .rig.axle.cm
force create direct single_component_force single_component_force_name = .rig.strut type_of_freedom = translational &
   i_marker_name = .rig.axle.cm j_marker_name = .rig.body.lower action_only = off &
   function = "-20*(DM(.rig.axle.cm, .rig.body.lower) - 300) - 1.5*VR(.rig.axle.cm, .rig.body.lower) + 2941.995"
force create body gravitational gravity_field_name = .rig.g x_component_gravity = 0 y_component_gravity = 0 &
   z_component_gravity = -9806.65
data_element create variable variable_name = .rig.comfort function = "ACCZ(.rig.body.cm)"
data_element create variable variable_name = .rig.holding function = "DZ(.rig.axle.cm, .rig.plate.cm) - 309.7"
data_element create variable variable_name = .rig.stroke function = "DZ(.rig.body.cm, .rig.axle.cm) - 400"
"""


def write(folder: Path, tire: str, more: str, road: str = FLAT, side: str = "left", camber: float = 0.0) -> Path:
    """Write the files of a rig whose wheel is at (0, 0, 0.3) m, its axle to the left, inclined by degrees."""
    (folder / "tire.tir").write_text(tire)
    (folder / "flat.rdf").write_text(road)
    path = folder / "rig.cmd"
    path.write_text(RIG.format(unit="meter", place="0, 0, 0.3", turned=f"0, {90 + camber}, 0", side=side, more=more))
    return path

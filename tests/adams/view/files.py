"""Command files that several tests read."""

PENDULUM = """\
! a pendulum with its length as a design variable
model create model_name = swing
defaults units length = mm angle = deg force = newton mass = kg time = sec
variable create variable_name = .swing.LENGTH units = "length" real_value = 500.0
variable create variable_name = .swing.TILT real_value = (2 * 15)
marker create marker_name = .swing.ground.PIVOT adams_id = 11 location = 0, 0, 0 orientation = 0d, 0d, 0d
part create rigid_body name_and_position part_name = .swing.ROD adams_id = 2 location = 0, 0, 0
marker create marker_name = .swing.ROD.TOP location = 0, 0, 0 orientation = 0, 0, 0
marker create marker_name = .swing.ROD.cm  &
   location = (LOC_RELATIVE_TO({.swing.LENGTH * SIN(.swing.TILT), -.swing.LENGTH * COS(.swing.TILT), 0},  &
               .swing.ground.PIVOT))  &   ! where the bob is
   relative_to = .swing.ROD
part create rigid_body mass_properties part_name = .swing.ROD mass = 2.0  &
   center_of_mass_marker = .swing.ROD.cm ixx = 100.0 iyy = 100.0 izz = 100.0
constraint create joint revolute joint_name = .swing.HINGE i_marker_name = .swing.ROD.TOP  &
   j_marker_name = .swing.ground.PIVOT
force create body gravitational gravity_field_name = .swing.gravity  &
   x_component_gravity = 0.0 y_component_gravity = -9806.65 z_component_gravity = 0.0
measure create function measure_name = .swing.HEIGHT function = "DY(.swing.ROD.cm, PIVOT)" units = "length"
simulation script create sim_script_name = .swing.Last_Sim commands =  &
   "simulation single_run transient type=auto_select end_time=0.2 number_of_steps=20"
geometry create shape ellipsoid ellipsoid_name = .swing.ROD.BOB center_marker = .swing.ROD.cm  &
   x_scale_factor = 20 y_scale_factor = 20 z_scale_factor = 20
"""

CHAIN = """\
model create model_name = chain
defaults units length = meter force = newton mass = kg time = sec angle = deg
variable set variable_name = .chain.n real_value = 4
marker create marker_name = .chain.ground.end_0 location = 0, 0, 0
for variable_name = i start_value = 1 end_value = (eval(.chain.n))
  part create rigid_body name_and_position part_name = (eval(".chain.link_" // RTOI(i))) location = (i - 1), 0, 0
  marker create marker_name = (eval(".chain.link_" // RTOI(i) // ".start")) location = (i - 1), 0, 0
  marker create marker_name = (eval(".chain.link_" // RTOI(i) // ".end")) location = (i), 0, 0
  marker create marker_name = (eval(".chain.link_" // RTOI(i) // ".cm")) location = (i - 0.5), 0, 0
  part modify rigid_body mass_properties part_name = (eval(".chain.link_" // RTOI(i))) mass = (eval(0.5 * i))  &
     ixx = 0.01 iyy = 0.04 izz = 0.04 center_of_mass_marker = (eval(".chain.link_" // RTOI(i) // ".cm"))
  if condition = (i == 1)
    constraint create joint revolute joint_name = .chain.joint_1 i_marker_name = .chain.link_1.start  &
       j_marker_name = .chain.ground.end_0
  else
    constraint create joint revolute joint_name = (eval(".chain.joint_" // RTOI(i)))  &
       i_marker_name = (eval(".chain.link_" // RTOI(i) // ".start"))  &
       j_marker_name = (eval(".chain.link_" // RTOI(i - 1) // ".end"))
  end
end
force create body gravitational gravity_field_name = .chain.g x_component = 0 y_component = -9.81 z_component = 0
"""

EVERYTHING = """\
model create model_name = m
defaults units length = mm angle = deg force = newton mass = kg time = sec
material create material_name = .m.oak density = 7.0E-07
part create rigid_body name_and_position part_name = .m.A location = 0, 0, 0
marker create marker_name = .m.A.M1 location = 10, 0, 0 orientation = 0d, 0d, 0d
marker create marker_name = .m.A.M2 location = 60, 0, 0 orientation = 90d, 0d, 0d
part create rigid_body mass_properties part_name = .m.A material_type = oak
geometry create shape block block_name = .m.A.BOX corner_marker = .m.A.M1 diag_corner_coords = 50, 20, 10
geometry create shape link link_name = .m.A.LINK i_marker = .m.A.M2 j_marker = .m.A.M3 width = 10 depth = 4
part create rigid_body name_and_position part_name = .m.B location = 0, 100, 0 orientation = 0, 45, 0
marker create marker_name = .m.B.M1 location = 0, 100, 0
marker create marker_name = .m.B.cm location = 0, 110, 0
part modify rigid_body mass_properties part_name = .m.B mass = 3 center_of_mass_marker = .m.B.cm ixx = 9 iyy = 9 izz = 9
part create rigid_body initial_velocity part_name = .m.B vx = 100 wz = 90
marker create marker_name = .m.ground.M1 location = 0, 0, 0
marker create marker_name = .m.ground.M2 location = 0, 100, 0
floating_marker create floating_marker_name = .m.ground.F1
constraint create joint cylindrical joint_name = .m.J1 i_marker_name = .m.A.M1 j_marker_name = .m.ground.M1  &
   translational_ic = 1.0 angular_velocity_ic = 10
constraint create joint revolute joint_name = .m.J2 i_part_name = .m.B j_part_name = .m.ground location = 0, 100, 0
constraint create motion_generator motion_name = .m.MO joint_name = .m.J2 type_of_freedom = rotational  &
   function = "1d * time"
constraint create complex_joint coupler coupler_name = .m.CO joint_name = .m.J1, .m.J2 type_of_freedom = rot_rot  &
   motion_multipliers = 1.0, -2.0
force create element_like bushing bushing_name = .m.BU i_marker_name = .m.A.M1 j_marker_name = .m.ground.M1  &
   stiffness = 1, 2, 3 damping = 0, 0, 0 tstiffness = 1, 2, 3 tdamping = 0, 0, 0 force_preload = 0, 0, 0  &
   torque_preload = 0, 0, 0
force create element_like translational_spring_damper spring_damper_name = .m.SP i_marker_name = .m.A.M2  &
   j_marker_name = .m.ground.M2 stiffness = 5 damping = 0.1 preload = 2 displacement_at_preload = 50
force create direct single_component_force single_component_force_name = .m.SF type_of_freedom = translational  &
   i_marker_name = .m.A.M2 j_marker_name = .m.ground.M2 action_only = off  &
   function = "STEP(time, 0, 0, 1, .m.K) * ", "DM(.m.A.M2, .m.ground.M2) + VARVAL(.m.V)"
force create direct force_vector force_vector_name = .m.VF i_marker_name = .m.B.M1  &
   j_floating_marker_name = .m.ground.F1 ref_marker_name = .m.ground.M1 x_force_function = "1" y_force_function = ""  &
   z_force_function = "AZ(.m.B.M1, .m.ground.M1)"
data_element create variable variable_name = .m.V function = "AKISPL(time, 0, .m.S, 0) + .m.ME"
data_element create spline spline_name = .m.S x = 0, 1, 2, 3 y = 0, 1, 4, 9 linear_extrapolate = no
data_element create array ic_array array_name = .m.AR size = 2 numbers = 1, 2
measure create object measure_name = .m.ME object = .m.J1 from_first = yes  &
   characteristic = ax_ay_az_projection_angles  &
   component = z_component
variable create variable_name = .m.K real_value = (3.5(newton/mm))
output_control create request request_name = .m.R f2 = "DX(.m.A.M1)" f3 = "" f4 = ""
executive_control set numerical_integration_parameters model_name = m integrator_type = gstiff error_tolerance = 1e-6
interface dialog_box create dialog_box_name = .gui.x title = "nothing"
color create color_name = .colors.pink red_component = 1
part attributes part_name = .m.A color = RED name_visibility = off
"""
"""Most kinds of objects; its marker .m.A.M3 is to be made, which the tests do."""
WHOLE = EVERYTHING.replace(
    "part create rigid_body mass_properties part_name = .m.A",
    "marker create marker_name = .m.A.M3 location = 60, 40, 0\npart create rigid_body mass_properties part_name = .m.A",
)


RUNS = (
    PENDULUM
    + """\
group create group_name = .swing.GRAVITIES objects_in_group = .swing.gravity* expr_active = (.swing.TILT > 10)
simulation script create sim_script_name = .swing.TILTED commands =  &
   "variable modify variable_name=.swing.TILT real_value=5",  &
   "simulation single_run transient end_time=0.1 number_of_steps=5", "simulation single_run save analysis_name=tilted"
for variable_name = k start_value = 1 end_value = 2
simulation single_run transient end_time = 0.1 number_of_steps = 5 model_name = .swing
variable modify variable_name = .swing.LENGTH real_value = (eval(400 + 50 * k))
simulation single_run reset
end
simulation single_run scripted sim_script_name = .swing.TILTED reset_before_and_after = yes
constraint attributes constraint_name = .swing.HINGE active = on dependents_active = on
simulation single_run transient duration = 0.1 step_size = 0.01 type = dynamic
"""
)
"""Simulations between changes of the model."""

LIVE = (
    PENDULUM
    + """\
function create function_name = .away text_of_expression = "LOC_RELATIVE_TO({D, 0, 0}, M)" argument_names = "D", "M" &
   type = location_orientation
function create function_name = .half text_of_expression = "P1 / 2" argument_names = "P1" type = real
variable create variable_name = .swing.WIDE real_value = (half(.swing.LENGTH) * 1mm)
variable create variable_name = .swing.DEEP real_value = (MAX(.swing.WIDE, 40)) range = (half(.swing.WIDE)), 900
marker create marker_name = .swing.ROD.SIDE location = (away(.swing.WIDE, .swing.ROD.cm)) relative_to = .swing.ROD
marker create marker_name = .swing.ROD.FAR location = (.swing.ROD.SIDE.loc_x + .swing.DEEP), 0, 0
"""
)
"""Variables and places of expressions that stay alive, with functions of the file."""

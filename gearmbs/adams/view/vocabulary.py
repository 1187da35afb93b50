"""The commands that are carried out, with their arguments, as one table; words may be shortened as in View.

A row is ``words | kind | argument with the name | arguments``. ``*`` among the words stands for create and modify. An
argument behind ``-`` changes nothing here: icons, colours, comments, and what only the graphics show.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from gearmbs.adams.view.lexer import ViewError
from gearmbs.wording import did_you_mean

PLACE = "location orientation along_axis_orientation in_plane_orientation relative_to"
PAIR = f"i_part_name j_part_name {PLACE} i_marker_name j_marker_name"
VELOCITY = "vm wm vx vy vz wx wy wz -no_vx -no_vy -no_vz -no_wx -no_wy -no_wz"
RUB_ROT = "friction_enabled -delta_v -maximum_deformation -mu_dyn_rot -mu_stat_rot -max_fric_rot -preload_radial -preload_axial -inner_radius -outer_radius"  # noqa: E501
RUB_TRANS = "friction_enabled -delta_v -maximum_deformation -mu_dyn_trans -mu_stat_trans -max_fric_trans -preload_x -preload_y -height -width"  # noqa: E501
IC_TRANS = "translational_ic velocity_ic -no_translational_ic -no_velocity_ic"
IC_ROT = "rotational_ic angular_velocity_ic -no_rotational_ic -no_angular_velocity_ic"
LOAD = "i_marker_name j_floating_marker_name j_part_name ref_marker_name -error -j_marker_id user_function routine"
FACETS = (
    "-side_count_for_body -segment_count_for_ends -side_count_for_perimeter -segment_count -number_of_sides -part_name"
)
ARRAYS = "x_state_array_name u_input_array_name y_output_array_name ic_array_name static_hold"

TABLE = f"""
model * | model | model_name | -title -view_name -fit_to_view -new_model_name
part * rigid_body name_and_position | part | part_name | ground_part planar -view_name -image_name -exact_coordinates {PLACE}
part * rigid_body mass_properties | part | part_name | mass center_of_mass_marker inertia_marker ixx iyy izz ixy izx iyz density material_type
part * rigid_body initial_velocity | part | part_name | {VELOCITY}
part * point_mass name_and_position | point_mass | point_mass_name | -view_name -exact_coordinates {PLACE}
part * point_mass mass_properties | point_mass | point_mass_name | mass center_of_mass_marker density material_type
part * point_mass initial_velocity | point_mass | point_mass_name | vm vx vy vz -no_vx -no_vy -no_vz
part * flexible_body name_and_position | flexible_body | flexible_body_name | -view_name -exact_coordinates {PLACE} modal_neutral_file_name md_db_file_name bdf_file_name index_in_database matrices damping_ratio damping_routine -generalized_damping -dynamic_limit -characteristic_length -representation -stability_factor invariants
part * flexible_body initial_velocity | flexible_body | flexible_body_name | {VELOCITY}
part * equation differential_equation | diff | differential_equation_name | initial_condition -no_initial_condition function user_function routine static_hold implicit -dynamic_hold
part * equation linear_state_equation | lse | linear_state_equation_name | {ARRAYS} a_state_matrix_name b_input_matrix_name c_output_matrix_name d_feedforward_matrix_name
part * equation transfer_function | tfsiso | transfer_function_name | {ARRAYS} numerator_coefficients denominator_coefficients
part * equation general_state_equation | gse | general_state_equation_name | {ARRAYS} state_equation_count output_equation_count discrete_state_equation_count discrete_state_array_name discrete_ic_array_name -df_dx_method -df_du_method -dg_dx_method -dg_du_method discrete sample_period user_sample_period sample_routine sample_offset implicit statics_only user_function routine interface_routines
marker * | marker | marker_name | {PLACE} node_id -preserve_location curve_name reference_marker_name velocity vx vy vz offset natural_coordinates_relative_orientation
floating_marker * | floating_marker | floating_marker_name | node_id
point * | point | point_name | location relative_to
material * | material | material_name | density youngs_modulus poissons_ratio -orthotropic_constants -anisotropic_constants
constraint * joint revolute | revolute | joint_name | {IC_ROT} {RUB_ROT} {PAIR}
constraint * joint translational | translational | joint_name | {IC_TRANS} {RUB_TRANS} {PAIR}
constraint * joint cylindrical | cylindrical | joint_name | {IC_TRANS} {IC_ROT} {PAIR}
constraint * joint spherical | spherical | joint_name | {PAIR}
constraint * joint fixed | fixed | joint_name | {PAIR}
constraint * joint rigid | fixed | joint_name | {PAIR}
constraint * joint universal | universal | joint_name | {PAIR}
constraint * joint hooke | hooke | joint_name | {PAIR}
constraint * joint convel | convel | joint_name | {PAIR}
constraint * joint planar | planar | joint_name | {PAIR}
constraint * joint screw | screw | joint_name | pitch {PAIR}
constraint * joint rackpin | rackpin | joint_name | diameter_of_pitch {PAIR}
constraint * primitive_joint at_point | atpoint | jprim_name | {PAIR}
constraint * primitive_joint inline | inline | jprim_name | {PAIR}
constraint * primitive_joint inplane | inplane | jprim_name | {PAIR}
constraint * primitive_joint orientation | orientation | jprim_name | {PAIR}
constraint * primitive_joint parallel_axis | parallel_axes | jprim_name | {PAIR}
constraint * primitive_joint perpendicular | perpendicular | jprim_name | {PAIR}
constraint * primitive_joint point_point | point_point | jprim_name | offset {PAIR}
constraint * motion_generator | motion | motion_name | joint_name type_of_freedom i_marker_name j_marker_name axis function user_function routine time_derivative displacement_ic velocity_ic rotational_displacement_ic rotational_velocity_ic
constraint * complex_joint coupler | coupler | coupler_name | joint_name type_of_freedom -freedom_type motion_multipliers first_angular_scale_factor first_scale_factor second_angular_scale_factor second_scale_factor third_angular_scale_factor third_scale_factor user_function routine
constraint * complex_joint gear | gear | gear_name | joint_name common_velocity_marker
constraint * general_constraint | gcon | general_constraint_name | i_marker_name function
constraint * higher_pair_contact point_curve | ptcv | point_curve_name | curve_name i_part_name location relative_to i_marker_name j_floating_marker_name -j_marker_id ref_marker_name displacement_ic -no_displacement_ic velocity_ic -no_velocity_ic ic_ref_marker_name
constraint * higher_pair_contact curve_curve | cvcv | curve_curve_name | i_curve_name j_curve_name i_ref_marker_name j_ref_marker_name i_floating_marker_name j_floating_marker_name -i_marker_id -j_marker_id i_displacement_ic -no_i_displacement_ic j_displacement_ic -no_j_displacement_ic i_velocity_ic -no_i_velocity_ic j_velocity_ic -no_j_velocity_ic i_ic_ref_marker_name j_ic_ref_marker_name
constraint * user_defined | user_constraint | user_constraint_name | user_function routine
force * body gravitational | gravity | gravity_field_name | -units_consistency_factor x_component_gravity y_component_gravity z_component_gravity
force * direct single_component_force | sforce | single_component_force_name | type_of_freedom action_only function user_function routine -error {PAIR}
force * direct force_vector | vforce | force_vector_name | {LOAD} x_force_function y_force_function z_force_function xyz_force_function
force * direct torque_vector | vtorque | torque_vector_name | {LOAD} x_torque_function y_torque_function z_torque_function xyz_torque_function
force * direct general_force | gforce | general_force_name | {LOAD} x_force_function y_force_function z_force_function x_torque_function y_torque_function z_torque_function xyz_force_function xyz_torque_function
force * direct modal_force | modal_force | modal_force_name | flex_body case_index scale force_function user_function routine j_floating_marker_name j_part_name
force * direct multi_point_force | nforce | multi_point_force_name | i_marker_name j_marker_name stiffness_matrix_name damping_matrix_name damping_ratio length_matrix_name force_matrix_name
force * direct fe_load | fe_load | feload_name | ref_fe_part
force * element_like beam | beam | beam_name | ixx iyy izz y_shear_area_ratio z_shear_area_ratio youngs_modulus shear_modulus length area_of_cross_section damping_ratio matrix_of_damping_terms formulation {PAIR}
force * element_like bushing | bushing | bushing_name | damping stiffness force_preload tdamping tstiffness torque_preload {PAIR}
force * element_like field | field | field_name | translation_at_preload rotation_at_preload force_preload torque_preload stiffness_matrix damping_ratio matrix_of_damping_terms user_function routine formulation length_tolerance {PAIR}
force * element_like translational_spring_damper | spring | spring_damper_name | damping stiffness preload displacement_at_preload {PAIR}
force * element_like rotational_spring_damper | rotational_spring | spring_damper_name | damping stiffness preload displacement_at_preload {PAIR}
force * element_like friction | friction | friction_name | joint_name formulation stiction_transition_velocity -transition_velocity_coefficient max_stiction_deformation mu_static mu_dynamic reaction_arm initial_overlap overlap_delta bending_factor friction_force_preload max_friction_force effect preload reaction_force torsional_moment bending_moment inactive_during_static yoke friction_arm pin_radius bending_reaction_arm friction_torque_preload max_friction_torque ball_radius bristle_stiffness_coefficient damping_coefficient viscous_friction_coefficient velocity_threshold_stribeck decay_exponent_stribeck
contact * | contact | contact_name | i_marker_name i_geometry_name i_flex i_edge -i_edge_index j_geometry_name j_flex j_edge -j_edge_index i_flip_normal j_flip_normal i_flip_geometry_name j_flip_geometry_name geometry_routines stiffness damping dmax exponent penalty restitution_coefficient normal_function normal_routine augmented_lagrangian_formulation no_friction coulomb_friction mu_static mu_dynamic friction_transition_velocity stiction max_stiction_deformation friction_function friction_routine stiction_transition_velocity face_contact_top face_contact_bottom -type
data_element * variable | state_variable | variable_name | -initial_condition function user_function routine
data_element * array general_array | array | array_name | size numbers
data_element * array ic_array | ic_array | array_name | size numbers
data_element * array u_input_array | u_array | array_name | size variable_name
data_element * array x_state_array | x_array | array_name | size
data_element * array y_output_array | y_array | array_name | size
data_element * curve | curve | curve_name | closed matrix_name interpolation_order fit_type -segment_count tension user_function minimum_parameter maximum_parameter routine
data_element * matrix full | matrix | matrix_name | row_count column_count values result_set_component_names input_order -units
data_element * matrix sparse | sparse_matrix | matrix_name | row_index column_index values -units
data_element * matrix file | file_matrix | matrix_name | file_name name_of_matrix_in_file -units
data_element * plant input | plant_input | plant_input_name | variable_name
data_element * plant output | plant_output | plant_output_name | variable_name
data_element * plant state | plant_state | plant_state_name | -variable_name
data_element * spline | spline | spline_name | linear_extrapolate units x_units y_units z_units file_name block_name -channel routine x y z x_result_set_component_name y_result_set_component_name z_result_set_component_name
data_element * string | string | string_name | string
executive_control * sensor | sensor | sensor_name | compare codgen dt halt bisection time_error value error angular_value angular_error print restart return stepsize yydump function user_function routine evaluate user_evaluate evaluate_routine
output_control * request | request | request_name | comment component_names -component_units component_labels results_name title output_type i_marker_name j_marker_name r_marker_name motion_rframe user_function f1 f2 f3 f4 f5 f6 f7 f8 variable_name routine
measure * function | function_measure | measure_name | function user_function routine -units -create_measure_display -legend
measure * object | object_measure | measure_name | -from_first component motion_rframe coordinate_rframe characteristic object -create_measure_display -legend
measure * point | point_measure | measure_name | component motion_rframe coordinate_rframe characteristic point -create_measure_display -legend
measure * pt2pt | pt2pt_measure | measure_name | component motion_rframe coordinate_rframe characteristic from_point to_point -create_measure_display -legend
measure * angle | angle_measure | measure_name | first_point middle_point last_point -create_measure_display -legend
measure * orient | orient_measure | measure_name | component characteristic to_frame from_frame -create_measure_display -legend
measure * computed | computed_measure | measure_name | text_of_expression -units -create_measure_display -legend
measure * range | range_measure | measure_name | type of_measure_name -create_measure_display -legend
measure * query | query_measure | measure_name | -gui_driver_name -delay_time -initial_condition -create_measure_display -legend
geometry * shape block | block | block_name | corner_marker diag_corner_coords {FACETS}
geometry * shape cylinder | cylinder | cylinder_name | center_marker angle_extent length radius ref_radius_by_marker {FACETS}
geometry * shape ellipsoid | ellipsoid | ellipsoid_name | center_marker x_scale_factor y_scale_factor z_scale_factor {FACETS}
geometry * shape sphere | sphere | sphere_name | center_marker radius {FACETS}
geometry * shape frustum | frustum | frustum_name | center_marker angle_extent length top_radius bottom_radius {FACETS}
geometry * shape torus | torus | torus_name | center_marker angle_extent major_radius minor_radius {FACETS}
geometry * shape link | link | link_name | i_marker j_marker width depth {FACETS}
geometry * shape plate | plate | plate_name | marker_name width radius {FACETS}
geometry * shape plane | plane | plane_name | ref_marker_name x_minimum x_maximum y_minimum y_maximum
geometry * shape extrusion | extrusion | extrusion_name | reference_marker relative_to -analytical profile_curve points_for_profile path_curve path_points length_along_z_axis -profiles_loft -centerline_loft
geometry * shape revolution | revolution | revolution_name | reference_marker relative_to -analytical profile_curve points_for_profile angle_extent {FACETS}
geometry * shape csg | csg | csg_name | base_object object type
geometry * shape shell | shell | shell_name | reference_marker file_name -wireframe_only
geometry * shape solid | solid | solid_name | -shells reference_marker
geometry * shape solid_shell | solid | solid_shell_name | -shells reference_marker
geometry * feature blend | feature | blend_name | -subtype -subids -chamfer -radius1 -radius2 -reference_marker -locations
geometry * feature hole | feature | hole_name | -subtype -subids -countersink -center -radius -depth -reference_marker
geometry * feature thinshell | feature | thinshell_name | -subids -thickness -reference_marker
geometry * curve circle | circle | circle_name | center_marker radius ref_radius_by_marker {FACETS}
geometry * curve arc | arc | arc_name | center_marker angle_extent radius ref_radius_by_marker -close {FACETS}
geometry * curve polyline | polyline | polyline_name | location -path_curve -image_file_name -horizontal -vertical relative_to close
geometry * point | graphic | point_name | -ref_marker_name
variable create | variable | variable_name | real_value -units -range -allowed_values -delta_type -use_range -use_allowed_values integer_value string_value object_value index
variable modify | variable | variable_name | real_value -units -range -allowed_values -delta_type -use_range -use_allowed_values integer_value string_value object_value index
variable set | variable | variable_name | real_value -units -range -allowed_values -delta_type -use_range -use_allowed_values integer_value string_value object_value index
simulation script * | script | sim_script_name | initial_static type number_of_steps step_size end_time duration commands solver_commands
ude * instance | ude | instance_name | definition_name -location -orientation -relative_to
assembly * instance | ude | instance_name | definition_name -location -orientation -relative_to
group * | group | group_name | objects_in_group type_filter -expand_groups expr_active
executive_control set numerical_integration_parameters | integrator | model_name | integrator_type formulation -solver_type error_tolerance -pattern_for_jacobian maxit_corrector_iterations hinit_time_step hmin_time_step hmax_time_step -adaptivity -scale kmax_integrator_order interpolate -reconcile -repartition_threshold corrector -alpha -beta -gamma -fixed_iterations -hratio -max_error
executive_control set integrator_parameters gstiff | gstiff | model_name | error_tolerance hinit_time_step hmax_time_step hmin_time_step kmax_integrator_order maxit_corrector_iterations -pattern_for_jacobian
executive_control set integrator_parameters wstiff | wstiff | model_name | error_tolerance hinit_time_step hmax_time_step hmin_time_step kmax_integrator_order maxit_corrector_iterations -pattern_for_jacobian -watch_integrator_perf -reconcile_vel_and_acc
macro create | macro | macro_name | user_entered_command commands_to_be_executed -wrap_in_undo -help_file -help_string -create_panel -security_code
macro read | macro | macro_name | file_name user_entered_command -wrap_in_undo -help_file -help_string -create_panel
marker attributes | | marker_name | active
part attributes | | part_name | active
constraint attributes | | constraint_name | active
force attributes | | force_name | active
data_element attributes | | data_element_name | active
geometry attributes | | geometry_name | active
output_control attributes request | | request_name | active
executive_control attributes sensor | | sensor_name | active
ude attributes | | instance_name | active
assembly attributes | | instance_name | active
group attributes | | group_name | active
entity attributes | | entity_name | active -type_filter -entity_scope
point attributes | | point_name | active
measure attributes | | measure_name | active
contact attributes | | contact_name | active
marker delete | | marker_name |
part delete | | part_name |
point delete | | point_name |
constraint delete | | constraint_name |
force delete | | force_name |
contact delete | | contact_name |
geometry delete | | geometry_name |
variable delete | | variable_name |
measure delete | | measure_name |
data_element delete | | data_element_name |
entity delete | | entity_name | -type_filter
simulation script delete | | sim_script_name |
macro delete | | macro_name |
defaults units | | | force mass length time angle frequency coordinate_system_type orientation_type -units_consistency_factor
defaults coordinate_system | | | default_coordinate_system
defaults model | | | model_name part_name -flexible_body_name -point_mass_name -marker_name -joint_name -geometry_name
defaults orient_axis_and_plane | | | axis_and_plane_setting
file command read | | | file_name
file parasolid read | | | file_name -ref_markers -type -clean_on_import -explode_assemblies -model_name -assembly_retain part_name location orientation relative_to
simulation single_run transient | | | model_name initial_static type number_of_steps step_size end_time duration forever
simulation single_run equilibrium | | | model_name
simulation single_run assemble | | | model_name
simulation single_run eigensolution | | | model_name -eigen_name -original damping vectors -plant_state_name -reference_marker
simulation single_run scripted | | | model_name sim_script_name -reset_before_and_after
if | | | condition
elseif | | | condition
else | | |
end | | |
for | | | variable_name from to start_value end_value increment_value object_names type
while | | | condition
break | | |
continue | | |
return | | |
"""  # noqa: E501

IGNORED = """view | interface | color | colors | xy_plots | plot3d | plotcurve3d | animation | undo | plugin |
list_info | hardcopy | display_attributes | notes | report | panel | graphic_results | contour_plot |
measure_display | highlight |
command_server | defaults attributes | defaults command_file | defaults interface | defaults geometry |
defaults graphics | defaults results | defaults force_graphics | defaults icon_naming | defaults function_references |
defaults name_generation | defaults solver | defaults contact | defaults view | model attributes | model display |
model verify | model generate_ids | part display | geometry create shape force | geometry modify shape force |
geometry create shape gcontact | geometry modify shape gcontact | geometry create shape spring_damper |
geometry modify shape spring_damper | geometry create shape picture | geometry create curve outline |
geometry modify curve outline | geometry create curve point_trace | geometry create curve curve_trace |
geometry modify shape shape_appearance | output_control set | executive_control set preferences |
executive_control set equilibrium_parameters | executive_control set kinematics_parameters |
executive_control set initial_conditions_parameters | executive_control set solver_parameters |
simulation single_run reset | simulation single_run set | simulation single_run save | simulation set |
simulation single_run debugger | simulation script write_acf | library | callback | check_messages | custom |
geometry create shape plate_text | file log_file | file geometry | file parasolid write | file command write |
file adams_data_set write | file binary write | numeric_results | analysis | optimize | multi_run_analysis |
ude auto_connect | force create graphics | output"""
"""Commands for the interface, the graphics and settings of results: nothing of the motion depends on them."""


@dataclass(frozen=True)
class Row:
    """One command: its words, the kind of object it makes or changes, and its arguments.

    Attributes
    ----------
    words : tuple of str
    verb : {"create", "modify", "set", ...}
    kind : str
        "" of commands that make no object.
    naming : str
        The argument with the object's name, "" if there is none.
    arguments : dict of str to bool
        Whether each has an effect.
    """

    words: tuple[str, ...]
    verb: str
    kind: str
    naming: str
    arguments: dict[str, bool]


@dataclass
class _Node:
    """A word of the commands, what may follow, and the command that ends here."""

    follow: dict[str, _Node] = field(default_factory=dict)
    row: Row | None = None
    ignored: bool = False


COMMON = ("adams_id", "-comments")


def _tree() -> _Node:
    root = _Node()
    for line in TABLE.strip().splitlines():
        words, kind, naming, arguments = (part.strip() for part in line.split("|"))
        named = [*arguments.split(), *(COMMON if kind else ())]
        known = {word.lstrip("-"): not word.startswith("-") for word in named}
        if naming:
            known[naming] = True
        if kind:
            known[f"new_{naming}"] = True
        attributes = "attributes" in words.split()
        for verb in ("create", "modify") if "*" in words else (words.split()[-1] if not kind else words.split()[1],):
            path = tuple(verb if word == "*" else word for word in words.split())
            row = Row(path, "attributes" if attributes else verb, kind, naming, known)
            _at(root, path).row = row
    for words in IGNORED.replace("\n", " ").split("|"):
        _at(root, tuple(words.split())).ignored = True
    return root


def _at(root: _Node, path: tuple[str, ...]) -> _Node:
    for word in path:
        root = root.follow.setdefault(word, _Node())
    return root


ROOT = _tree()
ROWS = [node.row for node in (lambda walk: walk(walk, ROOT))(
    lambda walk, node: [node, *(one for child in node.follow.values() for one in walk(walk, child))]
) if node.row is not None]  # fmt: skip
"""All rows."""


def resolve(words: tuple[str, ...], line: int) -> Row | None:
    """Return the row of a command whose words may be shortened, None of one that is ignored.

    Raises
    ------
    ViewError
        If a word is unknown or ambiguous.
    """
    node: _Node = ROOT
    path: list[str] = []
    for word in words:
        if node.ignored:
            return None
        match = _match(node, word)
        if match is None:
            raise ViewError(_unknown(node, path, word), line)
        path.append(match)
        node = node.follow[match]
    if node.row is not None:
        return node.row
    if node.ignored:
        return None
    raise ViewError(f"the command '{' '.join(path)}' is not whole; it goes on with {', '.join(node.follow)}", line)


def _match(node: _Node, word: str) -> str | None:
    if word in node.follow:
        return word
    found = [w for w in node.follow if w.startswith(word)]
    return found[0] if len(found) == 1 else None


def _unknown(node: _Node, path: list[str], word: str) -> str:
    found = [w for w in node.follow if w.startswith(word)]
    said = " ".join([*path, word])[:80]
    if found:
        return f"the command '{said}' is ambiguous: {', '.join(found)}"
    return f"the command '{said}' is not known here{did_you_mean(word[:40], node.follow, before='; ')}"


def argument_of(row: Row, word: str, line: int) -> str:
    """Return the full name of an argument.

    Raises
    ------
    ViewError
        If it is unknown or ambiguous.
    """
    if word in row.arguments:
        return word
    found = [w for w in row.arguments if w.startswith(word) and not w.startswith("new_")] or [
        w for w in row.arguments if w.startswith(word)
    ]
    if len(found) == 1:
        return found[0]
    if row.verb == "attributes":
        return word
    command = " ".join(row.words)
    if found:
        raise ViewError(f"{command}: {word} is ambiguous: {', '.join(found)}", line)
    raise ViewError(
        f"{command}: it has no argument {word[:40]}{did_you_mean(word[:40], row.arguments, before='; ')}", line
    )

"""Fields of the nodes of Parasolid XT data, as the schema 13006 has them, on which embedded schemas build.

Source: Siemens, Parasolid XT Format Reference, chapters 2, 5 and 6. Types of fields: d, n, u integers; p number of a
node; f a real number; v, h three, b six, i two of them; c, w a character; l a logical value.
"""

from __future__ import annotations

from typing import NamedTuple


class Field(NamedTuple):
    """A field of a node: its type and how many values it has; 0 for one, 1 for as many as the node says."""

    name: str
    type: str
    size: int


_TOP = "node_id:d attributes:p"
_CURVE = f"{_TOP} owner:p next:p previous:p geometric_owner:p sense:c"
_CHARACTERS = " ".join(
    f"{which}_{side}:c"
    for which in ("original", "extended")
    for side in ("u_start", "u_end", "v_start", "v_end")
)  # fmt: skip

_TEXT = {
    (10, "ASSEMBLY"): "highest_node_id:d attributes:p attribute_chains:p list:p surface:p curve:p point:p key:p "
    "res_size:f res_linear:f ref_instance:p next:p previous:p state:u owner:p type:u sub_instance:p",
    (11, "INSTANCE"): f"{_TOP} type:u part:p transform:p assembly:p next_in_part:p prev_in_part:p next_of_part:p "
    "prev_of_part:p",
    (12, "BODY"): "highest_node_id:d attributes:p attribute_chains:p surface:p curve:p point:p key:p res_size:f "
    "res_linear:f ref_instance:p next:p previous:p state:u owner:p body_type:u nom_geom_state:u shell:p "
    "boundary_surface:p boundary_curve:p boundary_point:p region:p edge:p vertex:p",
    (13, "SHELL"): f"{_TOP} body:p next:p face:p edge:p vertex:p region:p front_face:p",
    (14, "FACE"): f"{_TOP} tolerance:f next:p previous:p loop:p shell:p surface:p sense:c next_on_surface:p "
    "previous_on_surface:p next_front:p previous_front:p front_shell:p",
    (15, "LOOP"): f"{_TOP} halfedge:p face:p next:p",
    (16, "EDGE"): f"{_TOP} tolerance:f halfedge:p previous:p next:p curve:p next_on_curve:p previous_on_curve:p "
    "owner:p",
    (17, "HALFEDGE"): "attributes:p loop:p forward:p backward:p vertex:p other:p edge:p curve:p next_at_vx:p sense:c",
    (18, "VERTEX"): f"{_TOP} halfedge:p previous:p next:p point:p tolerance:f owner:p",
    (19, "REGION"): f"{_TOP} body:p next:p previous:p shell:p type:c",
    (29, "POINT"): f"{_TOP} owner:p next:p previous:p pvec:v",
    (30, "LINE"): f"{_CURVE} pvec:v direction:v",
    (31, "CIRCLE"): f"{_CURVE} centre:v normal:v x_axis:v radius:f",
    (32, "ELLIPSE"): f"{_CURVE} centre:v normal:v x_axis:v major_radius:f minor_radius:f",
    (38, "INTERSECTION"): f"{_CURVE} surface:p2 chart:p start:p end:p",
    (40, "CHART"): "base_parameter:f base_scale:f chart_count:d chordal_error:f angular_error:f parameter_error:f2 "
    "hvec:h1",
    (41, "LIMIT"): "type:c hvec:h1",
    (45, "BSPLINE_VERTICES"): "vertices:f1",
    (50, "PLANE"): f"{_CURVE} pvec:v normal:v x_axis:v",
    (51, "CYLINDER"): f"{_CURVE} pvec:v axis:v radius:f x_axis:v",
    (52, "CONE"): f"{_CURVE} pvec:v axis:v radius:f sin_half_angle:f cos_half_angle:f x_axis:v",
    (53, "SPHERE"): f"{_CURVE} centre:v radius:f axis:v x_axis:v",
    (54, "TORUS"): f"{_CURVE} centre:v axis:v major_radius:f minor_radius:f x_axis:v",
    (56, "BLENDED_EDGE"): f"{_CURVE} blend_type:c surface:p2 spine:p range:f2 thumb_weight:f2 boundary:p2 start:p "
    "end:p",
    (59, "BLEND_BOUND"): f"{_CURVE} boundary:n blend:p",
    (60, "OFFSET_SURF"): f"{_CURVE} check:c true_offset:l surface:p offset:f scale:f",
    (67, "SWEPT_SURF"): f"{_CURVE} section:p sweep:v scale:f",
    (68, "SPUN_SURF"): f"{_CURVE} profile:p base:v axis:v start:v end:v start_param:f end_param:f x_axis:v scale:f",
    (70, "LIST"): "node_id:d owner:p next:p previous:p list_type:u list_length:d block_length:d size_of_entry:d "
    "list_block:p finger_block:p finger_index:d notransmit:l",
    (74, "POINTER_LIS_BLOCK"): "n_entries:d next_block:p entries:p1",
    (79, "ATT_DEF_ID"): "string:c1",
    (80, "ATTRIB_DEF"): "next:p identifier:p type_id:d actions:u8 field_names:p legal_owners:l14 fields:u1",
    (81, "ATTRIBUTE"): "node_id:d definition:p owner:p next:p previous:p next_of_type:p previous_of_type:p fields:p1",
    (82, "INT_VALUES"): "values:d1",
    (83, "REAL_VALUES"): "values:f1",
    (84, "CHAR_VALUES"): "values:c1",
    (85, "POINT_VALUES"): "values:v1",
    (86, "VECTOR_VALUES"): "values:v1",
    (87, "AXIS_VALUES"): "values:v1",
    (88, "TAG_VALUES"): "values:d1",
    (89, "DIRECTION_VALUES"): "values:v1",
    (90, "FEATURE"): f"{_TOP} owner:p next:p previous:p type:u first_member:p",
    (91, "MEMBER_OF_FEATURE"): "dummy_node_id:d owning_feature:p owner:p next:p previous:p next_member:p "
    "previous_member:p",
    (98, "UNICODE_VALUES"): "values:w1",
    (99, "FIELD_NAMES"): "names:p1",
    (100, "TRANSFORM"): "node_id:d owner:p next:p previous:p rotation_matrix:f9 translation_vector:v scale:f flag:d "
    "perspective_vector:v",
    (102, "KEY"): "string:c1",
    (120, "PE_SURF"): f"{_CURVE} type:c data:p tf:p internal_geom:p1",
    (121, "INT_PE_DATA"): "geom_type:d real_array:p int_array:p",
    (122, "EXT_PE_DATA"): "key:p real_array:p int_array:p",
    (124, "B_SURFACE"): f"{_CURVE} nurbs:p data:p",
    (125, "SURFACE_DATA"): "original_uint:i original_vint:i extended_uint:i extended_vint:i self_int:u "
    f"{_CHARACTERS} analytic_form_type:c swept_form_type:c spun_form_type:c blend_form_type:c analytic_form:p "
    "swept_form:p spun_form:p blend_form:p",
    (126, "NURBS_SURF"): "u_periodic:l v_periodic:l u_degree:n v_degree:n n_u_vertices:d n_v_vertices:d u_knot_type:u "
    "v_knot_type:u n_u_knots:d n_v_knots:d rational:l u_closed:l v_closed:l surface_form:u vertex_dim:n "
    "bspline_vertices:p u_knot_mult:p v_knot_mult:p u_knots:p v_knots:p",
    (127, "KNOT_MULT"): "mult:n1",
    (128, "KNOT_SET"): "knots:f1",
    (130, "PE_CURVE"): f"{_CURVE} type:c data:p tf:p internal_geom:p1",
    (133, "TRIMMED_CURVE"): f"{_CURVE} basis_curve:p point_1:v point_2:v parm_1:f parm_2:f",
    (134, "B_CURVE"): f"{_CURVE} nurbs:p data:p",
    (135, "CURVE_DATA"): "self_int:u analytic_form:p",
    (136, "NURBS_CURVE"): "degree:n n_vertices:d vertex_dim:n n_knots:d knot_type:u periodic:l closed:l rational:l "
    "curve_form:u bspline_vertices:p knot_mult:p knots:p",
    (137, "SP_CURVE"): f"{_CURVE} surface:p b_curve:p original:p tolerance_to_original:f",
    (141, "GEOMETRIC_OWNER"): "owner:p next:p previous:p shared_geometry:p",
    (163, "HELIX_SU_FORM"): "axis_pt:v axis_dir:v hand:c turns:i pitch:f gap:f tol:f",
    (172, "HELIX_CU_FORM"): "axis_pt:v axis_dir:v point:v hand:c turns:i pitch:f tol:f",
}


def _field(text: str) -> Field:
    name, kind = text.split(":")
    return Field(name, kind[0], int(kind[1:] or 0))


BASE: dict[int, tuple[str, tuple[Field, ...]]] = {
    number: (name, tuple(_field(word) for word in text.split())) for (number, name), text in _TEXT.items()
}
"""Name and fields of each type of node."""

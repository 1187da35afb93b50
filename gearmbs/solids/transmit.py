"""Nodes of a Parasolid text transmit file (.x_t, .xmt_txt).

Source: Siemens, Parasolid XT Format Reference, chapters 2 and 3. Line ends mean nothing; a number is followed by one
space, a character by none. The first node of a type says how its fields differ from those of schema 13006.
"""

from __future__ import annotations

import bisect
import re
from pathlib import Path
from typing import Any, NamedTuple

from gearmbs.dae.problem import ModelError

BASE_SCHEMA = "13006"
END_OF_HEADER = b"**END_OF_HEADER"
UNCHANGED = 255
"""What stands for a list of fields that is that of the base schema."""
TERMINATOR = 1
WIDTH = {"f": 1, "v": 3, "h": 3, "b": 6, "i": 2}
"""Real numbers in a value."""
INTEGERS = "dpnuwt"
LARGEST = 10_000_000
"""Values in one field; more is a damaged file."""
NUMBER = re.compile(r"[-+]?[0-9.][-+0-9.eE]* ?|\? ?")
RESAVE = "save the solid again from a program with Parasolid 14 or later, or as .stl"


class Node:
    """A node: its number, the name of its type, and its fields as attributes."""

    __slots__ = ("__dict__", "index", "kind")

    def __init__(self, index: int, kind: str, fields: dict[str, Any]) -> None:
        self.index = index
        self.kind = kind
        self.__dict__.update(fields)

    def __getattr__(self, name: str) -> Any:
        raise ModelError(f"its {self.kind} {self.index} has no field '{name}'; {RESAVE}")


class Nodes(dict[int, Node]):
    """Nodes by their numbers."""

    def __missing__(self, number: int) -> Node:
        raise ModelError(f"its node {number} is not there; {RESAVE}")


class Text:
    """The text after the header, read value by value."""

    def __init__(self, text: str, start_of_line: list[int]) -> None:
        self.text = text
        self.at = 0
        self._lines = start_of_line

    def line(self) -> int:
        """Return the line of the file that holds the next value."""
        return bisect.bisect_right(self._lines, self.at)

    def number(self) -> str:
        """Return the next number as text; '?' if it is not set."""
        match = NUMBER.match(self.text, self.at)
        if match is None:
            found = self.text[self.at : self.at + 10]
            raise ValueError(f"a number is expected, not {found!r}" if found else "it ends")
        self.at = match.end()
        return match.group().rstrip(" ")

    def integer(self) -> int:
        """Return the next integer; 0 if it is not set."""
        word = self.number()
        return 0 if word == "?" else int(word)

    def count(self) -> int:
        """Return the next integer, a number of things."""
        value = self.integer()
        if not 0 <= value <= LARGEST:
            raise ValueError(f"{value} values cannot be in one field")
        return value

    def reals(self, width: int) -> tuple[float, ...]:
        """Return so many real numbers, NaN where they are not set, which is said once for all."""
        first = self.number()
        if first == "?":
            return (float("nan"),) * width
        return (float(first), *(float(self.number()) for _ in range(width - 1)))

    def characters(self, count: int) -> str:
        """Return the next characters; a backslash and a character stand for one, or for nine spaces."""
        text, out = self.text, []
        for _ in range(count):
            c = text[self.at : self.at + 1]
            if not c:
                raise ValueError("it ends")
            if c == "\\":
                c = {"0": "\0", "n": "\n", "r": "\r", "\\": "\\", "9": "\t"}.get(text[self.at + 1 : self.at + 2], "?")
                self.at += 1
            self.at += 1
            out.append(c)
        return "".join(out)

    def string(self) -> str:
        """Return a short string: its length, then its characters."""
        return self.characters(self.count())


def read_transmit(path: Path) -> Nodes:
    """Read the nodes of a text transmit file, by their numbers; that of 1 is the root.

    Raises
    ------
    ModelError
        If the file cannot be read, is no text transmit file, has no embedded schema, or is damaged.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ModelError(f"{path}: cannot be read: {error.strerror or error}") from None
    text = _body(path, data)
    try:
        return _nodes(text)
    except (ValueError, OverflowError) as error:
        raise ModelError(f"{path}:{text.line()}: it is not a whole transmit file: {error}") from None


def _body(path: Path, data: bytes) -> Text:
    at = data.find(END_OF_HEADER)
    if at < 0:
        raise ModelError(f"{path}: it is no Parasolid transmit file: its header has no line **END_OF_HEADER")
    end = data.find(b"\n", at)
    end = len(data) if end < 0 else end + 1
    if data[end : end + 2] == b"PS" or data[end : end + 1] == b"B":
        raise ModelError(f"{path}: it is a binary transmit file; save the solid as text (.x_t) or as .stl")
    if data[end : end + 1] != b"T":
        raise ModelError(f"{path}: after its header stands no transmit data in text; save the solid again as .x_t")
    first_line = data.count(b"\n", 0, end)
    lines = [line.rstrip(b"\r ") for line in data[end:].split(b"\n")]
    starts, total = [-1] * first_line, 0
    for line in lines:
        starts.append(total)
        total += len(line)
    text = Text(b"".join(lines).decode("latin-1"), starts)
    return text


def _nodes(text: Text) -> Nodes:
    text.at = 1
    text.string()
    schema = text.string()
    if not schema.endswith("_" + BASE_SCHEMA):
        raise ValueError(f"its schema {schema} is not given with it; {RESAVE}")
    text.integer()
    user_fields = text.count()
    layouts: dict[int, tuple[str, tuple[Field, ...]]] = {}
    nodes = Nodes()
    while True:
        number = text.integer()
        if number == TERMINATOR:
            break
        if number not in layouts:
            layouts[number] = _layout(text, number)
        name, fields = layouts[number]
        length = text.count() if fields and fields[-1].size == 1 else 0
        index = text.integer()
        nodes[index] = Node(index, name, {f.name: _value(text, f, length) for f in fields})
        if user_fields and name in VISIBLE:
            for _ in range(user_fields):
                text.integer()
    if 1 not in nodes:
        raise ValueError("it has no root, node 1")
    return nodes


def _layout(text: Text, number: int) -> tuple[str, tuple[Field, ...]]:
    """Return name and fields of a type of node as its first node gives them."""
    count = text.count()
    known = BASE.get(number)
    if count == UNCHANGED:
        if known is None:
            raise ValueError(f"nodes of type {number} are not known; save the solid as .stl")
        return known
    if text.text[text.at : text.at + 1].isdigit():
        name = text.string()
        text.string()
        return name, tuple(_new_field(text) for _ in range(count))
    if known is None:
        raise ValueError(f"nodes of type {number} are not known; save the solid as .stl")
    name, base = known
    fields: list[Field] = []
    at = 0
    while True:
        step = text.characters(1)
        if step == "Z":
            break
        if step in "CD" and at >= len(base):
            raise ValueError(f"{name} is said to have more fields than it has")
        if step == "C":
            fields.append(base[at])
        elif step in "IA":
            fields.append(_new_field(text))
        elif step != "D":
            raise ValueError(f"{step!r} is no change of a schema")
        at += step in "CD"
    if len(fields) != count:
        raise ValueError(f"{name} is said to have {count} fields, but {len(fields)} are given")
    return name, tuple(fields)


def _new_field(text: Text) -> Field:
    name, pointer, count = text.string(), text.integer(), text.count()
    kind = "p" if pointer else text.string()
    if kind not in INTEGERS and kind not in WIDTH and kind not in "cl":
        raise ValueError(f"a field of type {kind!r} is not known")
    if count == 1:
        text.characters(1)
    return Field(name, kind, count)


def _value(text: Text, field: Field, length: int) -> Any:
    kind, count = field.type, length if field.size == 1 else field.size or 1
    if kind in INTEGERS:
        values: Any = [text.integer() for _ in range(count)]
    elif kind in WIDTH:
        values = [text.reals(WIDTH[kind]) for _ in range(count)]
        if kind == "f":
            values = [v[0] for v in values]
    elif kind == "c" and count > 1:
        return text.characters(count)
    else:
        values = [text.characters(1) for _ in range(count)]
    return values if field.size else values[0]


# Fields of the nodes, as the schema 13006 has them, on which embedded schemas build; chapters 2, 5 and 6.
#
# Types of fields: d, n, u integers; p number of a node; f a real number; v, h three, b six, i two of them; c, w a
# character; l a logical value.


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
VISIBLE = frozenset(name for name, fields in BASE.values() if fields[0].name in ("node_id", "highest_node_id"))
"""Types of nodes that user fields follow."""

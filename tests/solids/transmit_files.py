"""Parasolid text transmit files written from faces, edges and vertices, for tests."""

from dataclasses import dataclass, field

from gearmbs.solids.transmit import BASE

HEADER = (
    "**ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz**************************\n"
    "**PART1;\nFORMAT=text;\nGUISE=transmit;\n**PART2;\nSCH=SCH_3000000_30000;\nUSFLD_SIZE=0;\n**PART3;\n"
    "**END_OF_HEADER*****************************************************************\n"
)
NUMBER = {name: number for number, (name, _) in BASE.items()}
VERSION, SCHEMA = ": TRANSMIT FILE created by modeller version 3000000", "SCH_3000000_30000_13006"
FIRST_OF = {"p": 0, "d": 0, "u": 1, "n": 0, "f": None, "v": None, "c": "+", "l": "F", "i": None}


@dataclass
class Solid:
    """A solid: edges as (curve, start, end), faces as (surface, sense, loops); the first as (kind, fields)."""

    vertices: list = field(default_factory=list)
    edges: list = field(default_factory=list)
    faces: list = field(default_factory=list)
    name: str = "SOLID1"
    part: int | None = None


class Writer:
    """Nodes, numbered as they come, and their text."""

    def __init__(self):
        self.nodes = []

    def new(self, kind, **fields):
        self.nodes.append((kind, fields))
        return len(self.nodes)

    def set(self, number, **fields):
        self.nodes[number - 1][1].update(fields)

    def geometry(self, kind, fields):
        """Add a curve or surface; fields that are pairs (kind, fields) become nodes of their own."""
        return self.new(kind, **{key: self._made(value) for key, value in fields.items()})

    def _made(self, value):
        if isinstance(value, list):
            return [self._made(one) for one in value]
        return self.geometry(*value) if isinstance(value, tuple) and isinstance(value[0], str) else value

    def text(self):
        words, seen = [], set()
        for index, (kind, fields) in enumerate(self.nodes, 1):
            number = NUMBER[kind]
            words.append(f"{number} ")
            if number not in seen:
                words.append("255 ")
                seen.add(number)
            layout = BASE[number][1]
            if layout[-1].size == 1:
                words.append(f"{len(fields[layout[-1].name])} ")
            words.append(f"{index} ")
            for f in layout:
                words.append(_value(f, fields.get(f.name)))
        body = f"T{len(VERSION)} {VERSION}{len(SCHEMA)} {SCHEMA}200 0 " + "".join(words) + "1 0 "
        return HEADER + _lines(body)


def _lines(body):
    """Lines of 80 characters, none of which ends in a space."""
    lines = []
    while body:
        end = 80
        while end < len(body) and body[end - 1] == " ":
            end -= 1
        lines.append(body[:end])
        body = body[end:]
    return "\n".join(lines) + "\n"


def _value(layout, value):
    if layout.size == 0:
        values = [FIRST_OF[layout.type] if value is None else value]
    elif value is None:
        values = [FIRST_OF[layout.type]] * layout.size
    elif layout.type == "c":
        return value
    else:
        values = value
    return "".join(_word(layout.type, v) for v in values)


def _word(kind, value):
    if kind in "cl":
        return value
    if value is None:
        return "?"
    if kind in "vhib":
        return "".join(f"{float(x)!r} " for x in value)
    return f"{float(value)!r} " if kind == "f" else f"{value} "


def transmit(*solids):
    """Return the text of a file that holds solids; of several as a list of parts."""
    w = Writer()
    root = w.new("POINTER_LIS_BLOCK", n_entries=len(solids), entries=[]) if len(solids) > 1 else None
    for solid in solids:
        body = _body(w, solid)
        if root is not None:
            w.nodes[root - 1][1]["entries"].append(body)
    return w.text()


def _attribute(w, body, name, kind, values):
    identifier = w.new("ATT_DEF_ID", string=name)
    definition = w.new(
        "ATTRIB_DEF", identifier=identifier, type_id=9000, actions=[0] * 8, legal_owners=["F"] * 14, fields=[3]
    )
    return w.new("ATTRIBUTE", definition=definition, owner=body, fields=[w.new(kind, values=values)])


def _body(w, solid):
    body = w.new("BODY", res_size=1e3, res_linear=1e-8, body_type=1)
    named = _attribute(w, body, "AdamsObjectName", "CHAR_VALUES", solid.name)
    w.set(body, attributes=named)
    if solid.part is not None:
        w.set(named, next=_attribute(w, body, "UG2/ADAMS_ID", "INT_VALUES", [solid.part]))
    void, region = w.new("REGION", body=body, type="V"), w.new("REGION", body=body, type="S")
    shell = w.new("SHELL", body=body, region=region)
    w.set(body, region=void)
    w.set(void, next=region)
    w.set(region, shell=shell)
    vertices = []
    for place in solid.vertices:
        point = w.new("POINT", pvec=place)
        vertices.append(w.new("VERTEX", point=point))
    edges = []
    for curve, start, end in solid.edges:
        number = w.geometry(*curve)
        edge = w.new("EDGE", curve=number, owner=body)
        fins = [w.new("HALFEDGE", edge=edge, sense=s) for s in "+-"]
        w.set(fins[0], other=fins[1], vertex=0 if end is None else vertices[end])
        w.set(fins[1], other=fins[0], vertex=0 if start is None else vertices[start])
        w.set(edge, halfedge=fins[0])
        edges.append((edge, fins))
    last = None
    for surface, sense, loops in solid.faces:
        face = w.new("FACE", shell=shell, surface=w.geometry(*surface), sense=sense)
        w.set(shell if last is None else last, **{"face" if last is None else "next": face})
        last = face
        before = None
        for loop in loops:
            fins = [edges[e][1][0 if forward else 1] for e, forward in loop]
            number = w.new("LOOP", halfedge=fins[0], face=face)
            w.set(face if before is None else before, **{"loop" if before is None else "next": number})
            before = number
            for k, fin in enumerate(fins):
                w.set(fin, loop=number, forward=fins[(k + 1) % len(fins)], backward=fins[k - 1])
    return body


def plane(origin, normal, x):
    """Return a plane."""
    return "PLANE", {"pvec": origin, "normal": normal, "x_axis": x}


def circle(centre, normal, x, radius):
    """Return a circle."""
    return "CIRCLE", {"centre": centre, "normal": normal, "x_axis": x, "radius": radius}


def line(a, b):
    """Return the line from a to b."""
    d = [q - p for p, q in zip(a, b, strict=True)]
    size = sum(x * x for x in d) ** 0.5
    return "LINE", {"pvec": a, "direction": [x / size for x in d]}


def block(x=1.0, y=2.0, z=3.0, at=(0.0, 0.0, 0.0), **more):
    """Return a block from a corner; its top, face 1, may then be given holes."""
    corners = [(at[0] + i * x, at[1] + j * y, at[2] + k * z) for k in (0, 1) for j in (0, 1) for i in (0, 1)]
    solid = Solid(vertices=corners, **more)
    index = {}
    for a, b in [(0, 1), (1, 3), (3, 2), (2, 0), (4, 5), (5, 7), (7, 6), (6, 4), (0, 4), (1, 5), (2, 6), (3, 7)]:
        index[a, b] = (len(solid.edges), True)
        index[b, a] = (len(solid.edges), False)
        solid.edges.append((line(corners[a], corners[b]), a, b))
    for ring, normal, along in [
        ((0, 2, 3, 1), (0, 0, -1), (1, 0, 0)), ((4, 5, 7, 6), (0, 0, 1), (1, 0, 0)),
        ((0, 1, 5, 4), (0, -1, 0), (1, 0, 0)),
        ((2, 6, 7, 3), (0, 1, 0), (1, 0, 0)), ((0, 4, 6, 2), (-1, 0, 0), (0, 1, 0)),
        ((1, 3, 7, 5), (1, 0, 0), (0, 1, 0)),
    ]:  # fmt: skip
        loop = [index[a, ring[(k + 1) % 4]] for k, a in enumerate(ring)]
        solid.faces.append((plane(corners[ring[0]], normal, along), "+", [loop]))
    return solid


def turned(bottom, top, length, side=None, **more):
    """Return a solid of revolution about z from 0: rings of two radii, planes, and a side (surface, sense)."""
    solid = Solid(**more)
    x, z = (1, 0, 0), (0, 0, 1)
    solid.edges = [(circle((0, 0, h), z, x, r), None, None) for h, r in ((0, bottom), (length, top))]
    solid.faces = [
        (plane((0, 0, 0), (0, 0, -1), x), "+", [[(0, False)]]),
        (plane((0, 0, length), z, x), "+", [[(1, True)]]),
        (*(side or cylinder(bottom)), [[(0, True)], [(1, False)]]),
    ]
    return solid


def rounded_cylinder(radius, length, ball):
    """Return a cylinder about z from 0 whose upper edge a ball has rounded."""
    x, z, level = (1, 0, 0), (0, 0, 1), length - ball
    solid = turned(radius, radius, level)
    solid.edges.append((circle((0, 0, length), z, x, radius - ball), None, None))
    top, side = plane((0, 0, length), z, x), cylinder(radius)[0]
    spine = circle((0, 0, level), z, x, radius - ball)
    blend = {"blend_type": "R", "surface": [top, side], "spine": spine, "range": [-ball, -ball], "thumb_weight": [1, 1]}
    solid.faces[1:2] = [(top, "+", [[(2, True)]]), (("BLENDED_EDGE", blend), "+", [[(1, True)], [(2, False)]])]
    return solid


def cylinder(radius):
    """Return the side of a cylinder about z."""
    return ("CYLINDER", {"pvec": (0, 0, 0), "axis": (0, 0, 1), "radius": radius, "x_axis": (1, 0, 0)}), "+"


def drilled(solid, at=(0.5, 1.0), radius=0.3):
    """Return a block with a hole through it along z."""
    heights = sorted({v[2] for v in solid.vertices})
    for h in heights:
        solid.edges.append((circle((*at, h), (0, 0, 1), (1, 0, 0), radius), None, None))
    low, high = len(solid.edges) - 2, len(solid.edges) - 1
    solid.faces[0][2].append([(low, True)])
    solid.faces[1][2].append([(high, False)])
    hole = "CYLINDER", {"pvec": (*at, 0), "axis": (0, 0, 1), "radius": radius, "x_axis": (1, 0, 0)}
    solid.faces.append((hole, "-", [[(high, True)], [(low, False)]]))
    return solid

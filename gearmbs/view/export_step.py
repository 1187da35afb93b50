"""A wheel as a STEP solid (AP214), external or internal, spur or helical, written directly.

The boundary representation needs nothing but the profile's exact edges, so no CAD kernel is called for: every edge of
profile and bore or rim sweeps one face of the solid; see `gearmbs.view.step_faces`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gearmbs.gears import GearPair, GearSpec
from gearmbs.progress import waiting
from gearmbs.view.edges import backwards, bore_edges, profile_edges
from gearmbs.view.files import write_whole
from gearmbs.view.solid import title_of
from gearmbs.view.step_faces import DOWN, UP, Frame, Sweep, Writer, refs, walls


@waiting("writing the solids")
def write_step(gears: GearSpec | GearPair, path: str | Path, *, driver_angle: float = 0.0) -> Path:
    """Write a wheel, or a placed pair as two solids, as a STEP file (AP214, millimetres).

    Parameters
    ----------
    gears : GearSpec or GearPair
        A pair is written with its backlash, centre distance and misalignment, drive flanks touching.
    path : path
    driver_angle : float
        Position of a pair, rad.

    Returns
    -------
    Path

    Raises
    ------
    ValueError
        If the pair has faults of single teeth: those are tabulated, not curves; write them with `write_stl`.
    """
    writer = Writer()
    if isinstance(gears, GearPair):
        if gears.faults:
            raise ValueError(
                "gears: the pair has faults of single teeth, which STEP curves cannot follow; use write_stl, or "
                "with_changes(faults=())"
            )
        placed = zip(gears.wheels, gears.placement(driver_angle).frames)
        solids = [_solid(writer, wheel, *frame) for wheel, frame in placed]
    elif isinstance(gears, GearSpec):
        solids = [_solid(writer, gears, np.zeros(3), np.eye(3))]
    else:
        raise ValueError(f"gears is a {type(gears).__name__}; give a GearSpec or a GearPair")
    name = title_of(gears)
    _product(writer, solids, name)
    header = [
        "ISO-10303-21;",
        "HEADER;",
        "FILE_DESCRIPTION(('gears'),'2;1');",
        f"FILE_NAME('{name}','1970-01-01T00:00:00',(''),(''),'gearmbs','gearmbs','');",
        "FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));",
        "ENDSEC;",
        "DATA;",
    ]
    return write_whole(path, "\n".join([*header, *writer.lines, "ENDSEC;", "END-ISO-10303-21;"]) + "\n")


def _solid(writer: Writer, gear: GearSpec, origin: np.ndarray, axes: np.ndarray) -> int:
    """Write what profile and bore (or rim) sweep in a frame; return the number of the solid."""
    half = 0.5 * gear.face_width
    frame = Frame(writer, origin, axes)
    faces: list[int] = []
    loops: dict[float, list[int]] = {-half: [], half: []}
    toothed = (profile_edges(gear), gear.twist_tangent / gear.base_radius)
    plain = (bore_edges(gear), 0.0)
    chains = [toothed, plain]
    if gear.internal:
        # material lies to the left of every chain, and the outer one comes first
        chains = [(backwards(edges), lead) for edges, lead in (plain, toothed)]
    for edges, lead in chains:
        if edges:
            made, low, high = walls(frame, edges, Sweep(half, lead))
            faces += made
            loops[-half].append(low)
            loops[half].append(high)
    for z, direction in ((-half, DOWN), (half, UP)):
        bounds = [
            writer.add(f"{'FACE_OUTER_BOUND' if k == 0 else 'FACE_BOUND'}('',#{loop},.T.)")
            for k, loop in enumerate(loops[z])
        ]
        plane = writer.add(f"PLANE('',#{frame.axes((0.0, 0.0, z), direction, (1.0, 0.0, 0.0))})")
        faces.append(writer.add(f"ADVANCED_FACE('',{refs(bounds)},#{plane},.T.)"))
    shell = writer.add(f"CLOSED_SHELL('',{refs(faces)})")
    return writer.add(f"MANIFOLD_SOLID_BREP('{gear.name}',#{shell})")


def _product(writer: Writer, solids: list[int], name: str) -> None:
    """Write what makes the solids a product with units."""
    add = writer.add
    length = add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))")
    angle = add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
    steradian = add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")
    accuracy = add(f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-06),#{length},'distance_accuracy_value','')")
    context = add(
        f"(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#{accuracy}))"
        f"GLOBAL_UNIT_ASSIGNED_CONTEXT((#{length},#{angle},#{steradian}))REPRESENTATION_CONTEXT('',''))"
    )
    origin = writer.axes(np.zeros(3), np.array(UP), np.array([1.0, 0.0, 0.0]))
    shape = add(f"ADVANCED_BREP_SHAPE_REPRESENTATION('',{refs([origin, *solids])},#{context})")
    application = add("APPLICATION_CONTEXT('core data for automotive mechanical design processes')")
    add(f"APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,#{application})")
    setting = add(f"PRODUCT_CONTEXT('',#{application},'mechanical')")
    product = add(f"PRODUCT('{name}','{name}','',(#{setting}))")
    formation = add(f"PRODUCT_DEFINITION_FORMATION('','',#{product})")
    stage = add(f"PRODUCT_DEFINITION_CONTEXT('part definition',#{application},'design')")
    definition = add(f"PRODUCT_DEFINITION('design','',#{formation},#{stage})")
    whole = add(f"PRODUCT_DEFINITION_SHAPE('','',#{definition})")
    add(f"SHAPE_DEFINITION_REPRESENTATION(#{whole},#{shape})")

"""A random mechanism, twice: as a command file of View, and built in Python; nothing of one is used for the other."""

from __future__ import annotations

import random

import numpy as np
from scipy.spatial.transform import Rotation

from gearmbs.mechanism import Mechanism

GRAVITY = 9.80665
HEAD = """\
model create model_name = made
defaults units length = mm angle = deg force = newton mass = kg time = sec
defaults units coordinate_system_type = cartesian orientation_type = body313
variable create variable_name = .made.scale real_value = {scale!r}
marker create marker_name = .made.ground.J0 location = 0, 0, 0 orientation = {first}
force create body gravitational gravity_field_name = .made.g x_component_gravity = 0  &
   y_component_gravity = -9806.65 z_component_gravity = 0
"""
LINK = """\
part create rigid_body name_and_position part_name = .made.L{k} location = {origin} orientation = {angles}
defaults coordinate_system default_coordinate_system = .made.L{k}
marker create marker_name = .made.L{k}.I{k} location = 0, 0, 0 orientation = {inner}
marker create marker_name = .made.L{k}.J{k} location = ({length!r} * .made.scale), 0, 0 orientation = {outer}
defaults coordinate_system default_coordinate_system = .made.ground
marker create marker_name = .made.L{k}.cm location = (LOC_RELATIVE_TO(  &
   {{{half!r} * .made.scale, {aside!r}, 0}}, .made.L{k}))  &
   orientation = (ORI_RELATIVE_TO({{0, 0, 0}}, .made.L{k}))
part create rigid_body mass_properties part_name = .made.L{k} mass = {mass!r} center_of_mass_marker = .made.L{k}.cm  &
   ixx = {ixx!r} iyy = {iyy!r} izz = {izz!r}
constraint create joint revolute joint_name = .made.R{k} i_marker_name = .made.L{k}.I{k} j_marker_name = {before}
force create element_like rotational_spring_damper spring_damper_name = .made.S{k} i_marker_name = .made.L{k}.I{k}  &
   j_marker_name = {before} stiffness = {stiffness!r} damping = {damping!r} preload = 0.0 displacement_at_preload = 0.0d
marker create marker_name = .made.ground.A{k} location = {anchor}
force create element_like translational_spring_damper spring_damper_name = .made.T{k} i_marker_name = .made.L{k}.cm  &
   j_marker_name = .made.ground.A{k} stiffness = {line!r} damping = 0.02 preload = 1.5 displacement_at_preload = 80
"""


def numbers(values) -> str:
    """Return numbers as View has them."""
    return ", ".join(repr(float(x)) for x in values)


def made(seed: int) -> tuple[str, Mechanism]:
    """Return the command file of a random chain of hinged links, and the same built in Python."""
    rng = random.Random(seed)
    scale = rng.uniform(0.5, 2.0)
    first = [rng.uniform(-180, 180) for _ in range(3)]
    text = HEAD.format(scale=scale, first=numbers(first))
    m = Mechanism("made", gravity=(0, -GRAVITY, 0))
    at = m.ground.marker((0, 0, 0), orientation=turned(first))
    place, axes, before = np.zeros(3), turned(first), ".made.ground.J0"
    for k in range(1, rng.randint(2, 4)):
        inner, outer = ([rng.uniform(-180, 180) for _ in range(3)] for _ in range(2))
        # the markers of a hinge coincide: the link is turned so that its own is where the one before is
        body = axes @ turned(inner).T
        angles = Rotation.from_matrix(body).as_euler("ZXZ", degrees=True)
        length, aside, mass = rng.uniform(50, 200), rng.uniform(-20, 20), rng.uniform(0.5, 3.0)
        half = rng.uniform(0.2, 0.8) * length
        inertia = [rng.uniform(800, 1200) * mass for _ in range(3)]
        stiffness, damping, line = rng.uniform(0, 50), rng.uniform(0, 5), rng.uniform(0.1, 5)
        anchor = [rng.uniform(-300, 300) for _ in range(3)]
        text += LINK.format(
            k=k, origin=numbers(place), angles=numbers(angles), inner=numbers(inner), outer=numbers(outer),
            length=length, half=half, aside=aside, mass=mass, before=before,
            ixx=inertia[0], iyy=inertia[1], izz=inertia[2],
            stiffness=stiffness, damping=damping, line=line, anchor=numbers(anchor),
        )  # fmt: skip
        com = 1e-3 * np.array([half * scale, aside, 0.0])
        link = m.body(
            f"L{k}",
            mass=mass,
            inertia=tuple(1e-6 * x for x in inertia),
            position=1e-3 * place,
            orientation=body,
            com=com,
        )
        own = link.marker((0, 0, 0), orientation=turned(inner))
        m.revolute(f"R{k}", own, at)
        degree = np.pi / 180.0
        m.torsion_spring(
            f"S{k}", own, at, stiffness=1e-3 * stiffness / degree, damping=1e-3 * damping / degree, angle=0.0
        )
        tied = m.ground.marker(1e-3 * np.array(anchor))
        m.spring_damper(f"T{k}", link.marker(com), tied, stiffness=1e3 * line, damping=20.0, length=0.08, preload=1.5)
        place = place + body @ np.array([length * scale, 0.0, 0.0])
        axes = body @ turned(outer)
        at = link.marker(1e-3 * np.array([length * scale, 0.0, 0.0]), orientation=turned(outer))
        before = f".made.L{k}.J{k}"
    return text, m


def turned(degrees) -> np.ndarray:
    """Return the matrix of body-fixed 313 angles in degrees."""
    return Rotation.from_euler("ZXZ", degrees, degrees=True).as_matrix()

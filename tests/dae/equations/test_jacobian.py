"""The exact Jacobian against central differences at random states, for every joint, element and formulation."""

import numpy as np
import pytest
from scipy.sparse import csc_array

from gearmbs.dae.model.system import FORMULATIONS
from gearmbs.mechanism import Mechanism, harmonic, ramp
from gearmbs.mechanism.parts.joints import JOINTS

RNG = 20240


def two_bodies(rng) -> tuple[Mechanism, object, object]:
    m = Mechanism("pair", gravity=(0.3, -0.2, -9.81))
    bodies = []
    for name in ("one", "two"):
        half = rng.standard_normal((3, 3))
        inertia = half @ half.T + 12.0 * np.eye(3)
        body = m.body(
            name, 1.0 + rng.random(), inertia, position=rng.standard_normal(3), orientation=rng.random(3) + 0.8
        )
        bodies.append(body)
    return m, *bodies


def random_marker(body, rng):
    return body.marker(rng.standard_normal(3), rng.random(3) + 0.5)


def bent_screw(i, j, g, t, pitch):
    """Two rows of all that a law may see."""
    x, y, z = i.position(j)
    turned = i.orientation(j) @ g.axes[:, 1]
    return {
        "advance": z - pitch * i.angle(j) + 0.1 * np.maximum(x, y) ** 3,
        "across": i.origin @ turned - np.sin(2.0 * t) * np.exp(0.1 * j.distance(g)),
    }


def build(kind: str) -> Mechanism:
    rng = np.random.default_rng(RNG)
    m, one, two = two_bodies(rng)
    i, j = random_marker(one, rng), random_marker(two, rng)
    if kind in JOINTS:
        m.joint(kind, "joint", i, j)
    elif kind == "screw":
        m.screw("joint", i, j, pitch=0.3)
    elif kind == "distance":
        m.distance("joint", i, j)
    elif kind == "rotation":
        m.rotation("motion", m.revolute("joint", i, j), ramp(3.0, over=0.7))
    elif kind == "translation":
        m.translation("motion", m.translational("joint", i, j), harmonic(0.2, 3.0))
    elif kind == "coupler":
        a = m.revolute("a", i, j)
        b = m.translational("b", random_marker(one, rng), random_marker(m.ground, rng))
        m.coupler("joint", [(a, 1.3), (b, -0.7)])
    elif kind == "torque":
        m.torque("joint", i, harmonic(5.0, 2.0, 0.3), axis=(1, 2, 3), reaction=two)
    elif kind == "general constraint":
        m.general_constraint("joint", f'DX("{i.name}","{j.name}","{j.name}")*DM("{i.name}") - SIN(3*TIME)')
    elif kind == "law of a constraint":
        m.general_constraint("joint", bent_screw, i, j, random_marker(m.ground, rng), parameters={"pitch": 0.3})
    elif kind == "line force":
        m.line_force("joint", i, j, f'-50*(DM("{i.name}","{j.name}")-1)**3 - 2*VR("{i.name}","{j.name}")')
    elif kind == "axis force":
        m.axis_force("joint", i, random_marker(m.ground, rng), f'TIME*DY("{i.name}","{j.name}")', rm=j)
    elif kind == "axis torque":
        m.axis_torque("joint", i, j, f'-3*WZ("{i.name}","{j.name}","{j.name}")')
    elif kind == "load":
        m.differential_state("lag", f'DZ("{i.name}") - 2*DIF(lag)', 0.3)
        a, b = f'"{i.name}"', f'"{j.name}"'
        m.load("joint", i, j, rm=random_marker(two, rng), fx=f"DX({a},{b})**2", fz=f"VY({a},{b},{a})", ty="DIF(lag)")
    elif kind == "bushing":
        m.bushing("joint", i, j, stiffness=(10, 20, 30), damping=(1, 2, 3), torsional_stiffness=(4, 5, 6))
    elif kind == "spring":
        m.spring_damper("joint", i, j, stiffness=7.0, damping=1.3, length=0.4, preload=0.9)
    elif kind == "torsion":
        m.torsion_spring("joint", i, j, stiffness=7.0, damping=1.3, angle=0.4, preload=0.9)
    elif kind == "field":
        matrices = rng.standard_normal((2, 6, 6))
        m.field("joint", i, j, stiffness=matrices[0], damping=matrices[1], free=range(6), preload=(1, 2, 3, 4, 5, 6))
    elif kind.startswith("friction"):
        name = kind.split()[-1]
        joint = m.joint(name, "pin", i, j)
        lengths = {"pin_radius": 0.3, "friction_arm": 0.2, "bending_arm": 0.4, "ball_radius": 0.3}
        if name in ("translational", "cylindrical"):
            lengths |= {"reaction_arm": 0.6, "overlap": 30.0, "overlap_change": "increasing"}
        by = {"max_stiction_deformation": 0.0 if kind.startswith("friction by speed") else 0.05}
        m.friction("joint", joint, 0.3, 0.2, stiction_transition_velocity=2.3, preload_force=0.4, preload_torque=0.7,
                   yoke="i", **by, **lengths)  # fmt: skip
    elif kind.startswith("reaction"):
        joints = {
            **{f"reaction of a {k} joint": lambda k=k: m.joint(k, "pin", i, j) for k in JOINTS},
            "reaction of a distance": lambda: m.distance("pin", i, j),
            "reaction of a screw": lambda: m.screw("pin", i, j, pitch=0.3),
            "reaction of a motion": lambda: m.rotation("pin", m.revolute("axle", i, j), ramp(3.0, over=0.7)),
        }
        joints[kind]()
        function = {"distance": "GCON", "motion": "MOTION"}.get(kind.split()[-1], "JOINT")
        third = random_marker(two, rng)
        parts = [f'{function}(pin,{side},{c},"{third.name}")' for side, c in ((0, 1), (0, 3), (0, 8), (1, 4), (1, 6))]
        m.axis_torque("joint", random_marker(one, rng), third, " + ".join(parts))
    elif kind == "grounded revolute":
        m.revolute("joint", i, random_marker(m.ground, rng))
    return m


LOADS = [
    "general constraint",
    "line force",
    "axis force",
    "axis torque",
    "load",
    "spring",
    "torsion",
    "bushing",
    "field",
]
REACTIONS = [f"reaction of a {k}" for k in (*(f"{k} joint" for k in JOINTS), "distance", "screw", "motion")]
FRICTIONS = [
    f"friction{by} {k}"
    for k in ("revolute", "translational", "cylindrical", "spherical", "universal")
    for by in ("", " by speed")
]
OTHERS = [
    "law of a constraint",
    "screw",
    "distance",
    "rotation",
    "translation",
    "coupler",
    "torque",
    "grounded revolute",
]
KINDS = [*JOINTS, *LOADS, *REACTIONS, *FRICTIONS, *OTHERS]


def unassembled_problem(m: Mechanism, formulation: str):
    """The tables without the initial-condition analysis: random markers need not fit together."""
    from gearmbs.dae.equations import jacobian
    from gearmbs.dae.equations import layout as T

    system = m.compile()
    idata, rdata, size = system.model.pack(FORMULATIONS[formulation])
    indptr, indices, slots = jacobian.pattern(idata, rdata, size, 0.0, np.zeros(int(idata[T.H_UNKNOWNS])))
    idata, rdata, size = system.model.pack(FORMULATIONS[formulation], slots)
    return idata, rdata, size, indptr, indices, int(idata[T.H_UNKNOWNS])


@pytest.mark.parametrize("formulation", list(FORMULATIONS))
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("code", [0, 1])
def test_jacobian_equals_central_differences(kind, formulation, code):
    from gearmbs.dae.equations import layout as T
    from gearmbs.dae.equations.jacobian import jacobian
    from gearmbs.dae.equations.residual import residual

    idata, rdata, size, indptr, indices, n = unassembled_problem(build(kind), formulation)
    idata[idata[T.H_I_CODE] : idata[T.H_I_CODE] + idata[T.H_BODIES]] = code
    rng = np.random.default_rng(7)
    y, yp, work = rng.standard_normal(n), rng.standard_normal(n), np.zeros(size)
    cj, t = 2.7, 0.31
    vals = np.zeros(indices.size)
    jacobian(t, y, yp, cj, vals, idata, rdata, work)
    exact = csc_array((vals, indices, indptr), shape=(n, n)).toarray()

    def evaluate(dy):
        out = np.zeros(n)
        residual(t, y + dy, yp + cj * dy, out, idata, rdata, work)
        return out

    # central differences of order 4: error about h^4 + eps/h = 1e-12 + 1e-12 for h = 1e-3
    h = 1e-3
    columns = []
    for k in range(n):
        e = np.zeros(n)
        e[k] = h
        columns.append((8 * (evaluate(e) - evaluate(-e)) - (evaluate(2 * e) - evaluate(-2 * e))) / (12 * h))
    np.testing.assert_allclose(exact, np.array(columns).T, atol=2e-8 * max(1.0, np.abs(exact).max()))


def test_quadratic_part_is_the_second_derivative_along_a_motion():
    """d2(phi)/dt2 along R + v t, exp(w t) A (no accelerations), by differences of phi on the moving frames."""
    from gearmbs.dae.model.model import Configuration

    rng = np.random.default_rng(3)
    for kind in KINDS:
        if kind == "torque" or kind in LOADS[1:]:
            continue
        system = build(kind).compile()
        pose = system.pose.copy()
        pose[:, 12:] = rng.standard_normal((2, 6))

        place = Configuration(pose)

        def phi_at(s, system=system, place=place):
            found = system.assembler.at(place.displaced(s * place.velocities), 0.3 + s, None, system.state_start)
            return found.phi[0::3], found.phi[1::3], found.rhs[place.coordinates :]

        h = 1e-3
        values = [phi_at(k * h) for k in (-2, -1, 0, 1, 2)]
        first = (8 * (values[3][0] - values[1][0]) - (values[4][0] - values[0][0])) / (12 * h)
        second = (8 * (values[3][1] - values[1][1]) - (values[4][1] - values[0][1])) / (12 * h)
        np.testing.assert_allclose(values[2][1], first, atol=1e-8, err_msg=kind)
        np.testing.assert_allclose(-values[2][2], second, atol=1e-8, err_msg=kind)

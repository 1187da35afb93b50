"""CONTACT of a deck: solids of GRAPHICS in the deck's units against closed forms and the same contact in Python."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.adams import DeckError, parse_deck, read_deck, run_deck
from gearmbs.mechanism.contacts import Box
from tests.says import says
from tests.solids.transmit_files import block, drilled, transmit

DECK = """contact
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=MILLIMETER, TIME=SECOND
PART/1, GROUND
MARKER/10, PART=1
PART/2, MASS=1, CM=20, IP=400,400,400, QG=0,0,{height}{start}
MARKER/20, PART=2
MARKER/21, PART=2, QP=-10,-20,-30
MARKER/22, PART=2, QP=0,0,-15
{solids}
GRAPHICS/9, OUTLINE = 10, 20
{contact}
ACCGRAV/KGRAV=-9810
REQUEST/1, F2=DZ(20)\\F3=VZ(20)\\F4=CONTACT(1,0,4,0)\\F6=VX(20)\\F7=WY(20)\\F8=DX(20)
END
"""
PLANE = "GRAPHICS/1, PLANE, RM=10"
BALL = "GRAPHICS/2, ELLIPSOID, CM=20, XS=40, YS=40, ZS=40"
IMPACT = "CONTACT/1, IGEOM=2, JGEOM=1, IMPACT, STIFFNESS=1E4, EXPONENT=1.5, DAMPING=20, DMAX=0.1"


def deck(height=20.0, solids=f"{PLANE}\n{BALL}", contact=IMPACT, start=""):
    return DECK.format(height=height, solids=solids, contact=contact, start=start)


def test_a_ball_comes_to_rest_on_a_plane():
    result = run_deck(parse_deck(deck(25.0)), end=1.0, steps=100)
    z, v, force = result.request(1)[-1, [1, 2, 3]]
    # m g = k d^1.5 in N and mm
    assert 20.0 - z == pytest.approx((9.81 / 1e4) ** (2 / 3), rel=1e-4)
    assert abs(v) < 1e-3
    assert force == pytest.approx(9.81, rel=1e-6)
    assert result.force("contact", 1)[-1, 2] == pytest.approx(9.81, rel=1e-6)


def test_a_ball_slides_then_rolls():
    friction = (
        ", COULOMB_FRICTION=ON, MU_STATIC=0.2, MU_DYNAMIC=0.2, STICTION_TRANSITION_VELOCITY=0.5, "
        "FRICTION_TRANSITION_VELOCITY=1"
    )
    contact = "CONTACT/1, IGEOM=2, JGEOM=1, IMPACT, STIFFNESS=1E4, EXPONENT=1, DAMPING=5, DMAX=0.001" + friction
    result = run_deck(parse_deck(deck(20.0 - 9.81e-4, contact=contact, start=", VX=1000")), end=0.4, steps=400)
    v, w = result.request(1)[:, 5], result.request(1)[:, 6]
    t = np.linspace(0.0, 0.4, 401)
    # I/m = 400 mm^2 = R^2
    assert np.abs(v - np.maximum(1000.0 - 0.2 * 9810 * t, 500.0)).max() < 1.0
    assert 20.0 * w[-1] == pytest.approx(v[-1], abs=0.5)


def test_friction_of_slip_alone_and_none():
    rubbing = IMPACT + ", COULOMB_FRICTION=DYNAMICS_ONLY, MU_DYNAMIC=0.2, FRICTION_TRANSITION_VELOCITY=1"
    for contact, expected in ((rubbing, -0.2 * 9.81), (IMPACT + ", NO_FRICTION", 0.0)):
        result = run_deck(parse_deck(deck(20.0, contact=contact, start=", VX=1000")), end=0.1, steps=50)
        assert result.force("contact", 1)[-1, 0] == pytest.approx(expected, rel=1e-3, abs=1e-9)


def test_poisson():
    contact = "CONTACT/1, IGEOM=1, JGEOM=2, POISSON, PENALTY=1E5, RESTITUTION_COEFFICIENT=0.5"
    result = run_deck(parse_deck(deck(120.0, contact=contact)), end=0.28, steps=2800)
    z = result.request(1)[:, 1] - 20.0
    landed = np.flatnonzero(z < 0)[0]
    assert z[landed:].max() == pytest.approx(25.0, rel=0.01)


@pytest.mark.parametrize(
    ("solid", "rests"),
    [
        ("GRAPHICS/2, BOX, CORNER=21, X=20, Y=40, Z=60", 30.0),
        ("GRAPHICS/2, CYLINDER, CM=22, LENGTH=30, RADIUS=10", 15.0),
        ("GRAPHICS/2, FRUSTUM, CM=22, LENGTH=30, TOP=5, BOTTOM=10", 15.0),
        ("GRAPHICS/2, ELLIPSOID, CM=20, XS=40, YS=40, ZS=20", 10.0),
        ("GRAPHICS/2, TORUS, CM=20, MAJOR=20, MINOR=5", 5.0),
        ("GRAPHICS/2, EXTERNAL, RM=20, FILE=box.obj", 15.0),
        ("GRAPHICS/2, EXTERNAL, RM=20, FILE=solids.xmt_txt, ELEMENT=BLOCK", 15.0),
        ("GRAPHICS/2, EXTERNAL, RM=20, FILE=solids.xmt_txt, ELEMENT=TUBE", 15.0),
        ("GRAPHICS/2, POINT, RM=22", 15.0),
    ],
)
@pytest.mark.parametrize(
    "ground", [PLANE, "MARKER/11, PART=1, QP=-500,-500,-500\nGRAPHICS/1,BOX,CORNER=11,X=1000,Y=1000,Z=500"]
)
def test_solids_rest_where_their_surface_is(tmp_path, solid, rests, ground):
    vertices, triangles = Box((20, 20, 30)).facets()
    text = "".join(f"v {x} {y} {z}\n" for x, y, z in vertices)
    (tmp_path / "box.obj").write_text(text + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in triangles))
    if "TUBE" in solid:
        pytest.importorskip("pythoncdt")
    (tmp_path / "solids.xmt_txt").write_text(
        transmit(
            block(0.02, 0.02, 0.03, (-0.01, -0.01, -0.015), name="BLOCK"),
            block(0.01, 0.01, 0.01, name="TUBE", part=7),
            drilled(block(0.02, 0.02, 0.03, (-0.01, -0.01, -0.015), name="TUBE", part=2), (0, 0), 0.004),
        )
    )
    path = tmp_path / "rest.adm"
    path.write_text(deck(rests, solids=f"{ground}\n{solid}"))
    result = run_deck(read_deck(path), end=0.3, steps=30)
    sunk = (9.81 / 1e4) ** (2 / 3)
    assert rests - result.request(1)[-1, 1] == pytest.approx(sunk, rel=0.02)


def test_several_solids_of_a_part_carry_together():
    """Two balls beneath a part, each with its own force: half the weight."""
    solids = (
        f"{PLANE}\nMARKER/30, PART=2, QP=-30,0,-10\nMARKER/31, PART=2, QP=30,0,-10, REULER=90D,90D,0D\n"
        "GRAPHICS/2, ELLIPSOID, CM=30, XS=20, YS=20, ZS=20\nGRAPHICS/3, ELLIPSOID, CM=31, XS=20, YS=20, ZS=20"
    )
    result = run_deck(parse_deck(deck(20.0, solids, IMPACT.replace("IGEOM=2", "IGEOM=2,3"))), end=0.3, steps=30)
    assert 20.0 - result.request(1)[-1, 1] == pytest.approx((0.5 * 9.81 / 1e4) ** (2 / 3), rel=1e-3)


def test_a_switched_contact_lets_fall():
    text = deck(20.0)
    from gearmbs.adams import parse_script

    script = parse_script(
        "t.adm\nSIMULATE/DYNAMICS, END=0.1, STEPS=10\nDEACTIVATE/CONTACT, ID=1\nSIMULATE/DYNAMICS, END=0.2, STEPS=10\n"
    )
    z = run_deck(parse_deck(text), script).request(1)[:, 1]
    assert z[10] == pytest.approx(20.0, abs=0.01)
    assert z[10] - z[-1] == pytest.approx(0.5 * 9810 * 0.01, rel=1e-3)


def test_only_what_touches_is_read():
    parsed = parse_deck(deck())
    assert any("1 GRAPHICS statement ignored" in d.message for d in parsed.diagnostics)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("IGEOM=2", "IGEOM=5"), says("GRAPHICS/5", "IGEOM")),
        (("XS=40", "XQ=40"), says("GRAPHICS/2", "CONTACT", "XQ")),
        (("STIFFNESS=1E4, ", ""), "STIFFNESS is missing for IMPACT"),
        (("IMPACT, ", ""), says("IMPACT", "POISSON", "missing")),
        (("DMAX=0.1", "DMAX=0.1, COULOMB_FRICTION=ON"), "STICTION_TRANSITION_VELOCITY is missing"),
        (("XS=40", "XS=-40"), says("CONTACT/1", "semi_axes", "-0.02", "positive")),
        (("CM=20, XS", "XS"), "CM, RM or CORNER is missing"),
        (("ELLIPSOID, CM=20, XS=40, YS=40, ZS=40", "EXTERNAL, RM=20, FILE=a.xmt_txt"), "put the file beside"),
        (("ELLIPSOID, CM=20, XS=40, YS=40, ZS=40", "EXTERNAL, RM=20, FILE=a.xmt_bin"), says("x_t", "save the solid")),
        (
            ("ELLIPSOID, CM=20, XS=40, YS=40, ZS=40", "EXTERNAL, RM=20, FILE=a.stl"),
            says("CONTACT/1", "a.stl", "No such file"),
        ),
        (("ELLIPSOID, CM=20", "ELLIPSOID, CM=10"), says("both sides")),
        (("PLANE", "CYLINDER, RANGLE=90D"), "only whole solids"),
        (("DMAX=0.1", "DMAX=0.1, NORMAL_FUNCTION=USER(1)"), "NORMAL_FUNCTION is not supported"),
    ],
)
def test_what_is_wrong_is_named(change, message):
    with pytest.raises(DeckError, match=message):
        run_deck(parse_deck(deck().replace(*change)), end=0.1, steps=2)


def test_what_solids_do_without_is_remarked_with_its_own_reason():
    deck = parse_deck("""a plate, and solids on it
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/1, PART=1
GRAPHICS/1, PLANE, RM=1, XMIN=-1, XMAX=1, YMIN=-1, YMAX=1
PART/2, MASS=1, CM=2, IP=1,1,1
MARKER/2, PART=2
GRAPHICS/2, EXTERNAL, RM=2, FILE=ball.stl, FACETING_TOLERANCE=300
GRAPHICS/3, EXTERNAL, RM=2, FILE=ball.xmt_txt, FACETING_TOLERANCE=300
GRAPHICS/4, CYLINDER, CM=2, LENGTH=1, RADIUS=1, FACETING_TOLERANCE=300
CONTACT/1, IGEOM=2,3,4, JGEOM=1, IMPACT, STIFFNESS=1E6, DAMPING=10, EXPONENT=1.5, DMAX=1E-4
END
""")
    remarks = [d.message for d in deck.diagnostics if "without effect" in d.message]
    assert remarks == [
        "GRAPHICS/1: XMIN, XMAX, YMIN, YMAX without effect: a plane that bodies touch has no edges",
        "GRAPHICS/2: FACETING_TOLERANCE without effect: a mesh is as fine as its file",
        "GRAPHICS/3: FACETING_TOLERANCE without effect: a body of a Parasolid file is exact, or is cut within 0.001 of "
        "its diagonal",
        "GRAPHICS/4: FACETING_TOLERANCE without effect: the kind of the solid says into how many facets it is cut, if "
        "any",
    ]

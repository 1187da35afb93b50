"""FE_PART, its markers, and FE_LOAD: closed forms of cantilevers, the same beam in Python, and what is refused."""

import numpy as np
import pytest

from gearmbs.adams import DeckError, parse_deck, parse_script, run_deck
from gearmbs.flexible import BeamSection, add_beam
from gearmbs.mechanism import Mechanism
from tests.says import says

LENGTH, BASE, HEIGHT = 1000.0, 20.0, 10.0
E, DENSITY = 2.0e5, 7.8e-6
IYY, IZZ, IXX, AREA = HEIGHT * BASE**3 / 12, BASE * HEIGHT**3 / 12, 4577.3, BASE * HEIGHT
DECK = """\
cantilever along x
UNITS/FORCE=NEWTON,MASS=KILOGRAM,LENGTH=MILLIMETER,TIME=SECOND
PART/1,GROUND
MARKER/1,PART=1
MATERIAL/7,NAME=steel,DENSITY={density},YOUNGS_MODULUS=2.0E5,POISSONS_RATIO=0.3
MATERIAL/8,YOUNGS_MODULUS_X=1
SECTION/1,TYPE=Solid Rectangular,RECT_BASE=20,RECT_HEIGHT=10,AREA=200
FE_PART/2,TYPE={kind},NODE_LABELS={labels},COORDINATES={nodes},SECTION={sections},MATERIAL=7{extra}
FE_NODE/1,FE_PART=2,LABEL=1,S=0
MARKER/10,FE_PART=2,NODE_LABEL=1{turn}
MARKER/11,FE_PART=2,NODE_LABEL={last},QP=1000,0,0
JOINT/1,FIXED,I=10,J=1
INTEGRATOR/ERROR=1E-7
{rest}
REQUEST/1,DISPLACEMENT,I=11,J=1
END
"""


def deck(rest="", spans=5, density=DENSITY, extra="", **changed):
    labels = range(1, spans + 2)
    fields = {
        "labels": ",".join(map(str, labels)),
        "nodes": ",".join(f"{k},{LENGTH * (k - 1) / spans},0,0,0,0,0" for k in labels),
        "sections": ",".join(f"{k},{AREA},{IYY},{IZZ},0,{IXX}" for k in labels),
        "last": spans + 1,
        "turn": "",
        "kind": "3DBEAM",
    }
    return parse_deck(DECK.format(rest=rest, density=density, extra=extra, **(fields | changed)), "beam.adm")


def tip(rest, script="SIMULATE/STATICS\n", **given):
    result = run_deck(deck(rest, **given), parse_script(script))
    assert result.success, result.messages
    return result.request(1)[-1]


@pytest.mark.parametrize(("component", "moment"), [("FY", IZZ), ("FZ", IYY)])
@pytest.mark.slow
def test_a_small_force_bends_it_by_its_own_moment(component, moment):
    """F L^3 / 3 E I and the shear F L / G A: IYY is about y, so that a force along z bends by it."""
    found = tip(f"GFORCE/1,I=11,JFLOAT=1,RM=1,{component}=1")
    expected = LENGTH**3 / (3 * E * moment) + LENGTH / (E / 2.6 * AREA)
    np.testing.assert_allclose(found[{"FY": 2, "FZ": 3}[component]], expected, rtol=2e-3)


@pytest.mark.slow
def test_a_moment_bends_it_to_a_quarter_of_a_circle():
    turn = np.pi / 2
    torque = turn * E * IZZ / LENGTH
    load, script = f"GFORCE/1,I=11,JFLOAT=1,RM=1,TZ=STEP(TIME,0,0,1,{torque!r})", "SIMULATE/DYNAMICS,END=3,STEPS=3\n"
    found = tip(load, script, extra=",CRATIOK=0.01")
    radius = LENGTH / turn
    np.testing.assert_allclose(found[1:3], [radius, radius], rtol=2e-3)
    finer = tip(load, script, spans=10, extra=",CRATIOK=0.01")
    errors = [np.abs(one[1:3] - radius).max() for one in (found, finer)]
    assert 3.0 < errors[0] / errors[1] < 5.0


@pytest.mark.slow
def test_torsion_and_tension():
    found = tip("GFORCE/1,I=11,JFLOAT=1,RM=1,TX=1000\\FX=1000")
    np.testing.assert_allclose(found[1], LENGTH + LENGTH * 1000 / (E * AREA), rtol=1e-7)
    turned = run_deck(
        deck("GFORCE/1,I=11,JFLOAT=1,RM=1,TX=1000\nREQUEST/2,F2=AX(11,1)"), parse_script("SIMULATE/STATICS\n")
    )
    np.testing.assert_allclose(turned.request(2)[-1][1], 1000 * LENGTH / (E / 2.6 * IXX), rtol=1e-6)


@pytest.mark.slow
def test_distributed_loads():
    """w L^4 / 8 E I of a uniform load, 11 w L^4 / 120 E I of one that grows to the tip."""
    unit = LENGTH**4 / (E * IYY)
    for text, expected in (("1E-3", 1 / 8), ("1E-3*S", 11 / 120)):
        found = tip(f"FE_LOAD/1,FE_PART=2,FZ={text}")
        np.testing.assert_allclose(found[3], 1e-3 * unit * expected, rtol=6e-3)


@pytest.mark.slow
def test_turned_sections_and_frames():
    """Principal axes at 45 degrees through IYZ, and the part turned about x by as much, are the same beam."""
    mean, half = 0.5 * (IYY + IZZ), 0.5 * (IYY - IZZ)
    turned = ",".join(f"{k},{AREA},{mean},{mean},{half},{IXX}" for k in range(1, 7))
    load = "GFORCE/1,I=11,JFLOAT=1,RM=1,FZ=1"
    by_section = tip(load, sections=turned)
    by_frame = tip(load, extra=",REULER=0,-45D,0", turn=",REULER=0,45D,0")
    np.testing.assert_allclose(by_section[1:4], by_frame[1:4], atol=1e-6)
    assert abs(by_section[2]) > 0.1


@pytest.mark.slow
def test_it_swings_as_the_same_beam_in_python_and_goes_on():
    gravity = "ACCGRAV/KGRAV=-9806.65"
    given = deck(gravity, spans=2, extra=",CRATIOK=1E-4")
    result = run_deck(given, parse_script("SIM/DYN,END=0.06,STEPS=6\n"))
    parted = run_deck(given, parse_script("SIM/DYN,END=0.03,STEPS=3\nSIM/DYN,END=0.06,STEPS=3\n"))
    np.testing.assert_allclose(parted.request(1)[-1], result.request(1)[-1], atol=2e-3)
    m = Mechanism("beam", gravity=(0, 0, -9.80665))
    e, g, rho = 2e11, 2e11 / 2.6, 7800.0
    y, z, area = IYY * 1e-12, IZZ * 1e-12, AREA * 1e-6
    section = BeamSection(
        e * area, g * IXX * 1e-12, (e * z, e * y), (g * area,) * 2, rho * area, (rho * y, rho * z, rho * (y + z))
    )
    chain = add_beam(m, "rod", section, (0, 0, 0), (1, 0, 0), elements=8, x_axis=(0, 1, 0), damping_time=1e-4)
    m.fixed("clamp", chain.bodies[0], m.ground, at=(0, 0, 0))
    expected = 1e3 * m.simulate(0.06, t_eval=np.linspace(0, 0.06, 7), tol=1e-8).marker_position(chain.last)
    assert np.ptp(expected[:, 2]) > 1.0
    np.testing.assert_allclose(result.request(1)[:, 1:4], expected, atol=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "along", "out"), [("XY", "FY", 3), ("ZX", "FZ", 2)])
def test_a_plane_beam_bends_in_its_plane_alone(kind, along, out):
    across = "FZ" if along == "FY" else "FY"
    load = f"GFORCE/1,I=11,JFLOAT=1,RM=1,{along}=1"
    plain, flat = (tip(f"{load},{across}=1", kind=name) for name in ("3DBEAM", f"2DBEAM{kind}"))
    assert abs(plain[out]) > 0.1
    assert abs(flat[out]) < 1e-9
    np.testing.assert_allclose(flat[1:4], tip(load)[1:4], atol=1e-6)


def test_a_plane_beam_off_its_plane_is_refused():
    with pytest.raises(DeckError, match=says("TYPE = 2DBEAMYZ", "x")):
        deck(kind="2DBEAMYZ").to_mechanism()


@pytest.mark.slow
def test_results_hold_the_nodes(tmp_path):
    result = run_deck(deck("GFORCE/1,I=11,JFLOAT=1,RM=1,FY=1", spans=2), parse_script("SIMULATE/STATICS\n"))
    nodes = result.nodes(2)
    assert list(nodes) == [1, 2, 3]
    np.testing.assert_allclose(nodes[3][-1, :3], result.request(1)[-1, 1:4], atol=1e-9)
    data = result.to_dataset()
    assert data["fe_part_2"].shape == (result.t.size, 3, 18)
    result.write(tmp_path / "beam")
    text = (tmp_path / "beam.res").read_text()
    assert 'name="FE_PART_2_3_XFORM" entity="FE_PART_2" entType="FE_Part" objectId="2"' in text


def test_a_curved_beam_is_free_of_stress():
    """A quarter of a ring through three nodes stays as it is; its length is that of the arc."""
    angles = np.radians([0.0, 45.0, 90.0])
    nodes = ",".join(
        f"{k},{500 * np.sin(a):.12f},{500 * (1 - np.cos(a)):.12f},0,{a:.15f},0,0" for k, a in enumerate(angles, 1)
    )
    rest = "REQUEST/2,DISPLACEMENT,I=12,J=1\nMARKER/12,FE_PART=2,NODE_LABEL=3,QP=500,500,0"
    text = deck(rest, spans=2, nodes=nodes, extra=",CRATIOK=1E-4")
    mechanism = text.to_mechanism()
    mass = sum(body.mass for body in mechanism.bodies.values())
    # eight chords of 11.25 degrees are shorter than the arc by 1.6e-3
    np.testing.assert_allclose(mass, DENSITY * AREA * 500 * np.pi / 2, rtol=3e-3)
    result = run_deck(text, end=0.02, steps=4)
    np.testing.assert_allclose(result.request(2)[:, 1:4], np.tile([500.0, 500.0, 0.0], (5, 1)), atol=1e-5)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"extra": ",CRATIOM=1"}, "FE_PART/2: CRATIOM is not supported"),
        ({"labels": "1,2,9", "spans": 2}, "COORDINATES has no node 9"),
        ({"nodes": "1,0,0,0"}, "COORDINATES has 4 numbers for 6 NODE_LABELS"),
        ({"sections": "1,200,1,1,0,1"}, "SECTION has no node 2"),
        ({"sections": "1,200,1"}, "SECTION has 3 numbers"),
        ({"nodes": "1,0,0,0,90D,0,0,2,1000,0,0,0,0,0", "spans": 1}, says("x", "axes must lead")),
        ({"density": -1}, says("FE_PART", "positive", "numbers")),
        ({"last": 77}, says("FE_PART/2", "77", "1")),
        ({"rest": "FE_LOAD/1,FE_PART=3,FX=1"}, "there is no FE_PART/3"),
        ({"rest": "FE_LOAD/1,FE_PART=2"}, says("FX", "give at least")),
        ({"rest": "FE_LOAD/1,FE_PART=2,FX=SD(1)"}, says("SD", "nodes")),
    ],
)
def test_what_a_beam_cannot_have_is_named(changed, message):
    with pytest.raises(DeckError, match=message):
        deck(**changed).to_mechanism()


def test_other_beams_are_refused():
    text = DECK.format(
        rest="",
        density=1,
        extra="",
        labels="1,2",
        nodes="1,0,0,0,0,0,0,2,9,0,0,0,0,0",
        sections="1,1,1,1,0,1",
        last=2,
        turn="",
        kind="3DBEAM",
    )
    with pytest.raises(DeckError, match="TYPE = 4DBEAM is not supported"):
        parse_deck(text.replace("3DBEAM", "4DBEAM")).to_mechanism()
    with pytest.raises(DeckError, match="there is no MATERIAL/9"):
        parse_deck(text.replace("MATERIAL=7", "MATERIAL=9")).to_mechanism()
    with pytest.raises(DeckError, match=says("MATERIAL/8", "FE_PART", "YOUNGS_MODULUS_X")):
        parse_deck(text.replace("MATERIAL=7", "MATERIAL=8")).to_mechanism()

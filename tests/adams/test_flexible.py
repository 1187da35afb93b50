"""FLEX_BODY: bodies from modal neutral files in decks, their markers, damping and results."""

import numpy as np
import pytest
from typer.testing import CliRunner

from gearmbs.adams import DeckError, parse_deck, parse_script, read_deck, read_results, reading_from, run_deck
from gearmbs.adams.builders.flexible import has_momentum, modal_ratios
from gearmbs.cli import app
from gearmbs.flexible import Shaft, ShaftSection, mnf_of, read_mnf, reduce_model, write_mnf
from gearmbs.mechanism import Mechanism
from tests.says import says

DECK = """\
bar that swings
UNITS/FORCE=NEWTON,MASS=KILOGRAM,LENGTH=MILLIMETER,TIME=SECOND
PART/1,GROUND
MARKER/10,PART=1,REULER=0,90D,0
MARKER/11,PART=1
FLEX_BODY/1,MATRICES=1,2,MNF_FILE=bar.mnf,REULER=90D,90D,0,CRATIO=STEP(FXFREQ,1000,0.02,20000,0.5)\\
MATRIX/1,FILE=bar.mtx,NAME=GENSTIFF
MATRIX/2,FILE=bar.mtx,NAME=INVAR1
MARKER/100,FLEX_BODY=1,NODE_ID=1,REULER={pivot}
MARKER/101,FLEX_BODY=1,QP=0,0,400
MARKER/102,FLEX_BODY=1,NODE=3
JOINT/1,REVOLUTE,I=100,J=11
ACCGRAV/JGRAV=-9806.65
REQUEST/1,DISPLACEMENT,I=101,J=11
END
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with the file of a bar of 0.4 m along z and a deck that names it."""
    path = tmp_path_factory.mktemp("flexible")
    bar = Shaft([ShaftSection(0.4, 0.004)], seats={"A": 0.0, "B": 0.4}, elements=4, name="bar").model()
    write_mnf(path / "bar.mnf", mnf_of(reduce_model(bar, modes=8).slowest(8)))
    (path / "bar.adm").write_text(DECK.format(pivot="0,90D,0"))
    return path


def by_hand(folder, coupling="partial"):
    """The mechanism of the deck in Python."""
    mnf = read_mnf(folder / "bar.mnf")
    model = mnf.modal_model("bar")
    m = Mechanism("bar", gravity=(0, -9.80665, 0))
    ratios = modal_ratios("STEP(FXFREQ,1000,0.02,20000,0.5)", model.frequencies, mnf.mode_ids[mnf.elastic])
    # z of the body along x, x along y
    axes = np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]])
    body = model.add_to(m, "bar", damping=ratios, coupling=coupling, orientation=axes)
    turned = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    pivot, tip = body.marker(model.place(1), turned, name="pivot"), body.marker(model.place(5), name="tip")
    m.joint("revolute", "pin", pivot, m.ground.marker())
    return m, tip


def test_a_bar_from_a_file_swings_as_the_same_bar_in_python(folder):
    result = run_deck(read_deck(folder / "bar.adm"), end=0.1, steps=20)
    assert result.success
    assert any("all 8 elastic modes of the MNF are taken" in text for text in result.messages)
    m, tip = by_hand(folder)
    expected = m.simulate(0.1, t_eval=np.linspace(0, 0.1, 21), tol=1e-9)
    np.testing.assert_allclose(result.request(1)[:, 1:4], 1e3 * expected.marker_position(tip), atol=2e-4)
    q_f, v_f = result.modal(1)
    np.testing.assert_allclose(q_f, expected.modal_coordinates("bar"), atol=1e-6 * np.abs(q_f).max() + 1e-9)
    assert np.abs(q_f).max() > 0
    assert v_f.shape == q_f.shape == (21, 8)


def test_the_file_of_a_body_in_another_folder_is_read_when_that_is_said(folder, tmp_path):
    text = DECK.format(pivot="0,90D,0").replace("MNF_FILE=bar.mnf", f"MNF_FILE={folder / 'bar.mnf'}")
    (tmp_path / "bar.adm").write_text(text)
    with pytest.raises(DeckError, match=says("FLEX_BODY/1", "MNF_FILE", "bar.mnf", "--read-from")):
        run_deck(read_deck(tmp_path / "bar.adm"), end=0.01, steps=2)
    with reading_from(folder):
        found = run_deck(read_deck(tmp_path / "bar.adm"), end=0.01, steps=2)
    beside = run_deck(read_deck(folder / "bar.adm"), end=0.01, steps=2)
    np.testing.assert_array_equal(found.request(1), beside.request(1))


@pytest.mark.slow
def test_a_plant_reads_from_folders_that_are_named(folder, tmp_path):
    text = DECK.format(pivot="0,90D,0").replace("MNF_FILE=bar.mnf", f"MNF_FILE={folder / 'bar.mnf'}")
    inputs = "VARIABLE/1,FUNCTION=0\nVARIABLE/2,FUNCTION=AZ(100,11)\nPINPUT/1,VARIABLES=1\nPOUTPUT/1,VARIABLES=2\n"
    torque = "SFORCE/1,ROTATION,ACTIONONLY,I=100,J=11,FUNCTION=VARVAL(1)\nEND\n"
    (tmp_path / "bar.adm").write_text(text.replace("END\n", inputs + torque))
    given = ["plant", str(tmp_path / "bar.adm"), "-o", str(tmp_path / "bar.npz")]
    refused = CliRunner().invoke(app, given)
    assert refused.exit_code
    assert "--read-from" in refused.output
    done = CliRunner().invoke(app, [*given, "--read-from", str(folder)])
    assert done.exit_code == 0, done.output
    with np.load(tmp_path / "bar.npz") as found:
        assert found["D"].shape == (1, 1)


@pytest.mark.parametrize(
    ("invariants", "coupling"),
    [("T:T:T:T:T:T:T:T:T", "full"), ("T:T:T:T:F:T:T:T:F", "partial"), ("T:T:T:T:F:T:T:F:F", "constant")],
)
def test_invariants_choose_the_coupling(folder, invariants, coupling):
    text = DECK.format(pivot="0,90D,0").replace(",CRATIO", f",INVARIANTS={invariants},CRATIO", 1)
    built = parse_deck(text, str(folder / "other.adm")).to_mechanism()
    expected = by_hand(folder, coupling)[0].bodies["bar"].modal
    found = next(body.modal for body in built.bodies.values() if hasattr(body, "modal"))
    for name in ("c0", "c1", "j1", "j2"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), rtol=1e-12)


def test_modes_of_a_free_body_have_no_momentum_but_with_lumped_masses(folder):
    bar = Shaft([ShaftSection(0.4, 0.004)], seats={"A": 0.0, "B": 0.4}, elements=4, name="bar").model()
    assert not has_momentum(reduce_model(bar, modes=8))
    assert has_momentum(read_mnf(folder / "bar.mnf").modal_model())


def test_velocity_and_acceleration_of_the_frame_are_those_of_its_place(folder):
    result = run_deck(read_deck(folder / "bar.adm"), end=0.01, steps=500)
    frame = result.flexible(1)
    np.testing.assert_allclose(frame[0, :3], 0, atol=1e-9)
    for place, rate in ((0, 6), (6, 12)):
        found = np.gradient(frame[:, place : place + 3], result.t, axis=0)[250:-1]
        np.testing.assert_allclose(frame[250:-1, rate : rate + 3], found, atol=0.02 * np.abs(found).max())


@pytest.mark.slow
def test_an_analysis_goes_on_from_the_deformed_body(folder):
    deck = read_deck(folder / "bar.adm")
    one = run_deck(deck, parse_script("SIM/DYN,END=0.08,STEPS=8\n"))
    two = run_deck(deck, parse_script("SIM/DYN,END=0.04,STEPS=4\nSIM/DYN,END=0.08,STEPS=4\n"))
    np.testing.assert_allclose(two.request(1)[-1], one.request(1)[-1], atol=5e-3)
    np.testing.assert_allclose(two.modal(1)[0][-1], one.modal(1)[0][-1], atol=1e-3 * np.abs(one.modal(1)[0]).max())


@pytest.mark.slow
def test_results_file_and_data_set_have_the_modal_coordinates(folder, tmp_path):
    result = run_deck(read_deck(folder / "bar.adm"), end=0.02, steps=4)
    result.write(tmp_path / "bar")
    found = read_results(tmp_path / "bar.res")
    np.testing.assert_array_equal(found.t, result.t)
    assert found.units["length"] == "mm"
    modal = found["FLEX_BODY_1_Q"]
    assert modal.components[:2] == ("Q1", "Q2")
    assert modal.components[8] == "QDOT1"
    np.testing.assert_array_equal(modal.values, np.hstack(result.modal(1)))
    np.testing.assert_array_equal(found["FLEX_BODY_1_XFORM"]["X"], result.flexible(1)[:, 0])
    with pytest.raises(KeyError, match=says("result", "'PART_9'")):
        found["PART_9"]
    data = result.to_dataset()
    np.testing.assert_array_equal(data.flex_body_1_modal, result.modal(1)[0])
    whole = (tmp_path / "bar.res").read_text()
    half = whole[: len(whole) // 2]
    for text, message in (
        (half, says(f"bad.res:{half.count(chr(10)) + 1}", "XRF", "cut off")),
        (
            whole.replace("<Step type", "<Step kind", 1).replace("</Step>", "1.0</Step>", 1),
            says("bad.res", "step 1", "50", "49"),
        ),
        ("<a></a>", "no StepMap"),
    ):
        (tmp_path / "bad.res").write_text(text)
        with pytest.raises(DeckError, match=message):
            read_results(tmp_path / "bad.res")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("bar.mnf", "none.mnf", "MNF_FILE = none.mnf: No such file"),
        ("bar.mnf", "mdids://x/bar.mnf", says("file", "give the path")),
        ("MNF_FILE=bar.mnf,", "", "FLEX_BODY/1: MNF_FILE is missing"),
        ("NODE=3", "NODE=77", "there is no node 77"),
        ("NODE=3", "NODE=3,QP=0,0,150", "QP is 50 from node 3"),
        ("NODE=3", "QP=0,0,170", "QP is 30 from node 3"),
        ("STEP(FXFREQ,1000,0.02,20000,0.5)", "0.1*TIME", "changes with time"),
        ("STEP(FXFREQ,1000,0.02,20000,0.5)", "0.1*FREQ", "FREQ"),
        (",CRATIO", ",INVARIANTS=T:T:F:F:F:T:T:F:F,CRATIO", says("other.adm", "FLEX_BODY", "modes have momentum")),
        (",CRATIO", ",INVARIANTS=T:T:F:F:F:F:T:F:F,CRATIO", says("other.adm", "FLEX_BODY", "choose", "supported")),
        ("102,FLEX_BODY=1", "102,FLEX_BODY=7", "there is no FLEX_BODY/7"),
        ("I=100,J=11", "I=100,J=102", "both on FLEX_BODY/1"),
    ],
)
def test_what_a_deck_cannot_have_is_named_with_its_line(folder, old, new, message):
    text = DECK.format(pivot="0,90D,0").replace(old, new, 1)

    def built():
        return parse_deck(text, str(folder / "other.adm")).to_mechanism()

    with pytest.raises(DeckError, match=message) as caught:
        built()
    assert "other.adm:" in str(caught.value)


def test_damping_by_frequency_and_number_of_the_mode():
    numbers = np.array([7, 8, 9])
    found = modal_ratios("IF(FXFREQ-100:0.01,0.02,0.1)", np.array([50.0, 100.0, 500.0]), numbers)
    np.testing.assert_allclose(found, [0.01, 0.02, 0.1])
    np.testing.assert_allclose(modal_ratios("0.01*FXMODE(1)", np.ones(3), numbers), [0.07, 0.08, 0.09])


def test_the_way_that_the_refusal_of_matrices_names_leads_to_a_body(tmp_path):
    """Stiffness and mass with a table of nodes become a neutral file, and that a body of a deck."""
    from gearmbs.flexible import Interface, from_matrices, mnf_of, reduce_model
    from tests.flexible.test_files import cube

    corners, k, m = cube()
    faces = [Interface("foot", [1, 2, 3, 4], "average"), Interface("head", [5, 6, 7, 8], "average")]
    model = reduce_model(from_matrices(k, m, corners), faces)
    write_mnf(tmp_path / "cube.mnf", mnf_of(model))
    deck = tmp_path / "cube.adm"
    text = "cube\nUNITS/FORCE=NEWTON,MASS=KILOGRAM,LENGTH=METER,TIME=SECOND\nPART/1,GROUND\n"
    deck.write_text(text + "FLEX_BODY/2,MATRICES=1,2,3\nMATRIX/1,ROWS=1,COLUMNS=1,VALUES=1\nEND\n")
    with pytest.raises(DeckError, match=r"MATRICES alone.*MNF_FILE = .*write_mnf"):
        read_deck(deck).to_mechanism()
    deck.write_text(text + "FLEX_BODY/2,MNF_FILE=cube.mnf\nMARKER/3,FLEX_BODY=2,NODE_ID=1\nEND\n")
    (body,) = read_deck(deck).to_mechanism().bodies.values()
    np.testing.assert_allclose(body.origin.model.frequencies, model.frequencies, rtol=1e-9)
    np.testing.assert_allclose(body.mass, model.properties.mass, rtol=1e-9)


@pytest.mark.parametrize(
    ("loaded", "force", "torque"), [(101, 0.1, 0.0), (103, 0.1, 0.0), (102, 0.0, 10.0), (103, 0.0, 10.0)]
)
@pytest.mark.slow
def test_markers_on_a_bent_cantilever(tmp_path, loaded, force, torque):
    """Tip deflection and slope of a clamped beam, and the moment at the clamp, by a load at either of two places."""
    bar = Shaft([ShaftSection(0.4, 0.004)], seats={"A": 0.0, "M": 0.2, "B": 0.4}, elements=16, name="bar").model()
    write_mnf(tmp_path / "bar.mnf", mnf_of(reduce_model(bar, modes=8)))
    (tmp_path / "bar.adm").write_text(CANTILEVER.format(loaded=loaded, force=force, torque=torque))
    result = run_deck(read_deck(tmp_path / "bar.adm"), parse_script("a\nb\nSIMULATE/STATICS\n"))
    rigidity = 2.1e11 * np.pi * 0.004**4 / 64.0
    at, bent = (0.2 if loaded == 103 else 0.4), 1e-3 * torque
    tip = force * at**2 / 6.0 * (1.2 - at) + bent * at * (0.4 - at / 2.0)
    slope = force * at**2 / 2.0 + bent * at
    found = result.request(1)[-1]
    # shear adds 5e-5 of the deflection
    assert found[1] == pytest.approx(1e3 * tip / rigidity, rel=2e-4)
    assert found[2] == pytest.approx(slope / rigidity, rel=1e-5)
    assert found[3] == pytest.approx(-(1e3 * force * at + torque), rel=1e-5)


CANTILEVER = """bar
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=MILLIMETER, TIME=SECOND
PART/1,GROUND
MARKER/10,PART=1
MARKER/11,PART=1
MARKER/12,PART=1,FLOATING
FLEX_BODY/1,MATRICES=1,2,MNF_FILE=bar.mnf,CRATIO=0.5
MATRIX/1,FILE=bar.mtx,NAME=GENSTIFF
MATRIX/2,FILE=bar.mtx,NAME=INVAR1
MARKER/100,FLEX_BODY=1,NODE_ID=1
MARKER/101,FLEX_BODY=1,QP=0,0,400
MARKER/102,FLEX_BODY=1,QP=0,0,400,REULER=0,30D,0
MARKER/103,FLEX_BODY=1,QP=0,0,200
JOINT/1,FIXED,I=100,J=11
VFORCE/1,I={loaded},JFLOAT=12,RM=10,FX={force}\\FY=0\\FZ=0
VTORQUE/2,I={loaded},JFLOAT=12,RM=10,TX=0\\TY={torque}\\TZ=0
REQUEST/1,F2=DX(101,10)\\F3=AY(101,10)\\F4=JOINT(1,0,7,10)
END
"""

"""MFORCE, MATRICES and files of matrices in decks: against loads at nodes, against Python, and what is refused."""

import numpy as np
import pytest

from gearmbs.adams import DeckError, parse_deck, run_deck
from gearmbs.adams.parse.data import read_matrices
from gearmbs.flexible import Shaft, ShaftSection, mnf_of, read_mnf, reduce_model, write_mnf
from gearmbs.mechanism import Mechanism, add_modal_force
from tests.says import says

DECK = """\
bar in the wind
UNITS/FORCE=NEWTON,MASS=KILOGRAM,LENGTH=MILLIMETER,TIME=SECOND
PART/1,GROUND
MARKER/11,PART=1
PART/2,MASS=3,CM=20,IP=1000,1000,1000
MARKER/20,PART=2
MARKER/21,PART=2,FLOATING
FLEX_BODY/1,MATRICES=1,2,3,MNF_FILE=bar.mnf,CRATIO=0.02{extra}
MATRIX/1,FILE=bar.mtx,NAME=SELMOD
{loads}
MATRIX/3,FILE=bar.mtx,NAME=GENSTIFF
MARKER/100,FLEX_BODY=1,NODE_ID=1
MARKER/101,FLEX_BODY=1,NODE_ID=5
{forces}
REQUEST/1,DISPLACEMENT,I=101,J=11
INTEGRATOR/ERROR=1E-9
END
"""
CLAMP = "JOINT/1,FIXED,I=100,J=11\n"
MODES = 6


@pytest.fixture(scope="module")
def bar():
    model = Shaft([ShaftSection(0.4, 0.004)], seats={"A": 0.0, "B": 0.4}, elements=4, name="bar").model()
    return reduce_model(model, modes=8)


@pytest.fixture(scope="module")
def folder(tmp_path_factory, bar):
    path = tmp_path_factory.mktemp("modal")
    write_mnf(path / "bar.mnf", mnf_of(bar))
    mnf = read_mnf(path / "bar.mnf")
    rows = "".join(f"{mnf.mode_ids[k]:16.8E}{mnf.eigenvalues[k, 1]:16.8E}\n" for k in mnf.elastic[:MODES])
    load = deck_load(bar)
    (path / "bar.mtx").write_text(
        f"ADAMSMAT modes and loads\n2\nSELMOD MODLOAD\nSELMOD FULL RORDER {MODES} 2 {2 * MODES} (2E16.8)\n{rows}"
        f"MODLOAD FULL CORDER {load.size} 2 {2 * load.size} (3E23.16)\n" + columns(np.r_[0 * load, load])
    )
    return path


def columns(values):
    return "".join("".join(f"{v:23.15E}" for v in values[k : k + 3]) + "\n" for k in range(0, len(values), 3))


def deck_load(bar):
    """A force and a torque at the far end, as a load case in N and N mm; as text the same to the last digit.

    A number of 15 digits survives writing and reading with any number of digits from there on.
    """
    load = bar.selected(np.arange(MODES)).modal_load({5: ((0.3, -0.2, 0.5), (0.0, 0.01, 0.004))})
    return np.array([float(f"{v:.14E}") for v in load * np.r_[1.0, 1.0, 1.0, np.full(3 + MODES, 1e3)]])


def deck(folder, forces, loads="MATRIX/2,FILE=bar.mtx,NAME=MODLOAD", extra=""):
    return parse_deck(DECK.format(forces=forces, loads=loads, extra=extra), str(folder / "modal.adm"))


@pytest.mark.slow
def test_a_load_case_moves_the_bar_as_a_force_at_its_node(folder):
    scale = "0.05*STEP(TIME,0,0,0.02,1)"
    case = run_deck(deck(folder, f"{CLAMP}MFORCE/1,FLEX_BODY=1,CASE_INDEX=2,SCALE={scale}"), end=0.05, steps=25)
    assert case.success
    assert case.modal(1)[0].shape == (26, MODES)
    at_node = run_deck(
        deck(
            folder,
            f"{CLAMP}GFORCE/1,I=101,JFLOAT=21,RM=100,FX=0.3*{scale}\\FY=-0.2*{scale}\\FZ=0.5*{scale}\\TX=0\\"
            f"TY=10*{scale}\\TZ=4*{scale}",
        ),
        end=0.05,
        steps=25,
    )
    found, expected = case.request(1)[:, 1:4], at_node.request(1)[:, 1:4]
    assert np.abs(expected - expected[0]).max() > 0.1
    # they differ by what the bend does to the arm of the load, which is of second order
    np.testing.assert_allclose(found, expected, atol=1.5e-3 * np.abs(expected - expected[0]).max())


@pytest.mark.slow
def test_the_load_is_that_of_python_and_of_a_routine(folder, bar):
    text = "1000*TIME*(1-TIME)"
    with_case = run_deck(deck(folder, f"{CLAMP}MFORCE/1,FLEX_BODY=1,CASE_INDEX=2,SCALE={text}"), end=0.01, steps=10)
    values = ",".join(f"{v!r}" for v in map(float, deck_load(bar)))
    inline = f"MATRIX/2,FULL=CORDER,ROWS={6 + MODES},COLUMNS=1,VALUES={values}"
    inline = f"!    adams_view_name='bar_MODLOAD'\n{inline}"
    in_deck = run_deck(
        deck(folder, f"{CLAMP}MFORCE/1,FLEX_BODY=1,CASE_INDEX=1,SCALE={text}", inline), end=0.01, steps=10
    )
    np.testing.assert_array_equal(in_deck.modal(1)[0], with_case.modal(1)[0])

    def mfosub(call):
        return [call.parameters[0] * 100 * call.time * (1 - call.time), 2]

    routine = run_deck(
        deck(folder, f"{CLAMP}MFORCE/1,FLEX_BODY=1,FUNCTION=USER(10)"), end=0.01, steps=10, routines={"MFOSUB": mfosub}
    )
    np.testing.assert_allclose(routine.modal(1)[0], with_case.modal(1)[0], rtol=1e-6, atol=1e-9)

    def whole(call):
        return 1000 * call.time * (1 - call.time) * call.loads[:, 1]

    direct = run_deck(
        deck(folder, f"{CLAMP}MFORCE/1,FLEX_BODY=1,FORCE=USER(10),ROUTINE=lib::wind"),
        end=0.01,
        steps=10,
        routines={"wind": whole},
    )
    np.testing.assert_allclose(direct.modal(1)[0], with_case.modal(1)[0], rtol=1e-6, atol=1e-9)
    model = read_mnf(folder / "bar.mnf").modal_model("bar").selected(np.arange(MODES))
    m = Mechanism("bar")
    body = model.add_to(m, damping=0.02, coupling="partial")
    m.fixed("clamp", body.marker(model.place(1)), m.ground.marker())
    load = model.modal_load({5: ((0.3, -0.2, 0.5), (0.0, 0.01, 0.004))})
    add_modal_force(m, "wind", body, load, text)
    expected = m.simulate(0.01, t_eval=np.linspace(0, 0.01, 11), tol=1e-8).modal_coordinates("bar")
    np.testing.assert_allclose(with_case.modal(1)[0], expected, atol=1e-4 * np.abs(expected).max())


def test_the_reaction_acts_on_the_part_of_jfloat(folder):
    run = run_deck(deck(folder, "MFORCE/1,FLEX_BODY=1,JFLOAT=21,CASE_INDEX=2,SCALE=0.001"), end=0.01, steps=10)
    # so small a load turns nothing: the part gains the momentum that the body loses
    np.testing.assert_allclose(3 * run.part(2)[-1, 6:9], -np.array([3.0, -2.0, 5.0]) * 0.01 * 1e3 * 1e-4, rtol=5e-3)


def test_modal_coordinates_at_the_start(folder, bar):
    text = ",DMODE=1E-3,0,0,0,0,0,VMODE=0,0,0.2,0,0,0"
    q, v = run_deck(deck(folder, "", extra=text), end=1e-4, steps=2).modal(1)
    np.testing.assert_allclose(q[0], [1e-3, 0, 0, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(v[0], [0, 0, 0.2, 0, 0, 0], atol=1e-12)
    with pytest.raises(DeckError, match=says("DMODE", "2", "6")):
        deck(folder, "", extra=",DMODE=1,2").to_mechanism()


@pytest.mark.parametrize(
    ("force", "message"),
    [
        ("MFORCE/1,FLEX_BODY=7,CASE_INDEX=1,SCALE=1", "there is no FLEX_BODY/7"),
        ("MFORCE/1,CASE_INDEX=1,SCALE=1", "FLEX_BODY is missing"),
        ("MFORCE/1,FLEX_BODY=1,SCALE=1", "CASE_INDEX and SCALE, or FORCE"),
        ("MFORCE/1,FLEX_BODY=1,CASE_INDEX=3,SCALE=1", "CASE_INDEX = 3; MODLOAD has 2 columns"),
        ("MFORCE/1,FLEX_BODY=1,JFLOAT=77,CASE_INDEX=1,SCALE=1", "there is no MARKER/77"),
    ],
)
def test_what_an_mforce_cannot_have_is_named(folder, force, message):
    with pytest.raises(DeckError, match=message):
        deck(folder, force).to_mechanism()


def test_bodies_without_load_cases_say_so(folder):
    text = "MATRIX/2,FILE=bar.mtx,NAME=T_MODE"
    with pytest.raises(DeckError, match=says("matrix MODLOAD", "file")):
        deck(folder, "MFORCE/1,FLEX_BODY=1,CASE_INDEX=1,SCALE=1", text).to_mechanism()
    with pytest.raises(DeckError, match=says("MODLOAD", "2 rows", "force", "6", "12")):
        deck(
            folder, "", "!  adams_view_name='MODLOAD'\nMATRIX/2,FULL=RORDER,ROWS=2,COLUMNS=1,VALUES=1,2"
        ).to_mechanism()
    with pytest.raises(DeckError, match=says("MFOSUB")):
        run_deck(deck(folder, "MFORCE/1,FLEX_BODY=1,FORCE=USER(1)"), end=0.01, steps=1)


FILE = """\
ADAMSMAT Example
2
TRF VALK
TRF FULL RORDER 2 3 6 (3F8.5)
 1.36400 0.00000-3.54600
 4.00800 0.00000 0.79900
VALK FULL CORDER 2 2 4 (2D10.3)
 1.970D+00-3.440D+01
 4.510D+00 6.020D+00
"""


def test_files_of_matrices(tmp_path):
    path = tmp_path / "a.mtx"
    path.write_text(FILE)
    found = read_matrices(path)
    np.testing.assert_array_equal(found["TRF"], [[1.364, 0, -3.546], [4.008, 0, 0.799]])
    np.testing.assert_array_equal(found["VALK"], [[1.97, 4.51], [-34.4, 6.02]])
    for old, new, message in (
        ("ADAMSMAT E", "MATRIXx E", says("a.mtx", "1", "FSAVE", "MATRIXx", "text", "ADAMSMAT", "read")),
        ("ADAMSMAT E", "ADAMSMAT2 E", says("1", "ADAMS")),
        ("ADAMSMAT E", "odd E", says("1", "'odd Example'", "file", "matrices")),
        ("\n2\n", "\n3\n", says("2", "matrices")),
        ("FULL RORDER", "SPARSE RORDER", "line 4: SPARSE RORDER is not read"),
        ("2 3 6", "2 3 7", says("4", "2 3 7", "rows times columns")),
        ("(3F8.5)", "(free)", says("4", "TRF FULL RORDER")),
        ("-3.546", "x3.546", says("5", "'x3.54600'", "17", "24", "number in columns")),
        (" 4.510D+00 6.020D+00\n", "", says("9", "2", "4", "file")),
        (FILE[FILE.index("VALK FULL") :], "", says("7", "VALK", "file")),
    ):
        path.write_text(FILE.replace(old, new, 1))
        with pytest.raises(ValueError, match=message):
            read_matrices(path)
    with pytest.raises(ValueError, match=r"b\.mtx: No such file"):
        read_matrices(tmp_path / "b.mtx")

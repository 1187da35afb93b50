"""Errors in a deck's expressions come before any kernel is compiled, all of them, each with its line."""

import os
import subprocess
import sys

import pytest

from gearmbs.adams import DeckError, parse_deck, parse_script, run_deck
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.grammar import EXPRESSION, specs_of

DECK = """a statement of every kind that has expressions
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
MARKER/10, PART=1
MARKER/11, PART=1, FLOATING
PART/2, MASS=1, CM=20, IP=1,1,1
MARKER/20, PART=2
FLEX_BODY/3, MNF_FILE=absent.mnf, CRATIO={cratio}
MATERIAL/1, YOUNGS_MODULUS=2E11, POISSONS_RATIO=0.3, DENSITY=7800
FE_PART/4, TYPE=3DBEAM, NODE_LABELS=1,2, COORDINATES=1,0,0,0,0,0,0,2,1,0,0,0,0,0, MATERIAL=1
, SECTION=1,25,50,50,0,80,2,25,50,50,0,80
FE_LOAD/1, FE_PART=4, FZ={fz}
JOINT/1, CYLINDRICAL, I=20, J=10
MOTION/1, JOINT=1, ROTATIONAL, FUNCTION={motion}
GCON/1, I=20, FUNCTION={gcon}
VARIABLE/1, FUNCTION={variable}
DIFF/1, FUNCTION={diff}
ARRAY/1, X, SIZE=1
GSE/1, NS=1, X=1, SAMPLE_PERIOD={period}, FUNCTION=USER(1)
SENSOR/1, FUNCTION={sensor}, EQ, VALUE=1, EVALUATE={evaluate}
SFORCE/1, TRANSLATIONAL, I=20, J=10, FUNCTION={sforce}
VFORCE/1, I=20, JFLOAT=11, RM=10, FX={vx}
VTORQUE/1, I=20, JFLOAT=11, RM=10, TX={vtx}
GFORCE/1, I=20, JFLOAT=11, RM=10, FX={gx}, TZ={gtz}
MFORCE/1, FLEX_BODY=3, JFLOAT=11, CASE_INDEX=1, SCALE={scale}
REQUEST/1, F2={f2}\\F3=DX(20,10)\\F4={f4}
END
"""
WRONG = {
    "cratio": "0.01*DZZ(20,10)", "fz": "S*DX(20,99)", "motion": "DX(20,10)", "gcon": "VX(20,10)",
    "variable": "STEP(TIME,0,0,1)", "diff": "SPHERE(1)", "period": "DY(98)", "sensor": "DZZ(20,10)",
    "evaluate": "DX(20,97)", "sforce": "VARVAL(9)", "vx": "AKISPL(TIME,0,5,0)", "vtx": "DIF(7)",
    "gx": "JOINT(5,0,2,0)", "gtz": "ARYVAL(4,1)", "scale": "SENVAL(6)", "f2": "1/0",
    "f4": "2**3*STEP(2,0,0,1,5)*FOO(1)",
}  # fmt: skip
"""What is wrong in each: names, numbers of arguments, what is not there, what may not be asked for."""
RIGHT = {key: "0.1" for key in WRONG} | {"gcon": "DX(20,10)"}

PROGRAM = """
import sys, time
import gearmbs.kernels.jit
def forbidden(*_):
    raise SystemExit("a kernel is wanted")
gearmbs.kernels.jit.Kernel.compile = gearmbs.kernels.jit.Kernel._compile_for_args = forbidden
from gearmbs.adams import DeckError, parse_deck, run_deck
from tests.adams.test_expression_check import DECK, RIGHT, WRONG, gse
run_deck  # loaded
begun = time.process_time()
for key in WRONG:
    deck = parse_deck(DECK.format(**{**RIGHT, key: WRONG[key]}))
    try:
        run_deck(deck, end=1.0, routines=gse)
    except DeckError as error:
        print(key, len(error.diagnostics), error.diagnostics[0].line)
print("each", (time.process_time() - begun) / len(WRONG), file=sys.stderr)
"""


def gse(call):
    return [0.0]


gse = {"GSE_DERIV": gse}


def lines_of(text: str) -> dict[str, int]:
    return {key: n for n, line in enumerate(text.splitlines(), 1) for key in WRONG if f"{{{key}}}" in line}


@pytest.mark.slow
def test_every_expression_is_checked_before_a_kernel_is_compiled(tmp_path):
    given = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", PROGRAM], env=given, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split("\n")[:-1] == [f"{key} 1 {line}" for key, line in lines_of(DECK).items()]
    assert float(done.stderr.split()[-1]) < 1.0


def test_all_errors_are_named_at_once_with_their_lines():
    with pytest.raises(DeckError) as caught:
        run_deck(parse_deck(DECK.format(**WRONG)), end=1.0, routines=gse)
    assert [d.line for d in caught.value.diagnostics] == sorted(lines_of(DECK).values())


def test_the_deck_has_every_kind_of_expression():
    deck = parse_deck(DECK.format(**RIGHT))
    kinds = {cls for cls in st.STATEMENTS.values() if any(s.kind == EXPRESSION for s in specs_of(cls).values())}
    assert kinds <= set(deck.items)


def test_what_a_variable_does_wrong_is_said_once():
    deck = parse_deck(DECK.format(**{**RIGHT, "variable": "DZZ(20)", "sforce": "2*VARVAL(1)", "diff": "VARVAL(1)"}))
    with pytest.raises(DeckError) as caught:
        run_deck(deck, end=1.0, routines=gse)
    assert [d.message.split(":")[0] for d in caught.value.diagnostics] == ["VARIABLE/1"]


def test_errors_that_a_later_command_makes_come_first_too():
    text = DECK.format(**RIGHT)
    script = parse_script(
        "a\nb\nSIMULATE/DYNAMICS, END=1, STEPS=5\nSFORCE/1, FUNCTION=DZZ(1)\nSIMULATE/DYNAMICS, END=2, STEPS=5\n"
    )
    with pytest.raises(DeckError, match=r"<script>:4: error: SFORCE/1: FUNCTION: unknown function DZZ"):
        run_deck(parse_deck(text), script, routines=gse)

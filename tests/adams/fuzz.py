"""Carry mutated decks through everything that a user's deck goes through: ``python -m tests.adams.fuzz``.

Each deck is read, built and its expressions compiled, as before every run; one in a few is run, too. It must end in a
result or in an error with a line, within its time. What does not is printed with its seed, from which
``--only SEED`` makes it again. ``--mild`` changes decks so that most of them can still be run.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import random
import signal
import sys
import time
import traceback
import warnings
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import gearmbs
from gearmbs import kernels
from gearmbs.adams import DeckError, parse_deck, parse_script, run_deck
from gearmbs.adams.builders.routines import bound
from gearmbs.adams.session import check_script

from . import (
    test_accelerations,
    test_contacts,
    test_couplers,
    test_curves,
    test_flexible,
    test_held_bodies,
    test_linear_systems,
    test_passages,
    test_plant,
    test_redundancy,
    test_routines,
    test_sensors,
    test_user_elements,
)
from .decks import EVERYTHING, PENDULUM, SCRIPT
from .mild_changes import mildly_changed
from .mutations import mutated

SECONDS = 20
"""Of processor time in which a deck must be done."""
CHECKED = "m\no\nSIMULATE/DYNAMICS, END=0.002, STEPS=2\n"
IMPLICIT = "DIFF/1, IMPLICIT, IC=0.5, FUNCTION=DIF1(1)+DIF1(1)**3-COS(TIME)+DIF(1)\nREQUEST/1, F2=DIF1(1)\n"
RUNS = [
    CHECKED, "m\no\nSIMULATE/KINEMATICS, END=0.002, STEPS=2\n", "m\no\nSIMULATE/STATICS\n", "m\no\nLINEAR/EIGENSOL\n",
    "m\no\nLINEAR/STATEMAT, PINPUT=1, POUTPUT=1\n",
    "m\no\nSIMULATE/STATICS, END=0.002, STEPS=2\n", "m\no\nSIMULATE/INITIAL_CONDITIONS\n",
    "m\no\nSIM/DYN, END=0.001, STEPS=1\nDEACT/JOINT, RANGE=1,3\nSIM/DYN, END=0.002, STEPS=1\n",
]  # fmt: skip

LONGER = "m\no\nSIMULATE/DYNAMICS, END=0.05, STEPS=5\n"
MILD_RUNS = [*[CHECKED] * 3, LONGER, *RUNS[2:4], *RUNS[6:]]
"""Those that most decks allow."""
SMALL = 3000
"""Characters of a deck that is built and run in some hundredths of a second."""
RUNNING = 3
"""Place in the corpus of the deck with most kinds of statements that can be run."""


TOUCHING = ("open", "os.remove", "os.rename", "os.mkdir", "os.system", "subprocess.Popen", "os.exec", "socket.connect")
"""What a program does to the world, as Python tells its auditors."""
_touched: list[str] = []
_watching = False


def _folders_of_kernels() -> tuple[Path, ...]:
    """Return where the kernels of the package are kept, in whichever mode they are compiled."""
    if kernels.PLAIN:
        from gearmbs.kernels.plain.jit import folder

        return (folder("gearmbs"),)
    from gearmbs.kernels.cache import folders

    return folders("gearmbs")


@cache
def _own() -> tuple[str | Path, ...]:
    """Return Python's own folders and those of kernels, which a deck may cause to be touched."""
    package = Path(gearmbs.__file__).parent
    found = [sys.prefix, sys.base_prefix, package, "/proc", "/dev/null", *_folders_of_kernels()]
    return (*found, *([os.environ["NUMBA_CACHE_DIR"]] if "NUMBA_CACHE_DIR" in os.environ else []))


def _audit(event: str, arguments: tuple) -> None:
    """Note what is run, and which file is opened, while a deck is carried through.

    `_own` folders are excepted, and what the deck's folder holds may be read.
    """
    if not _watching or event not in TOUCHING or isinstance(arguments[0], int):
        return
    own = list(_own())
    if event == "open" and "w" not in str(arguments[1]):
        own.append(Path.cwd())
    place = Path(os.fsdecode(arguments[0])).absolute()
    if event in TOUCHING[4:] or not any(place.is_relative_to(folder) for folder in own):
        _touched.append(f"{event} {arguments[0]}")


sys.addaudithook(_audit)


@contextlib.contextmanager
def watched() -> Iterator[None]:
    """Refuse that a deck touches a file, a process or a connection.

    Raises
    ------
    AssertionError
    """
    global _watching
    _touched.clear()
    # beforehand: to find the folders of kernels makes them, which is noted, too
    _own()
    _watching = True
    try:
        yield
    finally:
        _watching = False
    if _touched:
        raise AssertionError(f"a deck touches {', '.join(_touched)}")


class Slow(Exception):
    """A deck took too long."""


def without(deck: str, *heads: str) -> str:
    """Return a deck without some of its statements."""
    whole = deck.replace("\n,", "\r,").split("\n")
    kept = [line for line in whole if not line.startswith(tuple(f"{h}," for h in heads))]
    return "\n".join(kept).replace("\r,", "\n,")


@cache
def corpus() -> list[str]:
    """Return decks that run, of all kinds of statements."""
    curves = test_curves
    cam = "CURVE/1, CLOSED, CURVE_POINTS, MATRIX=1\nPTCV/1, I=30, CURVE=1, RM=20, JFLOAT=32"
    turned = {"height": 50.0, "mass": curves.MASS, "speed": curves.SPEED, "g": curves.G}
    unbuilt = (
        "TFSISO/1",
        "JOINT/6",
        "JOINT/10",
        "JPRIM/4",
        "GEAR/1",
        "TIRE/1",
        "GSE/1",
        "FLEX_BODY/1",
        "MFORCE/1",
        "FE_PART/1",
        "FE_LOAD/1",
    )
    built = without(EVERYTHING, *unbuilt)
    locked = *(f"JOINT/{k}" for k in range(2, 12)), "JPRIM/1", "JPRIM/2", "JPRIM/3", "COUPLER/1", "GCON/1", "MOTION/1"
    runs = without(built, *locked, "PTCV/1", "CVCV/1")
    solids = [
        "GRAPHICS/2, BOX, CORNER=21, X=20, Y=40, Z=60", "GRAPHICS/2, CYLINDER, CM=22, LENGTH=30, RADIUS=10",
        "GRAPHICS/2, FRUSTUM, CM=22, LENGTH=30, TOP=5, BOTTOM=10", "GRAPHICS/2, TORUS, CM=20, MAJOR=20, MINOR=5",
    ]  # fmt: skip
    rubbing = test_contacts.IMPACT + (
        ", COULOMB_FRICTION=ON, MU_STATIC=0.2, MU_DYNAMIC=0.2, STICTION_TRANSITION_VELOCITY=0.5, "
        "FRICTION_TRANSITION_VELOCITY=1"
    )
    sensors = [
        "SENSOR/1, LE, VALUE=9.99999, FUNCTION=DZ(20), EVALUATE=50 + 0*DZ(20), RETURN",
        "SENSOR/1, GE, VALUE=0.001, FUNCTION=TIME, CODGEN, RESTART, STEPSIZE=1E-5, YYDUMP, PRINT, DT=1E-4",
    ]
    return [
        *[PENDULUM] * 4, EVERYTHING, *[built] * 4, *[runs] * 3, test_contacts.deck(),
        test_contacts.deck(contact=rubbing),
        *(test_contacts.deck(solids=f"{test_contacts.PLANE}\n{s}") for s in solids),
        curves.DECK.format(touch=cam, matrices=curves.matrix(1, curves.circle(50.0, 20.0)), **turned),
        test_linear_systems.HEAD + test_linear_systems.SYSTEM + "END\n",
        test_linear_systems.HEAD + test_linear_systems.LOOP.format(force="ARYVAL(3,1)") + "END\n",
        test_accelerations.DECK.format(extra=test_accelerations.ASKED),
        test_passages.DECK.format(x=0.8, y=0.6, end=1.6, rod=1.0, start=1.6, stroke=1.0),
        test_user_elements.HEAD + test_user_elements.CART + test_user_elements.LOOP + test_user_elements.GSE + "END\n",
        test_couplers.DECK.format(coupler="JOINTS=1,2,3, TYPE=T:R:T, SCALES=1,-250,2"),
        test_held_bodies.HEAD + test_held_bodies.POINT + "END\n",
        test_held_bodies.HEAD + test_held_bodies.PLATE.format(extra=", PLANAR, WZ=0.2") + "END\n",
        test_user_elements.HEAD + test_user_elements.CART + IMPLICIT + "END\n",
        test_plant.SPRING,
        test_flexible.DECK.format(pivot="0,90D,0"),
        test_redundancy.DOOR, test_redundancy.PARALLEL,
        test_routines.DECK.format(force=test_routines.PULLED.format("USER(0.3, 0.01, 2)")),
        *(test_sensors.DECK.format(sensor=s, start=", QG=0,0,10") for s in sensors),
    ]  # fmt: skip


@cache
def running() -> list[str]:
    """Return the small decks of the corpus, each once."""
    decks = list(dict.fromkeys(corpus()))
    return [deck for deck in decks if len(deck) < SMALL] + [decks[RUNNING]]


def carried_through(deck: str, script: str, rng: random.Random, run: bool) -> str:
    """Read, build and perhaps run; return what came of it.

    Raises
    ------
    AssertionError
        If an error names no place.
    """
    skip = rng.random() < 0.7
    routines = {
        "SFOSUB": test_routines.pull,
        "GSE_DERIV": test_user_elements.deriv,
        "GSE_OUTPUT": test_user_elements.output,
    }
    checked = False
    try:
        parsed = bound(parse_deck(deck, "fuzz"), routines, skip)
        commands = parse_script(script, "fuzz")
        check_script(parsed, commands, skip)
        checked = True
        if run:
            result = run_deck(parsed, commands, allow_unsupported=skip, routines=routines)
            assert result.success or result.messages
            return "ran" if result.success else "stopped"
        return "built"
    except DeckError as error:
        placed = [d.message and d.line >= 0 for d in error.diagnostics]
        if not placed or not all(placed):
            raise AssertionError(f"an error without a place: {error.diagnostics}") from error
        return "stopped" if checked else "refused"


def case(seed: int, share: float, mild: bool = False) -> tuple[str, str, random.Random, bool]:
    """Return deck, script, generator and whether it is run, of a seed."""
    rng = random.Random(seed)
    if mild:
        deck = mildly_changed(rng.choice(running()), rng)
        return deck, rng.choice(MILD_RUNS), rng, rng.random() < share
    deck = mutated(rng.choice(corpus()), rng)
    run = rng.random() < share
    if rng.random() < 0.1:
        return deck, mutated(SCRIPT, rng), rng, False
    return deck, rng.choice(RUNS) if run else CHECKED, rng, run


@contextlib.contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raise `Slow` after some processor time."""

    def late(*_: object) -> None:
        raise Slow(f"longer than {seconds} s")

    signal.signal(signal.SIGPROF, late)
    # again and again: one that is raised within a user's function may be taken for that function's error
    signal.setitimer(signal.ITIMER_PROF, seconds, 1.0)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)


def outcome(seed: int, share: float, seconds: float = SECONDS, mild: bool = False) -> str:
    """Carry the deck of a seed through; return what came of it, a traceback if it failed."""
    deck, script, rng, run = case(seed, share, mild)
    try:
        with watched(), limited(seconds), contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
            warnings.simplefilter("error")
            return carried_through(deck, script, rng, run)
    except Slow as late:
        return f"slow\n{late}"
    except Exception:
        return "failed\n" + traceback.format_exc()


def main() -> None:
    """Carry many decks through; print what failed, and how many ended how."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--share", type=float, default=0.1, help="share of the decks that are run")
    parser.add_argument("--mild", action="store_true", help="change decks so that most can still be run")
    parser.add_argument("--only", type=int, help="carry one seed through, and print its deck")
    given = parser.parse_args()
    if given.only is not None:
        deck, script, _, run = case(given.only, given.share, given.mild)
        print(deck, script, f"run: {run}", outcome(given.only, given.share, mild=given.mild), sep="\n")
        return
    for deck in corpus() if given.share > 0.0 else ():
        for script in RUNS:
            # what is compiled now takes no deck's time
            carried_through(deck, script, random.Random(0), True)
    counts: dict[str, int] = {}
    began = time.process_time()
    for seed in range(given.first, given.first + given.count):
        print(seed, file=sys.stderr, end="\r", flush=True)
        found = outcome(seed, given.share, mild=given.mild)
        word = found.split("\n", 1)[0]
        counts[word] = counts.get(word, 0) + 1
        if word in ("failed", "slow"):
            print(f"seed {seed}: {found.strip()}\n", flush=True)
        if (seed + 1 - given.first) % 1000 == 0:
            print(seed + 1, counts, f"{time.process_time() - began:.0f} s", flush=True)
    print("end", counts, f"{time.process_time() - began:.0f} s of processor time", flush=True)


if __name__ == "__main__":
    main()

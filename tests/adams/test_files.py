"""Files that decks, scripts and command files name: those of their folder, and of folders that are added."""

from __future__ import annotations

import pytest

from gearmbs.adams import DeckError, parse_deck, parse_view, read_script, reading_from, run_deck
from tests.says import says

from . import test_contacts

MESH = "v 0 0 0\nv 10 0 0\nv 0 10 0\nv 0 0 10\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
MATRIX = "ADAMSMAT\n1\nM\nM FULL RORDER 1 1 1 (1F8.5)\n 2.00000\n"
LOADED = """loaded
UNITS/FORCE=NEWTON, MASS=KILOGRAM, LENGTH=METER, TIME=SECOND
PART/1, GROUND
PART/2, MASS=1, CM=20, IP=1,1,1
MARKER/20, PART=2
MATRIX/1, FILE={file}, NAME=M
ARRAY/1, X
LSE/1, X=1, A=1
END
"""


def script(home, file):
    (home / "first.acf").write_text(f"m\no\nFILE/COMMAND={file}\n")
    return read_script(home / "first.acf").commands


def deck(home, file):
    """A deck of which a file is read where it is built."""
    if "mesh" in file:
        text = test_contacts.deck(solids=f"{test_contacts.PLANE}\nGRAPHICS/2, EXTERNAL, RM=20, FILE={file}")
    else:
        text = LOADED.format(file=file)
    return run_deck(parse_deck(text, str(home / "m.adm")), end=0.001, steps=1, check=False).segments


def commands(home, file):
    text = f'model create model_name = m\nfile command read file_name = "{file}"\n'
    return parse_view(text, folder=home).deck


@pytest.mark.parametrize(
    ("name", "text", "read"),
    [
        ("other.acf", "SIMULATE/DYNAMICS, END=1, STEPS=1\n", script),
        pytest.param("mesh.obj", MESH, deck, marks=pytest.mark.slow),
        pytest.param("matrix.txt", MATRIX, deck, marks=pytest.mark.slow),
        ("other.cmd", "defaults units length = mm\n", commands),
    ],
    ids=["script", "mesh", "matrix", "commands"],
)
def test_a_file_outside_the_folder_is_read_when_that_is_said(tmp_path, name, text, read):
    home = tmp_path / "home"
    (home / "below").mkdir(parents=True)
    for folder in (tmp_path, home / "below"):
        (folder / name).write_text(text)
    assert read(home, f"below/{name}")
    for outside in (f"../{name}", str(tmp_path / name)):
        with pytest.raises(DeckError, match=says(outside, "outside the folder", "--read-from")):
            read(home, outside)
        with reading_from(tmp_path):
            assert read(home, outside)

"""A command file, a deck or a script given to another door: it is told what it is, or taken."""

from __future__ import annotations

import numpy as np
import pytest

from gearmbs.adams import (
    DeckError,
    build_mechanism,
    parse_deck,
    parse_script,
    parse_view,
    read_deck,
    read_results,
    read_view,
    run_deck,
)
from gearmbs.flexible import read_mnf
from gearmbs.signals import read_signal
from gearmbs.studies import load_case
from tests.says import says

from .files import PENDULUM

SCRIPT = "p\np\nSIMULATE/DYNAMICS, END=0.1, STEPS=2\n"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "p.cmd").write_text(PENDULUM)
    (tmp_path / "p.adm").write_text(parse_view(PENDULUM).text)
    (tmp_path / "p.acf").write_text(SCRIPT)
    return tmp_path


def test_a_mechanism_is_built_of_whatever_holds_a_model(folder):
    of_deck = build_mechanism(read_deck(folder / "p.adm"))
    for given in (folder / "p.cmd", str(folder / "p.adm"), read_view(folder / "p.cmd")):
        built = build_mechanism(given)
        assert list(built.bodies) == list(of_deck.bodies)
        assert np.allclose(built.bodies["ROD"].com, of_deck.bodies["ROD"].com, rtol=0, atol=1e-12)


@pytest.mark.parametrize("parser", [parse_deck, parse_script])
def test_commands_of_view_are_told_from_those_of_the_solver(parser):
    with pytest.raises(DeckError, match=says("View", "read_view")):
        parser(PENDULUM)


@pytest.mark.parametrize("name", ["p.adm", "p.acf"])
def test_files_of_the_solver_are_told_from_those_of_view(folder, name):
    with pytest.raises(DeckError, match=says("solver", "View", "run_deck")):
        read_view(folder / name)


def test_a_script_is_no_deck(folder):
    with pytest.raises(DeckError, match=says("acf", "adm", "first")):
        run_deck(folder / "p.acf")
    assert run_deck(folder / "p.adm", folder / "p.acf").success


@pytest.mark.parametrize("door", [load_case, read_signal, read_mnf, read_results])
@pytest.mark.parametrize("name", ["p.cmd", "p.acf"])
def test_doors_for_other_files_say_what_a_file_of_adams_is(folder, door, name):
    with pytest.raises(ValueError, match=says("ADAMS", "`gearmbs adams", name)):
        door(folder / name)


def test_a_file_of_another_kind_is_not_taken_for_one(folder):
    (folder / "p.txt").write_text(PENDULUM)
    with pytest.raises(ValueError) as caught:
        load_case(folder / "p.txt")
    assert "ADAMS" not in str(caught.value).replace(str(folder), "")

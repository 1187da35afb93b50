"""Mutated, truncated and random decks give a deck, a result or an error with a line; nothing else."""

from __future__ import annotations

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gearmbs.adams import Deck, DeckError, Script, parse_deck, parse_script
from gearmbs.adams.parse.reader import read_text

from . import fuzz
from .decks import EVERYTHING, PENDULUM, SCRIPT
from .mutations import SPICE, characters, mutated


def outcome(parser, text: str) -> None:
    """Parse; an error must name at least one place."""
    try:
        result = parser(text, "fuzz")
    except DeckError as error:
        result = error
    if isinstance(result, DeckError):
        assert result.diagnostics
        assert all(d.line >= 0 and d.message and d.file == "fuzz" for d in result.diagnostics)
        assert str(result).startswith("fuzz:")
    else:
        assert isinstance(result, (Deck, Script))


def run(cases: int, seed: int) -> None:
    rng = random.Random(seed)
    for _ in range(cases):
        text = PENDULUM if rng.random() < 0.7 else EVERYTHING
        for _ in range(rng.randint(1, 6)):
            text = characters(text, rng)
        outcome(parse_deck, text)
        outcome(parse_script, mutated(SCRIPT, rng, 6))


@pytest.mark.slow
def test_mutated_decks():
    run(1200, 1)


@pytest.mark.slow
@pytest.mark.hunt
def test_mutated_decks_in_tens_of_thousands():
    run(40_000, 2)


@pytest.mark.slow
@pytest.mark.parametrize("seeds", [range(0, 200), range(200, 400), range(400, 600)], ids=str)
def test_mutated_decks_are_built_or_refused(seeds):
    """A slice of what ``python -m tests.adams.fuzz`` carries through."""
    failed = {seed: found for seed in seeds if (found := fuzz.outcome(seed, 0.0)).startswith("failed")}
    assert not failed


@pytest.mark.slow
def test_mutated_decks_run_or_end_with_an_error():
    failed = {seed: found for seed in range(1000, 1030) if (found := fuzz.outcome(seed, 1.0)).startswith("failed")}
    assert not failed


@pytest.mark.slow
def test_mildly_changed_decks_run_or_end_with_an_error():
    """A slice of ``python -m tests.adams.fuzz --mild --share 1``: most are run to their end."""
    found = [fuzz.outcome(seed, 1.0, mild=True) for seed in range(150)]
    assert not [one for one in found if one.startswith(("failed", "slow"))]
    assert found.count("ran") > 75


def test_every_truncation_of_a_deck():
    for cut in range(0, len(PENDULUM), 3):
        outcome(parse_deck, PENDULUM[:cut])
    for cut in range(len(SCRIPT)):
        outcome(parse_script, SCRIPT[:cut])


@pytest.mark.slow
@settings(max_examples=300, deadline=None, derandomize=True)
@given(st.one_of(st.text(max_size=200), st.lists(st.sampled_from([*SPICE, "MARKER/1", "QP=", "JOINT"])).map("".join)))
def test_random_text(text):
    outcome(parse_deck, "title\n" + text)
    outcome(parse_script, text)


@pytest.mark.slow
@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.binary(max_size=200))
def test_random_bytes(data):
    outcome(parse_deck, read_text(data))


@pytest.mark.slow
def test_long_deck_reads_in_linear_time():
    parts = [
        f"PART/{k}, MASS=1, CM={10 * k}, IP=1,1,1\nMARKER/{10 * k}, PART={k}\nMARKER/{10 * k + 1}, PART={k}, QP=1,0,0"
        for k in range(2, 1002)
    ]
    joints = [f"JOINT/{k}, REVOLUTE, I={10 * k + 10}, J={10 * k + 1}" for k in range(2, 1001)]
    deck = parse_deck("chain\nUNITS/SYSTEM=MKS\nPART/1,GROUND\n" + "\n".join(parts + joints) + "\nEND\n")
    assert sum(1 for _ in deck) == 1 + 1 + 3000 + 999

"""A slice of ``python -m tests.adams.view.fuzz``: mutated files end in a deck, a run or an error with a line."""

from __future__ import annotations

import random

import pytest

from gearmbs.adams.view.lexer import ViewError, commands

from . import fuzz


@pytest.mark.slow
def test_mutated_files_are_built_or_refused():
    with fuzz.folder_for_files() as folder:
        found = {seed: fuzz.outcome(seed, 0.0, folder) for seed in range(400)}
    assert not {seed: word for seed, word in found.items() if word.startswith(("failed", "slow", "opened"))}
    assert sum(word == "built" for word in found.values()) > 40


def test_any_characters_are_commands_or_errors():
    rng = random.Random(3)
    for _ in range(300):
        text = "".join(rng.choice("ab =,(){}[]\"'!&\n.1$") for _ in range(rng.randint(0, 60)))
        for one in commands(text):
            assert isinstance(one, ViewError) or one.words


def test_every_truncation_is_read_or_refused():
    for cut in range(0, len(fuzz.PENDULUM), 5):
        list(commands(fuzz.PENDULUM[:cut]))

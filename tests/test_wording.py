"""What all messages say alike is said by one function each, and tests hold no sentences of them."""

import ast
import re
from pathlib import Path

import numpy as np
import pytest

import gearmbs
from gearmbs.files import json_value, python_scalar
from gearmbs.wording import any_of, closest, did_you_mean
from tests.says import fitting, prose, raisable, says

PACKAGE = Path(gearmbs.__file__).parent
LONGEST = 3
"""Words beside names and values that a test may ask of a message: "not a rotation", "give a positive"."""
BROADEST = 3
"""Texts of the package that a pattern may fit: one, and those that say the same of another kind of part."""


def sources(pattern):
    """Return the modules in whose source a pattern stands."""
    word = re.compile(pattern)
    found = sorted(PACKAGE.rglob("*.py"))
    return {path.relative_to(PACKAGE).as_posix() for path in found if word.search(path.read_text(encoding="utf-8"))}


def test_one_function_asks_what_was_meant():
    assert sources(r"difflib") == {"wording.py"}
    # a unit belongs to its number; a key of a case is looked for in other sections, too; an ending is no slip
    others = {"units.py", "studies/case/section.py", "studies/run/sweep.py"}
    assert sources(r"did you mean ") - {"wording.py"} <= others


def test_one_function_makes_values_for_json():
    assert sources(r"def _?(plain|json_value)\(") == {"files.py"}
    assert sources(r"\.item\(\) if isinstance\(\w+, np\.generic\)") == {"files.py"}


@pytest.mark.parametrize(
    ("name", "options", "expected"),
    [
        ("sped", {}, "did you mean speed?"),
        ("sped", {"before": "; ", "shown": repr}, "; did you mean 'speed'?"),
        ("speek", {"count": 2}, "did you mean speed or speak?"),
        ("zzz", {"before": "; "}, ""),
        ("zzz", {"otherwise": "known ones are few"}, "known ones are few"),
        (3, {}, ""),
    ],
)
def test_names_that_may_be_meant(name, options, expected):
    assert did_you_mean(name, iter(["torque", "speed", "speak"]), **options) == expected


def test_lists_of_names():
    assert [any_of("A"), any_of("AB"), any_of("ABC")] == ["A", "A or B", "A, B or C"]
    assert closest("spe", ["speed"], alike=0.9) == []


def test_plain_values():
    value = {1: (np.float64(2.0), np.arange(2)), "a": [np.bool_(True), None, Path("x")]}
    assert json_value(value) == {"1": [2.0, [0, 1]], "a": [True, None, "x"]}
    assert json_value([1j], other=repr) == ["1j"]
    assert type(python_scalar(np.int64(3))) is int
    assert python_scalar((np.int64(3),)) == (np.int64(3),)


@pytest.fixture(scope="module")
def patterns():
    """Return where each pattern of a message is, the pattern, and its words that are no names or values."""
    found = []
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        for node, words in prose(ast.parse(path.read_text(encoding="utf-8"))):
            found.append((f"{path.name}:{node.lineno}", node, words))
    assert len(found) > 1500
    return found


@pytest.mark.slow
def test_tests_ask_for_names_values_and_remedies_not_for_sentences(patterns):
    """An edit of English must not cost tests; `says` asks for words in any order."""
    long = [(where, node, words) for where, node, words in patterns if len(words) > LONGEST]
    assert [f"{where}: {ast.unparse(node)} has the words {' '.join(words)}" for where, node, words in long] == []


@pytest.mark.slow
def test_tests_ask_for_more_than_many_messages_say(patterns):
    """A pattern that fits any refusal, as "positive" does, would be content with that of another field."""
    trees = (ast.parse(path.read_text(encoding="utf-8")) for path in PACKAGE.rglob("*.py"))
    texts = frozenset().union(*map(raisable, trees))
    assert len(texts) > 3000
    asked = {ast.unparse(node): (where, node) for where, node, _ in patterns if ast.unparse(node) != "None"}
    fits = {f"{where}: {told}": sorted(fitting(node, texts)) for told, (where, node) in asked.items()}
    assert {told: found for told, found in fits.items() if len(found) > BROADEST} == {}


def test_what_a_pattern_fits():
    code = """
"A docstring that says gauge is negative."
def check(gauge, name):
    "Refuse a gauge that is negative."
    if gauge < 0:
        raise ValueError(f"{name} is {gauge}; it must not be negative" + hint(name))
    raise ValueError("gauge " + f"{'is not known' if name else 'has no name'}; give a name")
"""
    texts = frozenset(raisable(ast.parse(code)))
    assert texts == {"\0 is \0; it must not be negative\0", "gauge \0; give a name", "is not known", "has no name"}
    for pattern, expected in {
        "'negative'": 1,
        "says('name', 'give')": 1,
        "'name'": 2,
        "says('negative', '-5')": 0,
        "says(f'{name}', 'give')": 0,
        "re.escape(str(path))": 0,
        "re.escape(f'{path}')": 0,
    }.items():
        assert len(fitting(ast.parse(pattern, mode="eval").body, texts)) == expected, pattern


def test_what_counts_as_prose():
    code = """
@pytest.mark.parametrize(("torque", "words"), [(-5, "torque is -5 N*m; give more"), (0, says("torque", "above 0"))])
def test_torques(torque, words):
    "A torque that is a docstring's is no name."
    with pytest.raises(ValueError, match=words):
        pair(torque)
    for kind, told in {"a": "of kind 'a' only"}.items():
        with pytest.raises(ValueError, match=told):
            pair(kind)
"""
    found = {ast.unparse(node): words for node, words in prose(ast.parse(code))}
    assert list(found.values()) == [["is", "give", "more"], ["above"], ["of", "only"]]


@pytest.mark.parametrize(
    ("words", "message", "found"),
    [
        (("torque", "-5", "give"), "give a positive torque, not -5", True),
        (("torque", "-5"), "torque: -5.5", False),
        (("tor",), "torque", False),
        (("5",), "0.5", False),
        (("'a.b'", "give"), "'a.b':\ngive", True),
    ],
)
def test_messages_are_asked_for_words(words, message, found):
    assert bool(re.search(says(*words), message)) == found

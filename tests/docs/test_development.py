"""The page on development says what is true of the tests and of pyproject.toml."""

import ast
import re
import tomllib

import pytest

from tests.conftest import allowed_reasons, unknown_skips
from tests.docs.support import DOCS, ROOT

PAGE = (DOCS / "development.md").read_text(encoding="utf-8")


def reasons():
    """Return where a test may be skipped, and why, from the source of all tests."""
    found = {}
    for path in sorted((ROOT / "tests").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            name = getattr(getattr(node, "func", None), "attr", "")
            if name in ("skip", "skipif", "importorskip"):
                given = [
                    k.value.value for k in node.keywords if k.arg == "reason" and isinstance(k.value, ast.Constant)
                ]
                text = given[0] if given else "could not import" if name == "importorskip" else ast.unparse(node)
                found[f"{path.relative_to(ROOT)}:{node.lineno}"] = text
    return found


@pytest.mark.slow
def test_every_reason_to_skip_is_in_the_table():
    found = reasons()
    assert len(found) > 20
    assert not unknown_skips(found)


@pytest.mark.slow
def test_every_row_is_needed():
    texts = [*reasons().values(), "could not import 'ansys.mapdl.reader'"]
    assert not [words for words in allowed_reasons() if not any(words in text for text in texts)]


def test_another_reason_fails_the_run():
    known = {"a": "Skipped: no chromium is installed", "b": "Skipped: GEARMBS_MNF_FILES names no folder"}
    assert not unknown_skips(known)
    assert unknown_skips({**known, "c": "Skipped: too slow"}) == ["c: Skipped: too slow"]


def bounds():
    """Return the bounds of pyproject.toml by package, as texts."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    extras = [text for extra in project["project"]["optional-dependencies"].values() for text in extra]
    listed = [*extras, *project["project"]["dependencies"], *project["build-system"]["requires"]]
    return {re.match(r"[\w-]+", text)[0]: re.sub(r"^[\w-]+(\[.*\])?", "", text) for text in listed}


@pytest.mark.parametrize(
    ("package", "bound"),
    re.findall(r"^\| ([\w-]+) \| ((?:below )?[\d.]+) \|", PAGE.partition("## Why the bounds")[2], re.M),
)
def test_bounds_are_those_of_the_project(package, bound):
    told = f"<{bound.removeprefix('below ')}" if bound.startswith("below") else f">={bound}"
    assert told in bounds()[package].split(",")


def test_commands_are_there():
    for command in re.findall(r"`(\.ci/\w+)", PAGE):
        assert (ROOT / command).stat().st_mode & 0o100, command
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M))
    assert set(re.findall(r"`make (\w+)`", PAGE)) <= targets

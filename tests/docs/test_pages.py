"""Links, examples and commands of the documentation's pages and the README."""

from __future__ import annotations

import re
import shlex

import matplotlib as mpl
import pytest
import typer

from gearmbs.cli import app
from gearmbs.studies import load_case
from gearmbs.studies.planetary import load_planetary
from tests.docs.support import DOCS, FENCE, ROOT, blocks, links, pages, run_blocks

ALL = [ROOT / "README.md", *pages()]


def name_of(path) -> str:
    return str(path.relative_to(ROOT))


@pytest.fixture
def in_folder(tmp_path, monkeypatch):
    """Work in an empty folder without a display."""
    monkeypatch.chdir(tmp_path)
    mpl.use("Agg")
    return tmp_path


@pytest.mark.parametrize("path", ALL, ids=name_of)
def test_relative_links_lead_to_files(path):
    missing = []
    for target in links(path):
        file = target.partition("#")[0]
        if file and "://" not in target and not target.startswith("mailto:") and not (path.parent / file).exists():
            missing.append(target)
    assert not missing


def test_modules_named_in_prose_exist():
    """A file of Python named as `folder/name.py` ends the path of one that is checked in."""
    folders = ("gearmbs", "tests", "docs", "benchmarks")
    files = {f"/{p.relative_to(ROOT).as_posix()}" for folder in folders for p in (ROOT / folder).rglob("*.py")}
    for page in ALL:
        for name in re.findall(r"`([a-z_][\w/]*\.py)`", FENCE.sub("", page.read_text(encoding="utf-8"))):
            assert any(file.endswith(f"/{name}") for file in files), f"{name_of(page)} names {name}"


@pytest.fixture(scope="module")
def commands():
    """The commands of the program by name."""
    return typer.main.get_command(app).commands


@pytest.mark.parametrize("path", ALL, ids=name_of)
def test_commands_exist_with_their_options(path, commands):
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), re.M))
    for block in blocks(path):
        for line in block.code.replace("\\\n", " ").splitlines() if block.language == "console" else ():
            words = shlex.split(line.removeprefix("$ "), comments=True)
            if words[:1] == ["make"]:
                assert set(words[1:]) <= targets, line
            if words[:1] == ["gearmbs"] and not words[1].startswith("-"):
                assert words[1] in commands, line
                command, rest = commands[words[1]], words[2:]
                if hasattr(command, "commands"):
                    assert rest[0] in command.commands, line
                    command, rest = command.commands[rest[0]], rest[1:]
                known = {o for p in command.params for o in (*p.opts, *p.secondary_opts)}
                assert {w for w in rest if w.startswith("--")} <= known, line


def test_no_page_has_doctests():
    assert not [p for p in ALL if ">>> " in p.read_text(encoding="utf-8")]


def test_no_page_is_outside_the_tables_of_contents():
    listed = "".join(re.findall(r"```\{toctree\}.*?```", "".join(p.read_text() for p in pages()), re.S))
    for path in pages():
        relative = path.relative_to(DOCS).with_suffix("")
        assert relative.name in listed or relative.parts[0] == "theory" or relative.name == "index", relative


@pytest.mark.slow
def test_readme_example(in_folder):
    """The lines of the README run and draw a revolution of the healthy pair and of the one with a fault."""
    readme = ROOT / "README.md"
    code = [b.code for b in blocks(readme) if b.language == "python"]
    assert len([line for line in code[0].splitlines() if line.strip()]) < 15
    names = run_blocks(readme, "python")
    assert (in_folder / "pinion.png").stat().st_size > 10_000
    # the broken tooth disturbs the average more than anything in the healthy pair does
    swings = {name: float(abs(a - a.mean()).max()) for name, a in names["averages"].items()}
    assert swings["broken tooth"] > 1.5 * swings["healthy"]


@pytest.mark.parametrize("name", ["extend.md", "own_dae.md", "own_mechanism.md", "measured.md"])
def test_sources_that_pages_name_are_there(name):
    """Files and folders of the package, by their paths."""
    text = (DOCS / "howto" / name).read_text(encoding="utf-8")
    assert not [path for path in re.findall(r"`(gearmbs/[\w/]*[\w/](?:\.py)?)`", text) if not (ROOT / path).exists()]


def test_readme_picture_is_small():
    assert (DOCS / "images" / "paper.png").stat().st_size < 200_000


@pytest.mark.parametrize("path", [p for p in ALL if any(b.language == "toml" for b in blocks(p))], ids=name_of)
def test_case_files_of_pages_are_read(path, tmp_path):
    for number, block in enumerate(b for b in blocks(path) if b.language == "toml"):
        file = tmp_path / f"{number}.toml"
        file.write_text(block.code, encoding="utf-8")
        if "[planetary]" in block.code:
            load_planetary(file).mechanism()
        else:
            load_case(file)


def test_examples_of_pages_are_run_by_the_build():
    """Pages with code of Python are notebooks, which the build of the documentation runs; an error in one ends it."""
    assert not [name_of(p) for p in pages() if any(b.language == "python" for b in blocks(p))]
    assert "nb_execution_raise_on_error = True" in (DOCS / "conf.py").read_text(encoding="utf-8")

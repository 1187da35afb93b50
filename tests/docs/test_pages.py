"""Links, examples and commands of the documentation's pages and the README."""

from __future__ import annotations

import re
import shlex

import matplotlib as mpl
import pytest
import typer

from gearmbs.cli import app
from gearmbs.dae.methods import INTEGRATORS
from gearmbs.studies import load_case
from gearmbs.studies.planetary import load_planetary
from tests.docs.support import DOCS, FENCE, ROOT, blocks, links, notebooks, pages, run_blocks

ALL = [ROOT / "README.md", *pages()]
QUICK = ("own_dae.md", "own_mechanism.md", "measured.md", "adams.md", "adams_contact.md")
WITH_EXAMPLES = [p for p in pages() if any(b.language == "python" for b in blocks(p))]


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


@pytest.mark.parametrize("path", ALL, ids=name_of)
def test_commands_exist_with_their_options(path):
    commands = typer.main.get_command(app).commands
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


def test_pages_are_of_one_kind():
    """A page is a notebook or has plain examples, since the two are run in different ways; none has doctests."""
    for path in notebooks():
        assert not any(b.language == "python" for b in blocks(path)), path
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


def _examples(path, folder):
    cases = [block.code for block in blocks(path) if block.language == "toml"]
    # the first is the one that the page works with
    for code in reversed(cases):
        (folder / "case.toml").write_text(code, encoding="utf-8")
        if "[planetary]" in code:
            load_planetary(folder / "case.toml").mechanism()
        else:
            load_case(folder / "case.toml")
    known = dict(INTEGRATORS)
    try:
        run_blocks(path, "python")
    finally:
        # what a page enters into the table is of the page
        INTEGRATORS.clear()
        INTEGRATORS.update(known)


@pytest.mark.slow
@pytest.mark.parametrize("path", [p for p in WITH_EXAMPLES if p.name in QUICK], ids=name_of)
def test_quick_examples(path, in_folder):
    _examples(path, in_folder)


@pytest.mark.slow
@pytest.mark.parametrize("path", [p for p in WITH_EXAMPLES if p.name not in QUICK], ids=name_of)
def test_examples(path, in_folder):
    _examples(path, in_folder)

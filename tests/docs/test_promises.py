"""What is promised, how it is cited, and how one contributes, is true of the code."""

import importlib
import json
import re
import tomllib

import pytest

import gearmbs
from gearmbs.campaigns.folder import PACKED
from gearmbs.campaigns.plans.plan import FORMAT as CAMPAIGN
from gearmbs.dae.state import FORMAT as STATE
from tests.docs.support import DOCS, ROOT

PROMISES = (DOCS / "promises.md").read_text(encoding="utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
ROOT_PAGES = ("CONTRIBUTING.md", "CODE_OF_CONDUCT.md", "SECURITY.md")
INSIDE = ("gearmbs.dae.equations.expressions", "gearmbs.campaigns.subjects")
"""Packages with a stub that are no fronts: their names are for the package's own use."""


def test_every_front_is_promised():
    table = PROMISES.partition("The fronts are:")[2].partition("Everything else")[0]
    named = set(re.findall(r"`(gearmbs[\w.]*)`", table))
    stubs = {
        ".".join(path.parent.relative_to(ROOT).parts) for path in (ROOT / "gearmbs").rglob("__init__.pyi")
    } - {*INSIDE}  # fmt: skip
    assert named == stubs
    for name in named:
        assert importlib.import_module(name).__all__


def test_formats_of_files_are_those_of_the_code():
    rows = {row[0]: row[1] for row in re.findall(r"^\| ([^|]+) \| ([^|]+) \|", PROMISES, flags=re.MULTILINE)}
    assert rows["states (`State.save`)"] == str(STATE)
    assert rows["folders of campaigns"] == f"{CAMPAIGN} and, packed, {PACKED}"


def test_the_citation_is_of_this_version():
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    told = dict(re.findall(r"^([\w-]+): +(\S.*)$", text, flags=re.MULTILINE))
    assert told["version"] == PROJECT["version"] == gearmbs.__version__
    assert told["license"] == PROJECT["license"]
    assert told["cff-version"] == "1.2.0"


@pytest.mark.parametrize("page", ROOT_PAGES)
def test_pages_of_the_root_name_what_is_there(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    for link in re.findall(r"\]\(([^)#]+)\)", text):
        assert (ROOT / link).exists(), link
    goals = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(encoding="utf-8"), flags=re.MULTILINE))
    for call in re.findall(r"`make ([a-z ]+)`", text):
        assert {*call.split()} <= goals
    extras = PROJECT["optional-dependencies"]
    for extra in re.findall(r"\.\[(\w+)\]", text):
        assert extra in extras


def test_workflows_use_what_is_there():
    text = (ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8")
    assert "- run: .ci/run" in text
    tried = re.search(r"python: \[(.*)\]", text)[1]
    lowest = PROJECT["requires-python"].removeprefix(">=")
    assert re.findall(r'"([\d.]+)"', tried)[0] == lowest
    listed = [line.rpartition(" ")[2] for line in PROJECT["classifiers"] if re.search(r":: 3\.\d+$", line)]
    assert re.findall(r'"([\d.]+)"', tried) == listed


def test_the_recipe_asks_for_what_the_package_does():
    """By lines, since nothing that reads YAML is needed otherwise."""
    text = (ROOT / "conda" / "recipe.yaml").read_text(encoding="utf-8")
    told = dict(re.findall(r'^  (\w+): "?([^"\n]+)"?$', text.partition("package:")[0], flags=re.MULTILINE))
    assert told == {
        "name": PROJECT["name"], "version": PROJECT["version"],
        "python_min": PROJECT["requires-python"].removeprefix(">="),
    }  # fmt: skip
    run = set(
        re.findall(r"^    - ([\w-]+) >=([\d.]+)$", text.partition("  run:")[2].partition("tests:")[0], re.MULTILINE)
    )
    asked = {tuple(one.split(">=")) for one in PROJECT["dependencies"]}
    assert {(name.removesuffix("-base"), version) for name, version in run} == asked
    build = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["build-system"]["requires"]
    assert {f"    - {one.replace('>=', ' >=')}" for one in build} <= set(text.splitlines())
    (script,) = PROJECT["scripts"].items()
    assert f"      - {' = '.join(script)}" in text.splitlines()


def test_classifiers_are_those_of_what_was_run():
    """A system counts once its row of the install page says so, and a version of Python once the workflow has it."""
    page = (DOCS / "install.md").read_text(encoding="utf-8")
    systems = [line for line in PROJECT["classifiers"] if line.startswith("Operating System")]
    assert systems == ["Operating System :: POSIX :: Linux"]
    rows = [row for row in page.splitlines() if row.startswith("| Linux on ARM, macOS on ARM, Windows")]
    assert rows
    assert all("**not yet**" in row for row in rows)


def test_benchmarks_over_time_are_found():
    told = json.loads((ROOT / "benchmarks" / "asv.conf.json").read_text(encoding="utf-8"))
    assert (ROOT / "benchmarks" / told["benchmark_dir"] / "runs.py").is_file()
    runs = importlib.import_module("benchmarks.over_time.runs")
    for state in runs.SECTIONS:
        assert runs.case_of(state, lump=True).solver.lump


def test_references_of_the_article_are_there():
    text = (ROOT / "joss" / "paper.md").read_text(encoding="utf-8")
    known = set(re.findall(r"^@\w+\{(\w+),", (ROOT / "joss" / "paper.bib").read_text(encoding="utf-8"), re.MULTILINE))
    assert set(re.findall(r"@(\w+)", text.partition("# Summary")[2])) == known
    # the journal asks for 750 to 1750 words, and for these sections
    assert 750 <= len(text.partition("# Summary")[2].split()) <= 1750
    sections = ("Statement of need", "State of the field", "Software design", "Research impact statement")
    assert all(f"\n# {name}\n" in text for name in (*sections, "AI usage disclosure"))

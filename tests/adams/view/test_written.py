"""The deck of a command file on disk: it says what it lacks, and takes nobody's file away."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from gearmbs.adams import DeckError, read_deck, read_view
from gearmbs.cli import app

from ...says import says
from .files import PENDULUM

LACKING = {
    ".swing.N": "force create direct multi_point_force multi_point_force_name = .swing.N i_marker_name = TOP",
    "bar": "ude create instance instance_name = .swing.T definition_name = .mdi.bar",
    "LOC_NOWHERE": "marker create marker_name = .swing.ROD.M location = (LOC_NOWHERE(.swing.ROD.TOP))",
}
SETTINGS = "measure create range measure_name = .swing.R of_measure_name = .swing.HEIGHT\n"


def written(folder, more, *options):
    """Call the command, and return how it ends, what it says and which files are there then."""
    (folder / "p.cmd").write_text(PENDULUM + more)
    result = CliRunner().invoke(app, ["adams", str(folder / "p.cmd"), "--to-deck", str(folder / "d.adm"), *options])
    return result.exit_code, result.output, sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize("name", LACKING)
def test_a_deck_that_would_lack_something_is_not_written(tmp_path, name):
    code, told, files = written(tmp_path, LACKING[name] + "\n")
    assert (code, files) == (1, ["p.cmd"])
    line = PENDULUM.count("\n") + 1
    assert name in told
    assert f"p.cmd:{line}" in told
    assert "--skip-unsupported" in told
    with pytest.raises(DeckError, match=says(name, "allow_unsupported")):
        read_view(tmp_path / "p.cmd").save(tmp_path / "d.adm")


@pytest.mark.parametrize("name", LACKING)
def test_a_deck_that_is_written_all_the_same_says_what_it_lacks(tmp_path, name):
    code, told, files = written(tmp_path, LACKING[name] + "\n", "--skip-unsupported")
    assert (code, files) == (0, ["d.adm", "d_Last_Sim.acf", "p.cmd"])
    head = (tmp_path / "d.adm").read_text().split("UNITS")[0]
    assert name in told
    assert "LEFT OUT" in head
    assert name in head
    assert not read_deck(tmp_path / "d.adm").unsupported


def test_a_whole_deck_is_written_with_its_remarks(tmp_path):
    code, told, files = written(tmp_path, SETTINGS)
    assert (code, files) == (0, ["d.adm", "d_Last_Sim.acf", "p.cmd"])
    assert ".swing.R" in told
    assert "LEFT OUT" not in (tmp_path / "d.adm").read_text()


@pytest.mark.parametrize("name", ["p.cmd", "d.adm", "d_Last_Sim.acf"])
def test_files_of_others_stay(tmp_path, name):
    (tmp_path / "p.cmd").write_text(PENDULUM)
    view = read_view(tmp_path / "p.cmd")
    if name != "p.cmd":
        (tmp_path / name).write_text("mine\n")
    before = {path.name: path.read_text() for path in tmp_path.iterdir()}
    target = tmp_path / (name if name == "p.cmd" else "d.adm")
    with pytest.raises(DeckError, match=says(name, "name")):
        view.save(target)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == before
    if name == "p.cmd":
        with pytest.raises(DeckError, match=says(name, "name")):
            view.save(target, overwrite=True)
    else:
        assert target in view.save(target, overwrite=True)
        assert "mine" not in (tmp_path / name).read_text()


def test_its_own_files_are_written_again_until_they_are_changed(tmp_path):
    (tmp_path / "p.cmd").write_text(PENDULUM)
    view = read_view(tmp_path / "p.cmd")
    files = view.save(tmp_path / "d.adm")
    assert view.save(tmp_path / "d.adm") == files
    files[0].write_text(files[0].read_text().replace("MASS = 2", "MASS = 3"))
    with pytest.raises(DeckError, match=says("d.adm", "overwrite")):
        view.save(tmp_path / "d.adm")
    code, _, _ = written(tmp_path, "")
    assert code == 1
    code, _, _ = written(tmp_path, "", "--overwrite")
    assert code == 0


def test_simulations_of_like_names_are_files_of_their_own(tmp_path):
    (tmp_path / "p.cmd").write_text(PENDULUM)
    view = read_view(tmp_path / "p.cmd")
    view.scripts["Last+Sim"] = view.scripts["Last_Sim"]
    files = view.save(tmp_path / "d.adm")
    assert [one.name for one in files] == ["d.adm", "d_Last_Sim.acf", "d_Last_Sim_2.acf"]

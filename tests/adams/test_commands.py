"""Reading command scripts."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from gearmbs.adams import DeckError, parse_deck, parse_script
from gearmbs.adams.parse import statements as st
from gearmbs.adams.parse.commands import Change, Simulate, Stop, Switch, apply_change
from gearmbs.cli import app
from tests.says import says

from .decks import PENDULUM, SCRIPT


def test_script():
    script = parse_script(SCRIPT)
    assert (script.model, script.prefix) == ("pendulum.adm", "out")
    kinds = [type(c) for c in script]
    assert kinds == [Change, Simulate, Switch, Change, Simulate, Stop]
    first, second = (c for c in script if isinstance(c, Simulate))
    assert (first.kind, first.end, first.dtout) == ("DYNAMICS", 1.0, 0.01)
    assert (second.kind, second.duration, second.steps, second.line) == ("DYNAMICS", 1.0, 50, 7)
    switch = next(c for c in script if isinstance(c, Switch))
    assert (switch.element, switch.id, switch.on) == ("JOINT", 1, False)


def test_script_without_names_starts_with_a_command():
    assert parse_script("sim/tran, end=1, steps=2\nstop").model == ""
    assert parse_script("file/model=a.adm, output_prefix=b\nstop").prefix == "b"


def test_changes_replace_only_what_they_give():
    deck = parse_deck(PENDULUM)
    change = next(c for c in parse_script("\n\npart/2, mass=3\nstop") if isinstance(c, Change))
    part = apply_change(deck.of(st.Part)[2], change.statement)
    assert (part.mass, part.cm, part.ip) == (3.0, 201, (0.04, 0.1, 0.1))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("sim/foo, end=1, steps=1", "unknown argument FOO"),
        ("simulate/dynamics, end=1", "give STEPS or DTOUT"),
        ("simulate/dynamics, end=1, steps=3, dtout=1", says("SIMULATE", "STEPS", "DTOUT", "not both")),
        ("simulate/dynamics, end=1, steps=0", says("STEPS", "0", "positive")),
        ("simulate/end=1, steps=3", "give one of DYNAMICS"),
        ("deactivate/joint", says("DEACTIVATE", "JOINT", "give an element")),
        ("stop\n", None),
        ("var/2", says("argument is given")),
        ("output/separator\nsimlate/dynamics, end=1, steps=1", "did you mean SIMULATE"),
    ],
)
def test_messages(text, message):
    if message is None:
        assert len(parse_script(text).commands) == 1
        return
    with pytest.raises(DeckError, match=message):
        parse_script("model\nout\n" + text)


def test_unsupported_commands_are_named():
    script = parse_script("m\no\nsave/file=x\nstop")
    assert [str(d) for d in script.unsupported] == ["<script>:3: unsupported: SAVE is not supported"]


OUTSIDE = ["../x", "a/../../x", "/elsewhere/x", "C:\\temp\\x", "..\\x", ".", "..", "link/x"]


@pytest.mark.parametrize("name", OUTSIDE)
@pytest.mark.parametrize("text", ["m\n{}\nstop", "m\no\nfile/output_prefix={}\nstop"])
def test_a_script_writes_outside_the_folder_of_the_deck_only_if_told(tmp_path, name, text):
    """Also through a link; what lies inside or below, in either system's spelling, is written."""
    folder = tmp_path / "deck"
    folder.mkdir()
    (folder / "link").symlink_to(tmp_path)
    with pytest.raises(DeckError, match=says(name, "model.adm", "--out")) as caught:
        parse_script(text.format(name)).output(folder / "model.adm")
    assert caught.value.diagnostics[0].line in (2, 3)


@pytest.mark.parametrize(
    ("name", "place"), [("x", "x"), ("below\\x", "below/x"), ("a/../x", "a/../x"), ("..x", "..x"), ("", "model")]
)
def test_a_script_names_results_beside_the_deck_and_below(tmp_path, name, place):
    assert parse_script(f"m\n{name}\nstop").output(tmp_path / "model.adm") == tmp_path / place


@pytest.mark.slow
def test_nothing_is_run_or_written_elsewhere_on_the_command_line(tmp_path):
    folder = tmp_path / "deck"
    folder.mkdir()
    (folder / "model.adm").write_text(PENDULUM)
    (folder / "model.acf").write_text("model\n../../x\nsimulate/dynamics, end=0.01, steps=1\nstop\n")
    arguments = ["adams", str(folder / "model.adm"), str(folder / "model.acf")]
    refused = CliRunner().invoke(app, arguments)
    assert refused.exit_code
    assert "--out" in refused.output
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["deck", "model.acf", "model.adm"]
    assert not CliRunner().invoke(app, [*arguments, "--out", str(tmp_path / "x")]).exit_code
    assert (tmp_path / "x.req").exists()

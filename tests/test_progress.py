"""Bars: nothing where nobody watches, after two seconds where somebody does, and gone at the end."""

import io
import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from gearmbs import progress
from gearmbs._command import case_bars
from gearmbs.mechanism import Mechanism
from gearmbs.signals import analyse, make_signal
from gearmbs.studies import Case, run_cases
from gearmbs.view.figures.style import write_film


@pytest.fixture
def notebook(monkeypatch):
    """A notebook's shell that keeps what is displayed."""
    shown = []

    def display(page, **_):
        shown.append(page)
        return SimpleNamespace(update=shown.append)

    ipython, displays = ModuleType("IPython"), ModuleType("IPython.display")
    ipython.get_ipython = lambda: SimpleNamespace(kernel=None)
    displays.HTML, displays.display = str, display
    monkeypatch.setitem(sys.modules, "IPython", ipython)
    monkeypatch.setitem(sys.modules, "IPython.display", displays)
    monkeypatch.delenv("GEARMBS_PROGRESS", raising=False)
    return shown


@pytest.fixture
def clock(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    return now


def test_nothing_is_shown_where_nobody_watches(monkeypatch, capsys):
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    assert progress.watched() is None
    with progress.bars(None, ["a"]) as move:
        assert move is None
    with progress.bars(lambda name, fraction: None, ["a"]) as move:
        assert callable(move)


def test_bars_of_a_notebook_come_late_and_go(notebook, clock):
    assert progress.watched() == "notebook"
    with progress.bars(None, ["first", "<second>"]) as move:
        move("first", 0.5)
        assert notebook == []
        clock[0] += 3.0
        move("first", 0.75)
        clock[0] += 0.1
        move("first", 0.8)
        assert len(notebook) == 1
        clock[0] += 0.3
        move("<second>", 0.25)
    assert len(notebook) == 3
    assert 'value="0.7500"' in notebook[0]
    assert "&lt;second&gt;" in notebook[1]
    assert "s left" in notebook[1]
    assert notebook[-1] == ""


def test_many_jobs_are_summed_up(notebook, clock):
    with progress.bars(True, [f"case {k}" for k in range(30)]) as move:
        for k in range(10):
            move(f"case {k}", 1.0)
        clock[0] += 1.0
        move("case 10", 0.5)
    assert "10 of 30 done" in notebook[-2]
    assert notebook[-2].count("<progress") == 2


def test_they_can_be_turned_off(notebook, monkeypatch):
    with progress.bars(False, ["a"]) as move:
        assert move is None
    monkeypatch.setenv("GEARMBS_PROGRESS", "0")
    assert progress.watched() is None


def test_runs_show_them(notebook, monkeypatch):
    """A mechanism and cases, at once here."""
    monkeypatch.setattr(progress, "PATIENCE", 0.0)
    monkeypatch.setattr(progress, "INTERVAL", 0.0)
    mechanism = Mechanism("pendulum", gravity=(0, 0, -9.81))
    rod = mechanism.body("rod", mass=1.0, inertia=(0.1, 0.1, 0.01), position=(0.5, 0, 0))
    mechanism.revolute("pin", rod, mechanism.ground, at=(0, 0, 0), axis=(0, 1, 0))
    mechanism.simulate(1.0)
    assert "pendulum" in notebook[0]
    assert notebook[-1] == ""
    notebook.clear()
    run_cases([Case(name="the case", operation={"run_up": 0.02, "settling": 0.0, "duration": 0.07})])
    assert "the case" in notebook[0]
    assert notebook[-1] == ""


def test_analyses_show_them_and_work_inside_other_work_does_not(notebook, monkeypatch):
    monkeypatch.setattr(progress, "PATIENCE", 0.0)
    monkeypatch.setattr(progress, "INTERVAL", 0.0)
    t = np.arange(20000) / 5000.0
    signal = make_signal(np.sin(2 * np.pi * 300.0 * t), 5000.0, units="m/s^2", speed=20 * np.pi, teeth=30)
    analyse(signal)
    assert "analysing" in notebook[0]
    assert notebook[-1] == ""
    told = []
    analyse(signal, progress=lambda fraction, stage: told.append((fraction, stage)))
    assert told
    notebook.clear()
    with progress.bars(True, ["outer"]) as move:
        analyse(signal)
        move("outer", 0.5)
    assert not any("analysing" in page for page in notebook)
    with pytest.raises(TypeError):
        analyse(signal, progres=None)


def test_a_terminal_has_them_on_the_error_stream(monkeypatch, clock):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    screen = Terminal()
    monkeypatch.setattr(sys, "stderr", screen)
    monkeypatch.delenv("GEARMBS_PROGRESS", raising=False)
    assert progress.watched() == "terminal"
    with progress.bars(True, ["a case"]) as move:
        move("a case", 0.5)
    assert "a case" in screen.getvalue()


def test_work_of_unknown_length_shows_its_seconds_and_then_its_fraction(notebook, monkeypatch):
    monkeypatch.setattr(progress, "PATIENCE", 0.0)
    monkeypatch.setattr(progress, "INTERVAL", 0.01)
    appeared = progress.threading.Event()
    draw = progress.Bars._draw
    monkeypatch.setattr(progress.Bars, "_draw", lambda self, now: (draw(self, now), appeared.set()))
    with progress.waiting("thinking") as tell:
        # nothing is told: the bar comes by itself
        assert appeared.wait(20.0)
        assert "thinking" in notebook[0]
        assert "value=" not in notebook[0]
        tell(0.5)
        deadline = progress.time.monotonic() + 20.0
        while 'value="0.5000"' not in notebook[-1] and progress.time.monotonic() < deadline:
            tell(0.5)
        assert 'value="0.5000"' in notebook[-1]
    assert notebook[-1] == ""


def test_films_show_how_far_they_are(notebook, monkeypatch, tmp_path):
    monkeypatch.setattr(progress, "PATIENCE", 0.0)
    monkeypatch.setattr(progress, "INTERVAL", 0.0)
    buffer = io.BytesIO()
    Image.new("RGB", (8, 8)).save(buffer, format="PNG")
    written = write_film(tmp_path / "film.gif", [buffer.getvalue()] * 3, 3, rate=10)
    with Image.open(written) as film:
        assert film.format == "GIF"
    assert "saving film.gif" in notebook[0]
    assert any('value="0.2500"' in page for page in notebook)
    assert notebook[-1] == ""
    with pytest.raises(ValueError, match=r"film\.avi"):
        write_film(tmp_path / "film.avi", [], 0)


def test_commands_show_one_bar_only(notebook, monkeypatch):
    """What a command does inside its own bar opens no second one."""
    monkeypatch.setattr(progress, "PATIENCE", 0.0)
    with case_bars(["a"]) as move, progress.waiting("inside") as tell:
        tell(0.5)
        move("a", 1.0)
    assert notebook == []

"""What differs between systems stands in one module, and each system can be played on any other.

Here: one that forks no processes, hears no signals, has no ``/proc``, no locks of files, no folder of the user's own
that can be written, or refuses to rename over a file that is open; names with blanks, umlauts and 255 bytes; terminals
whose code page lacks what is printed.
"""

from __future__ import annotations

import ast
import errno
import io
import os
import re
import signal
import subprocess
import sys
import threading
import types
from pathlib import Path

import numpy as np
import pytest

import gearmbs as gm
from gearmbs import files, system
from gearmbs.campaigns import limits
from gearmbs.flexible.material import FlexibleError
from gearmbs.flexible.matrix_files import _guarded
from gearmbs.kernels import locks
from gearmbs.studies.run import claims, code
from gearmbs.studies.run.loaded import BEGAN
from tests.says import says

ROOT = Path(gm.__file__).parent
SYSTEM = ROOT / "system.py"
ONLY_THERE = {"fcntl", "resource", "msvcrt", "signal"}
"""Modules of Python that are not there on each system, or do less."""
ONLY_CALLS = {
    "fork",
    "kill",
    "sched_getaffinity",
    "umask",
    "getuid",
    "geteuid",
    "setsid",
    "killpg",
    "waitpid",
    "replace",
}
"""Functions of ``os`` of which the same holds."""
MAY = {
    ("dae/integrators/driver.py", "signal"): "Ctrl-C, which every system has, becomes a flag while a run is under way",
}
"""Uses elsewhere, and why."""


THERE = re.compile(
    rf"\b(?:import|from) (?:{'|'.join(sorted(ONLY_THERE))})\b|\bos\.(?:{'|'.join(sorted(ONLY_CALLS))}|name)\b"
    r"|\bsys\.platform\b|/proc"
)
"""What the text of a module has somewhere if it uses any of these."""
OPENS = re.compile(r"open\(|read_text\(|write_text\(")
"""The same of one that opens a file as text."""


def uses(path: Path) -> set[str]:
    """Return what a module uses that not every system has."""
    text, found = path.read_text(encoding="utf-8"), set()
    # most modules have none of these words, and need not be parsed
    for node in ast.walk(ast.parse(text)) if THERE.search(text) else ():
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names} & ONLY_THERE
        elif isinstance(node, ast.ImportFrom) and not node.level:
            found |= {node.module or ""} & ONLY_THERE
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if (node.value.id == "os" and node.attr in {*ONLY_CALLS, "name"}) or (node.value.id, node.attr) == (
                "sys",
                "platform",
            ):
                found.add(f"{node.value.id}.{node.attr}")
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.startswith("/proc"):
            found.add("/proc")
    return found


def texts_of_any_code_page(path: Path) -> list[int]:
    """Return the lines where a text is read or written in whatever code page the machine has."""
    text, found = path.read_text(encoding="utf-8"), []
    for node in ast.walk(ast.parse(text)) if OPENS.search(text) else ():
        if not isinstance(node, ast.Call) or any(k.arg == "encoding" for k in node.keywords):
            continue
        plain, name = isinstance(node.func, ast.Name), ast.unparse(node.func).rpartition(".")[2]
        modes = [ast.unparse(arg) for arg in (*node.args[1:2], *(k.value for k in node.keywords if k.arg == "mode"))]
        opened = (plain and name == "open") or ast.unparse(node.func) == "os.fdopen"
        # with a name given by place it is of an archive, or has the code page by place
        whole = (name == "read_text" and not node.args) or (name == "write_text" and len(node.args) < 2)
        if (whole and not plain) or (opened and not any("b" in mode for mode in modes)):
            found.append(node.lineno)
    return found


MODULES = [path for path in sorted(ROOT.rglob("*.py")) if path != SYSTEM]


def test_what_differs_between_systems_stands_in_one_module():
    found = {(path.relative_to(ROOT).as_posix(), what) for path in MODULES for what in uses(path)}
    assert found == set(MAY)


def test_texts_are_read_and_written_in_utf_8():
    assert {path.name: lines for path in MODULES if (lines := texts_of_any_code_page(path))} == {}


def on_windows(monkeypatch) -> None:
    """Play a system without forks, signals that ring, masks of them, signal 0 and `/proc`."""
    monkeypatch.setattr(system, "WINDOWS", True)
    monkeypatch.setattr(system, "PROC", Path("there is no such folder"))
    for name in ("fork", "sched_getaffinity", "kill"):
        monkeypatch.delattr(os, name, raising=False)
    for name in ("SIGPROF", "SIGALRM", "pthread_sigmask", "setitimer"):
        monkeypatch.delattr(system.signal, name, raising=False)
    monkeypatch.setitem(sys.modules, "fcntl", None)
    monkeypatch.setitem(sys.modules, "resource", None)


class Msvcrt(types.ModuleType):
    """Locks of Windows: they wait for ten seconds, and say then that it would be for ever."""

    LK_LOCK = 1

    def __init__(self, refused: int, number: int = errno.EDEADLK) -> None:
        super().__init__("msvcrt")
        self.refused, self.number, self.held = refused, number, []

    def locking(self, handle: int, how: int, count: int) -> None:
        assert (how, count) == (self.LK_LOCK, 1)
        if self.refused:
            self.refused -= 1
            raise OSError(self.number, "resource deadlock avoided")
        self.held.append(handle)


def test_without_proc_and_signals_a_process_says_what_it_can(monkeypatch):
    on_windows(monkeypatch)
    assert system.cores() == (os.cpu_count() or 1)
    assert system.processor_lines() == []
    assert system.space_of_processes() == ""
    assert system.process_of(1) == ("unknown", "")
    assert system.spent(os.getpid()) is None
    assert system.began() >= BEGAN
    assert system.address_space() is None
    assert not system.rings("processor")
    assert not system.rings("wall")
    with system.deaf():
        pass


def test_without_proc_signal_0_tells_of_processes(monkeypatch):
    """As on macOS; that a process is somebody else's tells that it is there."""
    monkeypatch.setattr(system, "PROC", Path("there is no such folder"))
    assert system.process_of(os.getpid()) == ("unknown", "")
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    assert system.process_of(ended.pid) == (None, "")

    def others(*_):
        raise PermissionError

    monkeypatch.setattr(os, "kill", others)
    assert system.process_of(1) == ("unknown", "")


def test_limits_are_checked_between_steps_where_nothing_rings(monkeypatch):
    on_windows(monkeypatch)
    monkeypatch.delattr(limits.time, "pthread_getcpuclockid", raising=False)
    with limits.limited(1e9, 1e6, 1e9) as check:
        check(0.5)
    with limits.limited(-1.0, 1e6) as check, pytest.raises(limits.TimeLimitReached, match=says("50", "processor")):
        check(0.5)
    with limits.limited(None, None, -1.0) as check, pytest.raises(limits.TimeLimitReached, match=says("50", "clock")):
        check(0.5)


def test_without_signal_0_every_job_may_be_taken_and_no_claim_is_written(monkeypatch, tmp_path):
    on_windows(monkeypatch)
    for _ in range(2):
        claim = claims.take(tmp_path / "job")
        assert claim is not None
        claim.beat()
        claim.release()
    assert list(tmp_path.iterdir()) == []


def test_without_forks_a_file_is_read_where_it_is(monkeypatch):
    on_windows(monkeypatch)
    assert _guarded(Path("model.full"), "it is none", lambda: 3) == 3
    with pytest.raises(FlexibleError, match=says("model.full", "it is none", "broken")):
        _guarded(Path("model.full"), "it is none", lambda: int("broken"))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks are POSIX")
def test_what_kills_its_process_is_noticed_where_there_are_forks():
    assert system.survives(lambda: None)
    assert system.survives(lambda: 1 / 0)
    assert not system.survives(lambda: os.kill(os.getpid(), signal.SIGKILL))


@pytest.mark.parametrize("refused", [0, 2])
def test_locks_of_windows_are_waited_for(monkeypatch, tmp_path, refused):
    on_windows(monkeypatch)
    monkeypatch.setattr(locks, "WINDOWS", True)
    windows = Msvcrt(refused)
    monkeypatch.setitem(sys.modules, "msvcrt", windows)
    with locks.held(tmp_path / "lock"):
        assert len(windows.held) == 1
    assert not (tmp_path / "lock").exists()


def test_where_there_are_no_locks_work_goes_on(monkeypatch, tmp_path):
    on_windows(monkeypatch)
    monkeypatch.setitem(sys.modules, "msvcrt", Msvcrt(1, errno.ENOLCK))
    with locks.held(tmp_path / "lock"):
        pass
    # as on file servers that know none
    monkeypatch.undo()
    monkeypatch.setattr(locks, "lock", lambda stream: (_ for _ in ()).throw(OSError(errno.ENOLCK, "none")))
    with locks.held(tmp_path / "lock"):
        pass


def test_a_file_that_somebody_reads_is_renamed_over_once_he_is_done(monkeypatch, tmp_path):
    monkeypatch.setattr(system, "WINDOWS", True)
    rename, tries = os.replace, []

    def refused(source, target):
        tries.append(source)
        if len(tries) < 3:
            raise PermissionError(errno.EACCES, "in use")
        rename(source, target)

    monkeypatch.setattr(os, "replace", refused)
    assert files.write_whole(tmp_path / "table.csv", "new").read_text() == "new"
    assert len(tries) == 3
    monkeypatch.setattr(system, "RENAMING", 0.0)
    tries[:] = []
    with pytest.raises(PermissionError):
        files.write_whole(tmp_path / "table.csv", "newer")
    assert [path.name for path in tmp_path.iterdir()] == ["table.csv"]


LONG = 255


@pytest.mark.parametrize("name", ["Prüfstand 3, links", "ß" * 120, "x" * (LONG - len(".csv"))])
def test_names_with_blanks_umlauts_and_as_long_as_names_may_be(tmp_path, name):
    folder = tmp_path / "Messungen für Müller"
    path = files.write_whole(folder / f"{name}.csv", "1,2\n")
    assert path.read_bytes() == b"1,2\n"
    signal = gm.make_signal(np.arange(32.0), 100.0, units="g")
    gm.write_signal(signal, path)
    assert gm.read_signal(path).sizes["time"] == 32
    case = folder / f"{name[:100]}.toml"
    case.write_text('name = "Prüfling"\n[operation]\nspeed = "1000 rpm"\n', encoding="utf-8")
    assert gm.load_case(case).name == "Prüfling"
    assert sorted(folder.iterdir()) == sorted({path, case})


def test_without_a_home_nothing_is_kept_and_all_is_found_out_anew(monkeypatch):
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", lambda: (_ for _ in ()).throw(RuntimeError("no home")))
    assert system.user_cache() is None
    memory = code._Memory()
    memory.new["a"] = memory.known["a"] = "b"
    memory.keep()


def test_a_home_that_cannot_be_written_stops_nothing(monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    memory = code._Memory()
    memory.new["a"] = memory.known["a"] = "b"
    memory.keep()
    assert (tmp_path / "file").read_bytes() == b""


@pytest.mark.parametrize("page", ["ascii", "cp1252", "cp437"])
def test_what_a_terminal_lacks_does_not_end_a_program(monkeypatch, page):
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(raw, encoding=page))
    # as without a terminal at all, in a program with windows
    monkeypatch.setattr(sys, "stderr", None)
    system.forgive_output()
    print("Räder: 3 µm, Σ", flush=True)
    assert raw.getvalue().decode(page).startswith("R")
    assert b"\\u03a3" in raw.getvalue() or page == "cp437"


def test_signals_are_left_alone_off_the_main_thread():
    found = []
    thread = threading.Thread(target=lambda: found.append((system.rings("wall"), system.rings("processor"))))
    thread.start()
    thread.join()
    assert found == [(False, False)]

"""The table of formats is the only list of them: a row and a module make a format known everywhere."""

import importlib
import re
import struct
import subprocess
import sys
import types
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import gearmbs as gm
from gearmbs.signals import SignalError, SignalFileError, read_signal, sections, write_signal
from gearmbs.signals.files.formats import written_endings
from gearmbs.signals.files.table import (
    TABLE,
    Content,
    Format,
    Row,
    begins_with,
    format_of,
    formats_table,
    known_endings,
    titles,
)
from gearmbs.signals.signal.record import Record
from tests.docs.support import DOCS
from tests.says import says

PACKAGE = Path(gm.__file__).parent
MARK = b"FAKE"


def read(path, asked):
    data = path.read_bytes()[len(MARK) :]
    return Record(np.frombuffer(data, "<f8", offset=8)[:, None], ["ch1"], ["1"], struct.unpack_from("<d", data)[0])


def write(record, path, progress):
    path.write_bytes(MARK + struct.pack("<d", record.rate) + record.values.tobytes())


def pieces(path, asked):
    whole = read(path, asked)
    half = len(whole.values) // 2
    for k, values in enumerate((whole.values[:half], whole.values[half:])):
        yield Record(values, whole.names, whole.units, whole.rate), (k + 1) / 2


@pytest.fixture
def fake(monkeypatch):
    """Add a format as anybody would: a module, and a row."""
    known = Format(
        read=read,
        write=write,
        pieces=pieces,
        contents={"fake": Content("a fake recording", begins_with(MARK))},
        not_written={".fok": "a .fok file holds nothing"},
        through="nothing",
    )
    monkeypatch.setitem(sys.modules, "gearmbs.signals.files.fake", types.SimpleNamespace(FORMATS={"fake": known}))
    monkeypatch.setitem(TABLE, "fake", Row("Fake", "fake", ".fak .fok"))


@pytest.mark.usefixtures("fake")
def test_a_row_and_a_module_make_a_format(tmp_path):
    signal = gm.make_signal(np.sin(np.arange(64.0)), 640.0)
    path = gm.save(signal, tmp_path / "level.fak")
    np.testing.assert_array_equal(read_signal(path), signal)
    # by its content, where the name says nothing, and as another format where it says so
    other = path.rename(tmp_path / "level.0001")
    np.testing.assert_array_equal(read_signal(other), signal)
    np.testing.assert_array_equal(np.concatenate(list(sections(other, 0.05))), signal)
    with pytest.raises(SignalFileError, match=says("fake", "text", "holds plain")):
        read_signal(_text(tmp_path / "text.fak"))
    wrong = tmp_path / "wrong.wav"
    wrong.write_bytes(other.read_bytes())
    with pytest.raises(SignalFileError, match=says("wav", "recording", "format='fake'")):
        read_signal(wrong)


@pytest.mark.usefixtures("fake")
def test_messages_help_and_documentation_know_it(tmp_path):
    signal = gm.make_signal(np.sin(np.arange(64.0)), 640.0)
    with pytest.raises(SignalError, match=says("format", "fake", "'fik'")):
        write_signal(signal, tmp_path / "x.fak", format="fik")
    with pytest.raises(SignalFileError, match=says("fok", "format=", "use", "pass", "csv")):
        write_signal(signal, tmp_path / "x.unknown")
    with pytest.raises(SignalFileError, match=r"x\.fok: a \.fok file holds nothing"):
        write_signal(signal, tmp_path / "x.fok")
    with pytest.raises(ValueError, match=says("signal", "fak", "saved")):
        gm.save(signal, tmp_path / "x.docx")
    assert ".fak" in written_endings()
    assert ".fok" not in written_endings()
    assert titles().endswith(", Fake")
    assert "| Fake | `fake` | `.fak`, `.fok` | nothing | everything; `.fok` is read only |" in formats_table()


def test_the_command_line_lists_the_table():
    from gearmbs.cli import app

    told = " ".join(CliRunner().invoke(app, ["analyse", "--help"], env={"COLUMNS": "400"}).output.split())
    assert titles() in told
    assert ", ".join(TABLE) in told


@pytest.mark.slow
def test_no_other_module_names_formats():
    """Outside their own modules, by name or ending; names that mean other things elsewhere are left out."""
    for name in ("uff58", "tdms", "lvm", "feather", "mat7", "unv"):
        word = re.compile(rf"(?<![a-z_]){name}(?![a-z_])", re.IGNORECASE)
        found = {p.relative_to(PACKAGE).as_posix() for p in PACKAGE.rglob("*.py") if word.search(p.read_text())}
        modules = {
            row.module for key, row in TABLE.items() if key.startswith(name) or f".{name}" in row.endings.split()
        }
        # texts of LabVIEW often end in .txt, so that the module for texts asks for that content
        modules |= {"csv"} if name == "lvm" else set()
        own = {f"signals/files/{module}.py" for module in ("table", *modules)}
        assert found <= own, name


def test_rows_fit_together():
    """Every module has its formats, no ending stands for two, and every kind of bytes is some format's own."""
    contents = {content: name for name in TABLE for content in format_of(name).contents}
    for name, row in TABLE.items():
        known = format_of(name)
        assert set(known.also) <= set(contents), name
        assert set(known.not_written) <= set(row.endings.split()), name
        assert all(contents[content] == name for content in known.contents), name
    assert len(known_endings()) == sum(len(row.endings.split()) for row in TABLE.values())
    with pytest.raises(ValueError, match=says("endings", "X", "'xyz'", "'.abc'")):
        Row("X", "x", ".x xyz")


def test_the_page_shows_the_table(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS / "scripts"))
    tables = importlib.import_module("tables")
    assert tables.formats()._repr_markdown_() == formats_table()
    assert "tables.formats()" in (DOCS / "howto" / "formats.md").read_text(encoding="utf-8")


def test_the_table_is_light():
    """Neither a number nor a library of a format is loaded for the help of the command line."""
    code = (
        "import sys, gearmbs.signals.files.table as t; t.titles(); "
        "print([m for m in ('numpy', 'xarray', 'h5py') if m in sys.modules])"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert told.stdout.strip() == "[]"


def _text(path):
    path.write_text("a,b\n1,2\n")
    return path

"""Records as files: whole or not at all, kept elsewhere where a disk is full, found again by an interrupted study."""

import errno
import json
import os
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

from gearmbs import cli, files
from gearmbs.files import KeptElsewhere, check_place
from gearmbs.studies import Case, CaseError, SimulationFailed, case_mechanism, run_case, run_cases, simulate_case
from gearmbs.studies.run import claims, engine, recorder, simulation
from gearmbs.studies.run.parallel import StorageWarning
from gearmbs.studies.run.store import RecordFolder, keep_dataset, record_size, stored_record, write_dataset
from tests.says import says

SHORT = {"run_up": 0.02, "settling": 0.0, "duration": 0.07}


def small():
    return xr.Dataset({"a": ("x", np.arange(2000.0))})


@pytest.fixture
def full_disk(tmp_path, monkeypatch):
    """A folder in which every file is too much; files elsewhere are written as always."""
    folder = tmp_path / "full"
    write = Path.write_bytes

    def refuse(path, content):
        if folder in path.absolute().parents:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(path, content)

    monkeypatch.setattr(Path, "write_bytes", refuse)
    monkeypatch.chdir(tmp_path)
    return folder


def test_a_record_is_kept_elsewhere_when_the_disk_is_full(full_disk, tmp_path):
    with pytest.raises(KeptElsewhere, match=says("r.nc", "No space left")) as caught:
        keep_dataset(full_disk / "r.nc", small())
    assert caught.value.path.parent.parent == tmp_path
    with xr.open_dataset(caught.value.path, engine="h5netcdf") as found:
        assert found.equals(small())
    assert list(full_disk.iterdir()) == []


def test_nothing_is_left_where_nothing_can_be_written(tmp_path, monkeypatch):
    def refuse(path, content):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_bytes", refuse)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(files.tempfile, "gettempdir", lambda: str(tmp_path / "temporary"))
    with pytest.raises(OSError, match=says("r.nc", "anywhere else")):
        keep_dataset(tmp_path / "r.nc", small())
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="limits of file sizes are POSIX")
def test_a_file_that_cannot_grow_does_not_end_the_program(tmp_path):
    """The format's own library ends the process when a write fails; the system refuses files above 4 kB here."""
    code = (
        "import resource, signal, sys, numpy as np, xarray as xr\n"
        "from gearmbs.studies.run.store import write_dataset\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))\n"
        "noise = np.random.default_rng(1).normal(size=20000)\n"
        "try:\n"
        "    write_dataset(sys.argv[1], xr.Dataset({'a': ('x', noise)}))\n"
        "except OSError as error:\n"
        "    raise SystemExit(f'refused: {error.strerror}')\n"
    )
    path = tmp_path / "r.nc"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    ended = subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True, text=True, env=environment)
    assert ended.returncode == 1
    assert "refused: File too large" in ended.stderr
    assert list(tmp_path.iterdir()) == []


def test_places_are_looked_at_before_the_work(tmp_path, monkeypatch):
    check_place(tmp_path / "new" / "deep", 1e3)
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "file").touch()
    with pytest.raises(NotADirectoryError, match="is a file; write elsewhere"):
        check_place(tmp_path / "file" / "in it", 1e3)
    with pytest.raises(OSError, match=says("two records", "1000000000.0 GB", "make room")):
        check_place(tmp_path, 1e18, "two records")
    monkeypatch.setattr(files.tempfile, "TemporaryFile", lambda dir: open("/proc/version", "x"))
    with pytest.raises(OSError, match=says("write elsewhere", "written")):
        check_place(tmp_path, 1e3)


@pytest.mark.slow
def test_the_size_of_a_record_is_foreseen(tmp_path):
    case = Case(operation=SHORT)
    size = write_dataset(tmp_path / "r.nc", run_case(case)).stat().st_size
    assert 0.6 * size < record_size(case) < 1.3 * size


@pytest.mark.slow
def test_finished_cases_are_taken_up(tmp_path, monkeypatch):
    """Of three cases two are stored; one call later only the third is computed, and a changed case again."""
    cases = [Case(name=f"z = {z}", gears={"teeth": (z, 29)}, operation=SHORT) for z in (25, 27, 31)]
    first = run_cases(cases[:2], folder=tmp_path)
    computed = []
    whole = simulation.run_case

    def watched(case, progress=None):
        computed.append(case.name)
        return whole(case, progress)

    monkeypatch.setattr("gearmbs.studies.run.parallel.run_case", watched)
    again = run_cases(cases, folder=tmp_path)
    assert computed == ["z = 31"]
    for one, other in zip(first, again, strict=False):
        np.testing.assert_array_equal(one.gmf_rms, other.gmf_rms)
        assert one.attrs["case_json"] == other.attrs["case_json"]
    changed = cases[0].changed(operation={"torque": "90 N m"})
    assert stored_record(tmp_path, cases[0]) is not None
    assert stored_record(tmp_path, changed) is None
    (tmp_path / "z = 25.nc").write_bytes(b"damaged")
    assert stored_record(tmp_path, cases[0]) is None


@pytest.mark.slow
def test_two_calls_share_the_cases(tmp_path, monkeypatch):
    """The case that another call is at work on comes from there; that of one that was killed is computed here."""
    monkeypatch.setattr(engine, "POLL", 0.0)
    cases = [Case(name=name, operation=SHORT) for name in ("mine", "theirs", "of the dead")]
    ledger = RecordFolder(tmp_path)
    claim = claims.take(ledger.claim(cases[1]))
    ledger.claim(cases[2]).write_text(json.dumps({"host": socket.gethostname(), "pid": 2**22 + 1, "started": "1"}))
    record, computed = run_case(cases[1]), []

    def counted(case, progress=None):
        computed.append(case.name)
        return record.assign_attrs(case=case.name, case_json=case.model_dump_json())

    def done(case, _record):
        if case.name == "mine":
            ledger.enter(cases[1], record.assign_attrs(title="theirs"))
            claim.release()

    monkeypatch.setattr("gearmbs.studies.run.parallel.run_case", counted)
    records = run_cases(cases, workers=1, folder=tmp_path, done=done)
    assert computed == ["mine", "of the dead"]
    assert [r.attrs["case"] for r in records] == ["mine", "theirs", "of the dead"]
    assert records[1].attrs["title"] == "theirs"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine.nc", "of the dead.nc", "theirs.nc"]
    # a claim only saves work: where none can be written, cases run all the same
    (tmp_path / "mine.nc").unlink()
    monkeypatch.setattr(claims, "take", lambda path: os.open(tmp_path / "no" / "folder", os.O_CREAT))
    assert len(run_cases(cases, workers=1, folder=tmp_path)) == 3
    assert computed[2:] == ["mine"]


@pytest.mark.slow
def test_errors_can_be_kept(tmp_path, monkeypatch):
    """The case whose record is too short, the one that fails, and the sound one, each in its place."""
    monkeypatch.setattr(
        "gearmbs.studies.run.recorder.slip", lambda pair, *a: "the wheels slipped" if pair.misalignment else None
    )
    cases = [
        Case(name="short", operation={**SHORT, "duration": 0.005}),
        Case(name="slips", operation=SHORT, fault={"misalignment": "0.1 deg"}),
        Case(name="sound", operation=SHORT),
    ]
    short, slips, sound = run_cases(cases, errors="keep", folder=tmp_path)
    assert isinstance(short, CaseError)
    assert "operation.duration" in str(short)
    assert isinstance(slips, SimulationFailed)
    assert slips.partial().time.size > 100
    assert sound.gmf_rms.size
    assert [path.name for path in tmp_path.iterdir()] == ["sound.nc"]
    with pytest.raises(CaseError):
        run_cases(cases)
    with pytest.raises(ValueError, match="choose raise or keep"):
        run_cases(cases, errors="forget")


@pytest.mark.slow
def test_a_full_disk_stops_no_case(full_disk):
    cases = [Case(name="one", operation=SHORT), Case(name="two", operation=SHORT)]
    with pytest.warns(StorageWarning, match="No space left") as told:
        records = run_cases(cases, folder=full_disk)
    assert len(told) == 2
    assert all(record.gmf_rms.size for record in records)


@pytest.mark.slow
def test_the_paper_goes_on_where_it_stopped(tmp_path, monkeypatch):
    """Three cases are there from before; three are computed, and a full disk at the end costs nothing."""
    words = ["paper", "--out", str(tmp_path / "out"), "--duration", "80 ms", "--workers", "1"]
    with monkeypatch.context() as patch:
        patch.setattr(recorder, "slip", lambda pair, *a: "slipped" if pair.operating_point.torque > 150.0 else None)
        result = CliRunner().invoke(cli.app, words)
    assert result.exit_code == 1
    assert len(list((tmp_path / "out" / "cases").glob("*load.nc"))) == 3
    with monkeypatch.context() as patch:
        patch.chdir(tmp_path)
        patch.setattr("gearmbs.studies.run.store.write_dataset", _refuse_in(tmp_path / "out"))
        result = CliRunner().invoke(cli.app, words)
    assert "taking up 3 finished of 6 cases" in result.output
    assert result.exit_code == 1
    assert "cannot be written (No space left on device); it is in" in result.output.replace("\n", " ")
    assert len(list(tmp_path.glob("gearmbs-kept-*/out/*"))) == 7
    result = CliRunner().invoke(cli.app, words)
    assert result.exit_code == 0
    assert "taking up 6 finished of 6 cases" in result.output


def _refuse_in(folder):
    def refuse(path, dataset):
        if Path(path).parent == folder:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write_dataset(path, dataset)

    return refuse


@pytest.mark.slow
def test_a_record_on_bearings_is_told_from_one_on_joints(tmp_path):
    case = Case(name="one", operation=SHORT)
    spall = {"kind": "spall", "width": "1 mm", "angle": "249 deg"}
    m = case_mechanism(case, "6206/C3", cage_slip=0.01, each={"bearing 2 b": {"defects": [spall]}})
    record = run_case(case, False, mechanism=m)
    write_dataset(tmp_path / "one.nc", record)
    assert stored_record(tmp_path, case) is None
    with xr.open_dataset(tmp_path / "one.nc", engine="h5netcdf") as stored:
        assert stored.attrs["title"] == "gear pair: one on rolling bearings"
        assert stored.attrs["bearing_defects"] == "bearing 2 b: spall"
        assert "4 rolling bearings 6206/C3" in repr(stored)
        told = json.loads(stored.attrs["bearings_json"])
    assert sorted(told) == [f"bearing {k} {end}" for k in (1, 2) for end in "ab"]
    assert told["bearing 1 a"]["settings"] == {"cage_slip": 0.01}
    assert told["bearing 1 a"]["bearing"]["clearance"] > 0.0
    assert told["bearing 1 a"]["defects"] == []
    assert told["bearing 2 b"]["defects"][0]["width"] == pytest.approx(1e-3)
    write_dataset(tmp_path / "one.nc", run_case(case, False))
    assert stored_record(tmp_path, case) is None  # nothing says what code it is of
    RecordFolder(tmp_path).enter(case, run_case(case, False))
    assert stored_record(tmp_path, case) is not None
    # a solution does not know its mechanism; whoever evaluates it says so
    solution = simulate_case(case, False, mechanism=m)
    assert simulation.record(case, solution, m).attrs["bearings_json"] == record.attrs["bearings_json"]
    assert "bearings_json" not in simulation.record(case, solution).attrs
    with pytest.raises(ValueError, match=says("'bearing 3'", "1", "choose among bearing")):
        case_mechanism(case, "6206", each={"bearing 3": {}})


@pytest.mark.slow
def test_a_record_without_an_ending_is_recognised(tmp_path):
    """By its first bytes; and what is no record is refused by its name."""
    from gearmbs.signals.files.simulated import read_any

    record = run_case(Case(name="one", operation=SHORT), False)
    write_dataset(tmp_path / "one.nc", record)
    (tmp_path / "one.nc").rename(tmp_path / "one")
    found = read_any(tmp_path / "one")
    np.testing.assert_array_equal(
        found.sel(channel="line_of_action"), record.acceleration.sel(component="line_of_action")
    )
    (tmp_path / "case.toml").write_text("[operation]\ntorque = '90 N m'\n")
    refused = CliRunner().invoke(cli.app, ["compare", "--experiment", f"low:healthy={tmp_path / 'case.toml'}"])
    assert refused.exit_code == 1
    assert "describes a case, not a record" in refused.output


def test_names_that_make_the_same_file_are_told(tmp_path):
    cases = [Case(name=name, operation=SHORT) for name in ("a/b", "a_b")]
    with pytest.raises(ValueError, match=says("'a/b'", "'a_b'", "the same file")):
        run_cases(cases, folder=tmp_path)


def test_a_case_that_fails_to_be_written_is_not_run_again(tmp_path, monkeypatch):
    """An OSError of the work is no lack of room for the claim of it."""
    from gearmbs.studies.run import parallel

    runs = []

    def fails(case, progress=None):
        runs.append(case.name)
        raise OSError("no space")

    monkeypatch.setattr(parallel, "run_case", fails)
    with pytest.raises(OSError, match="no space"):
        run_cases([Case(name="one", operation=SHORT)], folder=tmp_path, workers=1)
    assert runs == ["one"]

"""One word for everything that is written."""

import shutil
import subprocess

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import gearmbs as gm
from gearmbs.mechanism import Mechanism
from gearmbs.signals.files.formats import written_endings
from gearmbs.signals.files.table import known_endings
from gearmbs.view import gear_scene, spectrum_plot
from gearmbs.view.figures import style
from gearmbs.view.figures.style import new_figure
from tests.says import says


def pendulum():
    m = Mechanism("pendulum", gravity=(0, 0, -9.81))
    rod = m.body("rod", mass=1.0, inertia=(0.1, 0.1, 0.01), position=(0.5, 0, 0))
    m.revolute("pin", rod, m.ground, at=(0, 0, 0), axis=(0, 1, 0))
    return m


def signal():
    return gm.make_signal(np.sin(np.arange(64.0)), 640.0, units="m/s^2")


@pytest.mark.slow
def test_everything_is_saved_with_one_word(tmp_path):
    """Each is there under its name, in folders that are made, and is read again where there is a reader."""
    solution = pendulum().simulate(0.05)
    things = {
        "a/case.toml": gm.Case(),
        "a/wheel.dxf": gm.GearSpec(20, "2 mm"),
        "a/pair.stl": gm.GearPair.paper(),
        "b/pendulum.adm": pendulum(),
        "b/solution.nc": solution,
        "b/data.nc": solution.to_dataset(),
        "b/signal.csv": signal(),
        "c/figure.svg": new_figure(),
        "c/figure.png": solution.plot(),
        "c/table.csv": pd.DataFrame({"x": [1.0, 2.0]}),
        "c/mesh.html": gm.mesh_animation(gm.GearPair.paper(), frames=3),
    }
    for name, thing in things.items():
        gm.save(thing, tmp_path / name)
        assert (tmp_path / name).stat().st_size >= 10, name
    assert gm.load_case(tmp_path / "a" / "case.toml") == gm.Case(name="case")
    assert gm.read_signal(tmp_path / "b" / "signal.csv").shape == (64, 1)
    assert "pendulum" in (tmp_path / "b" / "pendulum.adm").read_text()
    with xr.open_dataset(tmp_path / "b" / "solution.nc", engine="h5netcdf") as data:
        np.testing.assert_allclose(data.time, solution.t)
    assert pd.read_csv(tmp_path / "c" / "table.csv").columns.tolist() == ["x"]
    assert not [path for path in tmp_path.rglob(".*") if path.is_file()]


@pytest.mark.parametrize(
    ("thing", "name", "words"),
    [
        (gm.Case(), "case.nc", says("Case", ".toml")),
        (gm.GearSpec(20, "2 mm"), "wheel.png", says("GearSpec", ".dxf", ".step", ".stp", ".stl")),
        (signal(), "signal.docx", says("signal", ".csv", ".txt")),
        (new_figure(), "figure", says("figure", ".png", ".svg", ".pdf")),
    ],
)
def test_endings_that_will_not_do_are_named(thing, name, words, tmp_path):
    with pytest.raises(ValueError, match=words):
        gm.save(thing, tmp_path / name)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("ending", written_endings())
def test_signals_are_saved_as_all_that_is_written(ending, tmp_path):
    """What `write_signal` takes, `save` takes; an archive of numpy is called one."""
    needed = {"tdms": "nptdms", "uff58": "pyuff", "parquet": "pyarrow"}.get(known_endings()[ending])
    if needed:
        pytest.importorskip(needed)
    one = signal()
    path = gm.save(one, tmp_path / f"level.2{ending}")
    np.testing.assert_allclose(gm.read_signal(path), one, rtol=1e-6)
    assert 1 / float(gm.read_signal(path)["time"].diff("time").mean()) == pytest.approx(640.0)


def test_no_archive_is_called_an_array(tmp_path):
    words = says(".npy", "write .npz")
    for options in ({}, {"format": "npy"}):
        with pytest.raises(ValueError, match=words):
            gm.write_signal(signal(), tmp_path / "x.npy", **options)
    with pytest.raises(ValueError, match=says("signal", ".csv", ".txt")):
        gm.save(signal(), tmp_path / "x.npy")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("path", [None, 3, b"plant.npz", "", "plant"])
def test_a_path_that_is_none_is_refused_for_what_saves_itself(path):
    """As for all else; of plants and states the message names their endings."""
    m = gm.Mechanism("disc")
    m.revolute("pin", m.body("disc", 1.0, (2.0,) * 3), m.ground, axis=(0, 0, 1))
    plant, state = m.linearize([("torque", "pin")], [("joint_angle", "pin")]), gm.Simulator(m, 1.0).state()
    for thing, endings in ((plant, ".mat or .npz"), (state, ".npz"), (m, ".adm")):
        with pytest.raises(ValueError, match=says(repr(path), endings if path == "plant" else "file")):
            gm.save(thing, path)


@pytest.mark.slow
def test_other_things_are_refused(tmp_path):
    with pytest.raises(TypeError, match=says("int", "saved")):
        gm.save(3, tmp_path / "three.nc")
    with pytest.raises(ValueError, match=says("page", ".html")):
        gear_scene(gm.GearPair.paper()).page().save(tmp_path / "page.pdf")


def test_a_film_without_ffmpeg_says_what_to_do(tmp_path, monkeypatch):
    monkeypatch.setattr(style.shutil, "which", lambda name: None)
    with pytest.raises(ValueError, match=says("ffmpeg", ".html", ".gif")):
        gm.mesh_animation(gm.GearPair.paper(), frames=2).save(tmp_path / "mesh.mp4")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="ffmpeg is not installed")
def test_films_play(tmp_path):
    """As many pictures as instants, of one even size."""
    path = gm.mesh_animation(gm.GearPair.paper(), frames=4).save(tmp_path / "mesh.mp4")
    scene = gear_scene(gm.GearPair.paper(), frames=2).save(tmp_path / "scene.mp4", width=3.0)
    for film_path, count in ((path, 4), (scene, 2)):
        told = subprocess.run(["ffmpeg", "-i", str(film_path), "-f", "null", "-"], capture_output=True, text=True)
        assert told.returncode == 0
        assert f"frame={count:5d}" in told.stderr.replace(f"frame= {count:4d}", f"frame={count:5d}")


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="ffmpeg is not installed")
def test_what_ffmpeg_refuses_is_told(tmp_path):
    with pytest.raises(RuntimeError, match="ffmpeg failed: "):
        style.write_film(tmp_path / "broken.mp4", [b"no picture"], 1)
    assert not list(tmp_path.iterdir())


def test_nothing_draws_a_plain_thing():
    from gearmbs._display import draw

    with pytest.raises(TypeError, match=says("int", "draws")):
        draw(3)
    assert spectrum_plot(gm.spectrum(signal())).axes

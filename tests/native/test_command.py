"""``gearmbs export``: what files describe, as libraries."""

import shutil

import pytest
from typer.testing import CliRunner

from gearmbs.cli import app
from gearmbs.studies.export import described_model
from gearmbs.studies.presets.files import FOLDER
from tests.native.support import Instance, Library

CASE = '[operation]\nspeed = "1000 rpm"\nrun_up = "10 ms"\nsettling = "10 ms"\nduration = "20 ms"\n'
PLANETARY = '[planetary]\nteeth = [28, 36, 100]\nmodule = "2 mm"\nplanets = 4\n[operation]\nspeeds = { sun = 50.0 }\n'


@pytest.mark.slow
@pytest.mark.skipif(not (shutil.which("cc") or shutil.which("gcc")), reason="no C compiler is installed")
def test_a_case_becomes_a_library(tmp_path):
    file = tmp_path / "pair.toml"
    file.write_text(CASE)
    done = CliRunner().invoke(app, ["export", str(file), "--name", "my pair"])
    assert done.exit_code == 0, done.output
    assert f"wrote {tmp_path / 'pair' / 'my_pair.so'}" in done.output
    library = Library(tmp_path / "pair" / "my_pair.so")
    assert library.end_time() == pytest.approx(0.04)
    instance = Instance(library)
    instance.advance(0.001)
    chosen = ["--target", "fmu3", "--inputs", "load.torque", "--outputs", "mesh.transmission_error, ACCX(gear 1.cm)"]
    refused = CliRunner().invoke(app, ["export", str(file), *chosen])
    assert refused.exit_code == 1
    assert "ACCX(gear 1.cm)" in refused.output
    chosen[-1] = 'mesh.transmission_error, mesh.load.fx, FX("mesh.I", "mesh.J") + 0*WZ("mesh.I", "mesh.J")'
    done = CliRunner().invoke(app, ["export", str(file), *chosen])
    assert done.exit_code == 0, done.output
    assert "can be told: 3" in done.output
    done = CliRunner().invoke(app, ["export", str(file), "--name", "lumped", "--lump", "--fixed-pivots"])
    assert done.exit_code == 0, done.output
    lumped = Library(tmp_path / "pair" / "lumped.so")
    assert lumped.output_names == library.output_names
    assert lumped.unknowns() < library.unknowns()


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (["no.toml", "--target", "fmi2"], ["'fmi2'", "did you mean 'fmu2'"]),
        (["no.toml", "--target", "exe"], ["'exe'", "'modelica'"]),
        (["no.toml", "--target", "csv", "--outputs", "a"], ["--outputs", "leave them out"]),
        (["no.toml", "--target", "csv", "--lump"], ["--lump", "leave them out"]),
        ([], ["give a file"]),
    ],
)
def test_what_is_refused(given, told):
    refused = CliRunner().invoke(app, ["export", *given])
    assert refused.exit_code == 1
    for text in told:
        assert text in refused.output


def test_what_there_is():
    targets = CliRunner().invoke(app, ["export", "--target", "list"])
    assert targets.exit_code == 0
    assert [line.split()[0] for line in targets.output.splitlines()] == ["so", "fmu2", "fmu3", "csv", "modelica"]
    processors = CliRunner().invoke(app, ["export", "--processor", "list", "--systems", "linux-arm64"])
    assert {"native", "cortex-a72"} <= set(processors.output.split())


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["planetary set", "drivetrain"])
def test_what_files_describe(kind, tmp_path):
    file = tmp_path / "set.toml"
    file.write_text(PLANETARY)
    mechanism, end, options = described_model(file if kind == "planetary set" else FOLDER / "gearbox.toml")
    assert end > 0.1
    assert options["tol"] > 0.0
    assert ("planet 1" if kind == "planetary set" else "high") in " ".join(mechanism.bodies)

"""Calls as users write them, of each family of keywords that are handed on, some right and some wrong: a type checker
reports each of the latter by its line, and none of the former.
"""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent

GIVEN = """
from collections.abc import Callable
from pathlib import Path
import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.figure import Figure
import gearmbs as gm
from gearmbs.bearings import Bearing, BearingStatics, RollingBearing, add_bearing, stiffness_matrix
from gearmbs.campaigns import Campaign, Factor, make_plan
from gearmbs.dae import solve_dae
from gearmbs.drivetrain import Drivetrain
from gearmbs.flexible import BeamSection, ModalModel, add_beam
from gearmbs.gears import GearPair, GearSpec, IdealMesh, PlanetarySet, planetary
from gearmbs.identify import CaseProblem, compare_models, harmonic_table, identify
from gearmbs.mechanism import Mechanism, Simulator, forward_sensitivities, steady_sensitivities
from gearmbs.mechanism.parts.joints import Joint
from gearmbs.native import export
from gearmbs.signals import (
    analyse, analyse_file, bandpass, compare_files, envelope, envelope_spectrum, estimate_speed, kurtogram, order_map,
    order_track, read_pulses, require, series, spectrogram, spectrum, trend, waterfall,
)
from gearmbs.studies import Case, bearing_rig, case_mechanism, run_case, run_cases, simulate_case, steady
from gearmbs.view import (
    Scene, order_map_plot, order_track_plot, planetary_scene, report_plot, spectrogram_plot, waterfall_plot,
)

path: Path
case: Case
signal: xr.DataArray
table: pd.DataFrame
build: Callable[..., Mechanism]
equations: Callable[..., None]
m: Mechanism
joint: Joint
sim: Simulator
solution: gm.Solution
train: Drivetrain
pair: GearPair
gears: PlanetarySet
bearing: Bearing
model: ModalModel
section: BeamSection
problem: CaseProblem
factor: Factor
campaign: Campaign
scene: Scene
files = {"low": {"healthy": path}}
"""
"""What the calls are about."""

RIGHT = """
analyse(signal, 24, speed="1200 rpm", half_width=0.2, lines=3)
analyse(path, planetary=(28, 36, 100), planets=4, rate="10 kHz")
analyse_file(path, teeth=24, channels=["a"], format="csv")
compare_files(files, teeth=24, reference="healthy", quantity="acceleration", band=("100 Hz", "5 kHz"))
trend(path, "10 s", teeth=24, units="g", format="csv")
series([path], teeth=24, speed="1200 rpm", gaps="longest")
spectrum(np.zeros(4096), rate="10 kHz", units="g")
envelope_spectrum(path, channels=["a"], gaps="longest")
kurtogram(signal, levels=5)
spectrogram(signal, segment="50 ms", tacho="tacho", rate="10 kHz")
waterfall(signal, steps=20, speed_channel="speed")
order_map(signal, "1200 rpm", revolutions=8.0, units="g")
order_track(signal, orders=(1, 24), tacho="tacho", pulses_per_rev=2)
spectrogram_plot(signal, maximum="2 kHz", segment="50 ms", speed="1200 rpm")
order_map_plot(signal, marked=(24,), speed="1200 rpm", revolutions=8.0)
waterfall_plot(signal, style="map", steps=20, tacho="tacho")
order_track_plot(signal, orders=(24,), speed="1200 rpm")
report_plot(analyse(signal, 24), signal, tacho="tacho")
read_pulses(path, 1024, clock="20 MHz", faults="keep")
harmonic_table({"low": signal}, teeth=24, speed=125.0)
run_case(case, False, variables=["gmf_rms"])
simulate_case(case, max_step=1e-4, dense_output=True)
case_mechanism(case, "6206/CN", cage_slip=0.01, damping="10 us")
bearing_rig(bearing, speed="1800 rpm", defects=(), slip_scatter=0.01)
case.changed(name="faster", operation={"speed": "1500 rpm"})
Case(name="own", gears={"teeth": (21, 34), "module": "2.5 mm"}, fault={"teeth": "broken tooth", "backlash": 1e-4})
Case(operation={"speed": [("0 s", "0 rpm"), ("2 s", "3000 rpm")], "duration": "auto"}, solver={"lump": True})
levels: list[xr.Dataset] = run_cases([case], workers=2)
failures = [one for one in run_cases([case], errors="keep") if not isinstance(one, xr.Dataset)]
bandpass(signal, "500 Hz", 2e3, transition="50 Hz", channels=["a"])
envelope(signal, ("1 kHz", "3 kHz"), transition="100 Hz")
envelope_spectrum(signal, ("1 kHz", "3 kHz"), segment="0.5 s")
estimate_speed(signal, 24, speed_range=("600 rpm", "3000 rpm"))
record: xr.Dataset = steady(case, most=100).record
steady(m, "2 ms", settle=3)
steady(train, attracting=False)
steady_sensitivities(build, {"stiffness": 1e8}, "2 ms", settle=3)
forward_sensitivities(build, {"stiffness": 1e8}, "1 s", rate="1 kHz", max_order=3)
solve_dae(equations, (0.0, 1.0), [1.0], max_order=3, dense_output=True, names=["y"])
identify(table, case, ["contact.depth"], gains="one", workers=2)
compare_models({"skew": problem}, starts=3, loss="linear")
GearPair.paper(face_width="25 mm", torque="80 N m")
pair.with_changes(input_torque="50 N m", faults=[])
GearSpec.ring(56, "2 mm", addendum="2 mm", bore_radius=0.0)
GearSpec.from_radii(29, "3 mm", "47 mm", "40 mm", name="z1", helix_angle="10 deg")
IdealMesh.from_contact(pair, damping="100 N s/m", backlash=True)
IdealMesh.with_damping_ratio(pair, "4e8 N/m", backlash=True, depth="1 um")
planetary((28, 36, 100), "2 mm", 4, backlash_sun="0.1 mm", name="set")
Bearing.from_designation("6205", clearance="8 um")
bearing.changed(designation="mine", dynamic_rating="14 kN")
RollingBearing("a", m.ground.marker(), m.ground.marker(), bearing, preload="100 N")
RollingBearing.between("a", m.ground, m.ground, bearing, at=(0, 0, 0), slices=7)
add_bearing(m, "a", m.ground.marker(), m.ground.marker(), bearing, sense=-1)
BearingStatics(bearing, speed="1500 rpm", centrifugal=True)
stiffness_matrix(bearing, [1e3, 0, 0], speed="1500 rpm", smooth="2 um")
m.friction("dry", joint, 0.2, 0.1, pin_radius="10 mm", max_torque=None)
model.add_to(m, position=(0, 0, 1), velocity=(1, 0, 0))
add_beam(m, "beam", section, (0, 0, 0), (1, 0, 0), angular_velocity=(0, 0, 1))
train.of_same_bodies(loads=[])
export(m, path, t_end="1 s", lump=True, max_step=1e-3)
make_plan(case, [factor], n=8, unit=4, time_limit="60 s", reuse=path.name)
campaign.export(path, "csv", test=0.2)
scene.save(path, azimuth=30.0, title="stage")
planetary_scene(gears, m, joints=True, through=["ring"])
planetary_scene(gears, solution, frames=20, forces=False)
figure: Figure = case.plot(title="case")
angle: float = sim.get("joint_angle", "pin") + sim.get("input", "motor")
force, torque = sim.get("reaction", "pin")
power: float = sim.get("diagnostics", "mesh")["damping_power"]
length: int = len(require(signal, "teeth", needed_for="the mesh")) + round(require(signal, "rate", needed_for="it"))
""".strip().splitlines()
"""Calls that are all right."""

WRONG = """
analyse(signal, 24, half_widht=0.2)
analyse(signal, 24, lines="three")
analyse_file(path, teeths=24)
compare_files(files, scope="loads")
trend(path, "10 s", rates="10 kHz")
series([path], teeth=24, half_with=0.2)
spectrum(np.zeros(4096), rates="10 kHz")
envelope_spectrum(path, channels=1)
kurtogram(signal, level=5)
spectrogram(signal, tako="tacho")
waterfall(signal, pulses_per_rev="two")
order_map(signal, revs=8.0)
order_track(signal, tachometer="tacho")
spectrogram_plot(signal, scaling="loud")
order_map_plot(signal, scalling="rms")
waterfall_plot(signal, segments="50 ms")
order_track_plot(signal, order=(24,))
read_pulses(path, 1024, faults="mended")
harmonic_table({"low": signal}, tooth=24)
run_case(case, lump=True)
simulate_case(case, maxstep=1e-4)
simulate_case(case, rate=1e4)
case_mechanism(case, "6206/CN", cageslip=0.01)
bearing_rig(bearing, speed="1800 rpm", slip_seed="first")
case.changed(operations={"speed": "1500 rpm"})
case.changed(name=3)
Case(operation={"sped": "1500 rpm"})
Case(name="own", gear={"teeth": (21, 34)})
Case(gears={"teeth": (21, 34), "module": ["2.5", "mm"]})
case.changed(solver={"tolerance": "1e-7"})
bandpass(signal, "500 Hz", None, transition="50 Hz")
one_record: xr.Dataset = run_cases([case], errors="keep")[0]
steady(case, "2 ms")
steady(m)
steady(train, settel=3)
steady_sensitivities(build, {"stiffness": 1e8}, "2 ms", settle="three")
forward_sensitivities(build, {"stiffness": 1e8}, "1 s", dense_output=True)
solve_dae(equations, (0.0, 1.0), [1.0], max_ordre=3)
solve_dae(equations, (0.0, 1.0), [1.0], max_order="three")
identify(table, case, ["contact.depth"], gains="two")
compare_models({"skew": problem}, start=3)
GearPair.paper(plane="skewed")
pair.with_changes(face_width="25 mm")
GearSpec.ring(56, "2 mm", internal=True)
GearSpec.from_radii(29, "3 mm", "47 mm", "40 mm", addendum="3 mm")
IdealMesh.from_contact(pair, error=[0.0])
IdealMesh.with_damping_ratio(pair, "4e8 N/m", damping=100.0)
planetary((28, 36, 100), "2 mm", 4, backlash="0.1 mm")
Bearing.from_designation("6205", clearence="8 um")
bearing.changed(elements="nine")
RollingBearing("a", m.ground.marker(), m.ground.marker(), bearing, preloaded="100 N")
BearingStatics(bearing, speeds="1500 rpm")
stiffness_matrix(bearing, [1e3, 0, 0], slices="seven")
m.friction("dry", joint, 0.2, 0.1, pin_radii="10 mm")
model.add_to(m, com=(0, 0, 1))
train.of_same_bodies(load=[])
export(m, path, t_end="1 s", record=True)
make_plan(case, [factor], n=8, time_limits="60 s")
make_plan(case, [factor], n=8, unit="four")
campaign.export(path, "csv", test_share=0.2)
scene.save(path, azimut=30.0)
planetary_scene(gears, m, frames=20)
case.plot(titel="case")
path_of: Path = case.plot()
vector: np.ndarray = sim.get("joint_angle", "pin")
number: float = require(signal, "teeth", needed_for="the mesh")
""".strip().splitlines()
"""Calls with a misspelt keyword, one of another function, or a value of another type."""


@pytest.mark.slow
def test_a_type_checker_reports_wrong_calls_and_no_right_ones(tmp_path):
    pytest.importorskip("mypy")
    program = tmp_path / "calls.py"
    lines = [*GIVEN.splitlines(), *RIGHT, *WRONG]
    program.write_text("\n".join(lines) + "\n")
    command = [sys.executable, "-m", "mypy", str(program)]
    told = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False).stdout
    reported = {int(n) for n in re.findall(r"calls\.py:(\d+): error: ", told)}
    wrong = {n for n, line in enumerate(lines, 1) if line in WRONG}
    assert len(wrong) == len(WRONG)
    assert [lines[n - 1] for n in sorted(wrong - reported)] == []
    assert [lines[n - 1] for n in sorted(reported - wrong)] == [], told

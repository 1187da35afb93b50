"""What meshes of drivetrains and planetary sets are made of: stiffness of their wheels, damping ratio, and names."""

import json
import math
import traceback
import warnings

import numpy as np
import pytest

import gearmbs as gm
from gearmbs.drivetrain import (
    Drivetrain,
    DrivetrainError,
    GearMesh,
    IdealBearing,
    RunSettings,
    Shaft,
    TorqueLoad,
    TorsionalModel,
    TorsionalSpring,
)
from gearmbs.drivetrain.description import make_description
from gearmbs.flexible import ShaftSection
from gearmbs.gears import ContactLaw, FlankFriction, GearPair, GearSpec, IdealMesh, loaded_transmission_error, planetary
from gearmbs.gears.iso6336 import iso_mesh_stiffness, iso_single_stiffness
from gearmbs.gears.mesh import DAMPING_RATIO
from gearmbs.signals import SignalError
from gearmbs.studies import bench_train, run_train, train_campbell, train_modes, train_report
from tests.drivetrain.support import stage
from tests.generators import cases, seed
from tests.says import says

LIGHT = 1.0
"""N m: deflections so small that tips do not bear beyond the path of contact."""


def meshed(**settings):
    return stage(
        meshes=[GearMesh(name="mesh", driver="pinion", driven="gear", settings={"backlash": "0.1 mm", **settings})]
    )


def random_pair(rng):
    """Return two wheels that mesh: spur or helical, external or internal."""
    while True:
        try:
            return any_pair(rng)
        except ValueError:
            # tips and roots that foul each other: draw again
            continue


def any_pair(rng):
    """Return two wheels, or raise ValueError where they do not mesh."""
    module = float(rng.choice([1.5, 2.0, 3.0, 5.0])) * 1e-3
    width = float(rng.uniform(6, 12)) * module
    helix = math.radians(float(rng.choice([0.0, 0.0, 10.0, 20.0, 28.0])))
    one = GearSpec(int(rng.integers(18, 35)), module, face_width=width, helix_angle=helix)
    teeth = int(rng.integers(40, 90))
    if rng.random() < 0.3:
        two = GearSpec.ring(one.teeth + teeth, module, face_width=width, helix_angle=helix)
    else:
        two = GearSpec(teeth, module, face_width=width, helix_angle=helix, hand="left")
    return GearPair(one, two, backlash=0.1 * module, torque=LIGHT, friction=FlankFriction.none())


@pytest.mark.slow
def test_own_stiffness_is_that_of_the_standard_in_the_mean():
    """The kernel's quasi-static mesh stiffness against c_gamma b, and the damping ratio of the bare wheels on it."""
    rng = np.random.default_rng(seed())
    for _ in range(cases(8)):
        pair = random_pair(rng).with_own_stiffness()
        wanted = iso_mesh_stiffness(pair.geometry) * pair.common_face_width
        found = float(loaded_transmission_error(pair, points=100).stiffness.mean())
        # 100 angles of the driver say where pairs come and go to a hundredth of the cycle, light loads a little later
        assert found == pytest.approx(wanted, rel=0.03), repr(pair)
        one, two = pair.wheels
        mass = 1 / (one.base_radius**2 / one.inertia[2] + two.base_radius**2 / two.inertia[2])
        mean = pair.contact.damping / pair.contact.stiffness * wanted
        assert mean / (2 * math.sqrt(wanted * mass)) == pytest.approx(DAMPING_RATIO, rel=1e-9)


def test_default_of_a_drivetrain():
    train = meshed()
    law = train.pairs["mesh"].contact
    assert (law.kind, law.exponent) == ("linear", 1.0)
    wheels = GearPair(*train.pairs["mesh"].wheels)
    assert law == wheels.with_own_stiffness("iso", DAMPING_RATIO).contact
    single = meshed(stiffness="iso single", damping_ratio=0.02).pairs["mesh"]
    assert single.contact.stiffness == pytest.approx(iso_single_stiffness(wheels.geometry) * wheels.common_face_width)
    varied = meshed(stiffness_curve="potential-energy").pairs["mesh"]
    assert varied.stiffness_curve == "potential-energy"
    assert varied.contact == meshed(stiffness="potential-energy").pairs["mesh"].contact
    assert meshed(stiffness="3e8 N/m").pairs["mesh"].contact.stiffness == 3e8
    # a law is taken back by None, as in the bench that names the paper's
    bench = bench_train().changed("pair 1", settings={"contact": None, "damping_ratio": 0.05})
    assert bench.pairs["pair 1"].contact == bench.pairs["pair 1"].with_own_stiffness(damping_ratio=0.05).contact
    assert bench.pairs["pair 2"].contact == ContactLaw.impact()
    # the paper's law is there for whoever names it
    assert meshed(contact={"kind": "impact"}).pairs["mesh"].contact == ContactLaw.impact()


def test_laws_in_files():
    table = {
        "shafts": {"a": {"diameter": "30 mm"}, "b": {}},
        "wheels": {
            "p": {"shaft": "a", "teeth": 20, "module": "3 mm"},
            "g": {"shaft": "b", "teeth": 60, "module": "3 mm"},
        },
        "meshes": {"mesh": {"driver": "p", "driven": "g", "backlash": "0.1 mm"}},
        "bearings": {"one": {"shaft": "a"}, "two": {"shaft": "b"}},
        "drives": {"motor": {"shaft": "a", "speed": "1500 rpm"}},
        "loads": {"brake": {"shaft": "b", "torque": "300 N m"}},
    }
    plain = make_description(table).train.pairs["mesh"]
    assert plain.contact == plain.with_own_stiffness().contact
    table["meshes"]["mesh"] |= {"stiffness": "iso single", "damping_ratio": 0.03}
    told = make_description(table).train.pairs["mesh"]
    assert told.contact == told.with_own_stiffness("iso single", 0.03).contact


def test_default_of_a_planetary_set():
    gears = planetary((24, 30, 84), "1.5 mm")
    for pairs in (gears.pairs_sun, gears.pairs_ring):
        assert pairs[0].contact == pairs[0].with_own_stiffness().contact
    assert "linear" in gears.law("ring")
    told = planetary((24, 30, 84), "1.5 mm", stiffness="iso single", damping_ratio=0.1).pairs_sun[0]
    assert told.contact == told.with_own_stiffness("iso single", 0.1).contact
    paper = planetary((24, 30, 84), "1.5 mm", contact=ContactLaw.impact())
    assert paper.pairs_ring[0].contact == ContactLaw.impact()
    with pytest.raises(ValueError, match=r"PlanetarySet.damping_ratio is 0.1 beside contact"):
        planetary((24, 30, 84), "1.5 mm", contact=ContactLaw.impact(), damping_ratio=0.1)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (
            {"stiffness": "iso", "contact": {"kind": "linear", "stiffness": "3e8 N/m"}},
            "stiffness is 'iso' beside contact",
        ),
        ({"damping_ratio": 0.05, "contact": ContactLaw.impact()}, "damping_ratio is 0.05 beside contact"),
        ({"stiffness": "din"}, "stiffness is 'din'; choose 'iso', 'iso single' or 'potential-energy'"),
        ({"damping_ratio": -0.1}, says("damping_ratio", "-0.1", "give a number")),
        ({"torque": "300 N m"}, says("drives and loads")),
        ({"input_torque": "300 N m"}, says("input_torque", "drives and loads")),
    ],
)
def test_settings_that_contradict(settings, message):
    with pytest.raises(DrivetrainError, match=message):
        meshed(**settings)


def test_mesh_mode_of_the_default_oscillates():
    """Rigid shafts in joints, the input held: the one mode is the output on its mesh; by hand it has k r^2 / J."""
    train = meshed()
    found = train.mesh_dynamics["mesh"]
    inertia = train.torsional().inertias[1]
    assert found.mass == pytest.approx(inertia / train.pairs["mesh"].driven.base_radius ** 2)
    assert 0.02 < found.damping_ratio < 0.2
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*counted twice")
        modes = train_modes(train)
    assert "oscillating" in modes.kinds
    # at rest one or two pairs touch: c_gamma / epsilon or twice that, in the mean c_gamma
    ratio = train.pairs["mesh"].contact_ratio
    possible = [found.frequency * math.sqrt(n / ratio) for n in (1, 2)]
    assert min(abs(modes.frequencies[-1] / f - 1) for f in possible) < 0.01


@pytest.mark.parametrize("contact", [{}, {"contact": ContactLaw.impact(damping="20 N*s/mm")}])
def test_chain_of_faces_in_mesh_in_part(contact):
    """Half of the faces in mesh: as the tangent stiffness of the contact itself under the load, and so the modes."""
    whole, half = meshed(**contact), meshed(**contact, axial_shift="10 mm")
    found = half.mesh_dynamics["mesh"]
    if not contact:
        assert found.stiffness == pytest.approx(0.5 * whole.mesh_dynamics["mesh"].stiffness)
        assert found.damping_ratio == pytest.approx(whole.mesh_dynamics["mesh"].damping_ratio)
        frequencies = [train.torsional().frequencies()[-1] for train in (half, whole)]
        assert frequencies[0] == pytest.approx(frequencies[1] * math.sqrt(0.5))
        # an ideal mesh takes the stiffness of the wheels as they stand
        spring = stage(
            meshes=[GearMesh(name="mesh", driver="pinion", driven="gear", pair=IdealMesh,
                             settings={"backlash": "0.1 mm", "axial_shift": "10 mm"})]
        )  # fmt: skip
        assert spring.mesh_dynamics["mesh"].stiffness == pytest.approx(found.stiffness)
    # light loads: tips that bear beyond the path of contact lengthen it
    light = half.with_parts(TorqueLoad(name="brake", shaft="out", torque=LIGHT))
    loaded = loaded_transmission_error(light.pairs["mesh"], points=100).stiffness.mean()
    assert light.mesh_dynamics["mesh"].stiffness == pytest.approx(loaded, rel=0.04)


@pytest.mark.parametrize("torque", [1.0, 300.0])
@pytest.mark.parametrize("tilt", ["0.2 deg", "1 deg"])
def test_chain_of_tilted_wheels_has_the_modes_of_the_whole_train(tilt, torque):
    """A part of the face carries: the lighter the load, the smaller, and the chain of parallel wheels is far off."""
    brake = TorqueLoad(name="brake", shaft="out", torque=torque)
    train = meshed(misalignment=tilt, backlash="0.6 mm").with_parts(brake)
    parallel = meshed(backlash="0.6 mm").with_parts(brake)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*counted twice")
        chain, whole = train.torsional(), train_modes(train)
        assert "mesh" in repr(train)
    assert chain.frequencies()[-1] < 0.8 * parallel.torsional().frequencies()[-1]
    # one position of the wheels has more or fewer pairs in contact than the mean
    assert chain.frequencies()[-1] == pytest.approx(whole.frequencies[-1], rel=0.05)
    found, before = (one.mesh_dynamics["mesh"] for one in (train, parallel))
    assert found.stiffness == pytest.approx(loaded_transmission_error(train.pairs["mesh"], points=50).stiffness.mean())
    assert found.damping / found.stiffness == pytest.approx(before.damping / before.stiffness)


def test_chain_of_tilted_wheels_without_load_is_warned_of():
    train = meshed(misalignment="0.2 deg", backlash="0.6 mm")
    empty = train.with_parts(TorqueLoad(name="brake", shaft="out", torque=0.0))
    with pytest.warns(UserWarning, match=says("mesh 'mesh'", "misalignment", "0.2 deg", "give", "without load")):
        chain = empty.torsional()
    assert chain.frequencies()[-1] == pytest.approx(meshed(backlash="0.6 mm").torsional().frequencies()[-1])
    # an ideal mesh is the spring it was given
    spring = stage(meshes=[GearMesh(name="mesh", driver="pinion", driven="gear", pair=IdealMesh,
                                    settings={"backlash": "0.6 mm", "stiffness": "4e8 N/m",
                                              "misalignment": "0.2 deg"})])  # fmt: skip
    assert spring.torsional().springs[0].stiffness == pytest.approx(4e8)
    with pytest.warns(UserWarning, match=says("mesh 'mesh'", "misalignment", "0.2 deg", "stiffness 'iso'")):
        stage(meshes=[GearMesh(name="mesh", driver="pinion", driven="gear", pair=IdealMesh,
                               settings={"backlash": "0.6 mm", "misalignment": "0.2 deg"})])  # fmt: skip


@pytest.mark.slow
def test_overdamped_meshes_are_warned_of():
    hard = ContactLaw.linear("3e8 N/m", "1e5 N*s/m", "2 um")
    for contact in (ContactLaw.impact(depth="0.01 mm"), ContactLaw.impact(), hard):
        train = meshed(contact=contact)
        assert train.mesh_dynamics["mesh"].damping_ratio > 1
        damped = says("mesh 'mesh'", "damped")
        for analysis in (train_modes, Drivetrain.torsional):
            with pytest.warns(UserWarning, match=damped):
                analysis(train)
        # the only mode of the train does not oscillate then, and its diagram would be empty
        with pytest.warns(UserWarning, match=damped), pytest.raises(SignalError, match="no mode oscillates"):
            train_campbell(train)
    # a twin below critical damping
    train = meshed(contact=ContactLaw.linear("3e8 N/m", "2e3 N*s/m", "2 um"))
    assert train.mesh_dynamics["mesh"].damping_ratio < 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*counted twice")
        train.torsional()


def test_chain_tells_frequencies_of_what_oscillates():
    """Two inertias on a spring and one on a damper: sqrt(k / m) and, above critical damping, none."""
    masses = np.array([2.0, 2.0, 1.0])
    shaft = TorsionalSpring("shaft", (0, 1), (1.0, -1.0), 100.0, 0.5)

    def chain(damping):
        held = TorsionalSpring("stop", (2, 3), (1.0, -1.0), 100.0, damping)
        return TorsionalModel(("a", "b", "c", "wall"), np.append(masses, 1.0), (shaft, held), np.zeros(4), (3,))

    own = 10.0 / (2.0 * math.pi)
    assert chain(1.0).frequencies() == pytest.approx([0.0, own, own])
    hard = chain(50.0)
    assert hard.frequencies() == pytest.approx([0.0, own])
    assert np.count_nonzero(hard.damping_ratios() > 1.0) == 1
    # its undamped frequency stays among the modes
    assert hard.modes()[0] == pytest.approx([0.0, own, own])
    assert "1 rigid, 1 over-damped" in repr(hard)


@pytest.mark.parametrize("phase", ["x", True, math.nan, math.inf])
def test_phase_is_a_number(phase):
    with pytest.raises(DrivetrainError, match=says("mesh 'mesh'", "phase", "give a number")):
        GearMesh(name="mesh", driver="pinion", driven="gear", phase=phase)
    assert GearMesh(name="mesh", driver="pinion", driven="gear", phase=np.float64(0.5)).phase == 0.5


@pytest.mark.parametrize("harmonics", [0, -1, 2.5, True, "3"])
def test_harmonics_are_a_whole_number(harmonics):
    with pytest.raises(DrivetrainError, match=says("run.harmonics", "1", "give a whole number")):
        RunSettings(harmonics=harmonics)
    assert RunSettings(harmonics=1).harmonics == 1


def test_records_and_reports_name_the_law():
    train = meshed()
    record = run_train(train, RunSettings(settling=0.0, duration=0.03))
    law = str(train.pairs["mesh"].contact)
    told = json.loads(record.attrs["mesh_laws"])["mesh"]
    assert told["law"] == law
    assert told["stiffness"] == pytest.approx(iso_mesh_stiffness(train.pairs["mesh"].geometry) * 0.02, rel=1e-6)
    assert law in train_report(train, record)
    assert law in repr(train)
    assert law in train._repr_html_()
    assert law in repr(train.pairs["mesh"])
    assert law in train.pairs["mesh"]._repr_html_()
    assert "1 drive, 1 load" in repr(train)


def ideal(*wheels, **others):
    """Return an ideal mesh as somebody makes it by himself."""
    return IdealMesh(GearPair(*wheels, **others), "4e8 N/m", "500 N*s/m")


@pytest.mark.parametrize("kind", [IdealMesh, ideal])
def test_ideal_mesh_in_a_drivetrain(kind):
    train = stage(
        meshes=[GearMesh(name="mesh", driver="pinion", driven="gear", settings={"backlash": "0.1 mm"}, pair=kind)]
    )
    mesh = train.pairs["mesh"]
    assert isinstance(mesh, IdealMesh)
    found = train.mesh_dynamics["mesh"]
    assert found.stiffness == pytest.approx(mesh.stiffness)
    assert found.damping == pytest.approx(mesh.damping)
    modes = train_modes(train)
    assert modes.frequencies[-1] == pytest.approx(found.frequency, rel=1e-3)
    record = run_train(train, RunSettings(settling=0.02, duration=0.03))
    radius = train.pairs["mesh"].geometry.driven.base_radius
    assert float(record.normal_force.mean()) == pytest.approx(300.0 / radius, rel=1e-3)
    assert float(record.transmission_error.mean()) == pytest.approx(300.0 / radius / mesh.stiffness, rel=1e-2)
    assert "ideal" in train_report(train, record)


def test_ideal_mesh_of_the_wheels():
    train = stage(meshes=[GearMesh(name="mesh", driver="pinion", driven="gear", pair=IdealMesh,
                                   settings={"stiffness": "4e8 N/m", "damping_ratio": 0.1, "ideal_backlash": True,
                                             "backlash": "0.1 mm"})])  # fmt: skip
    mesh = train.pairs["mesh"]
    assert (mesh.stiffness, mesh.backlash) == (4e8, True)
    assert mesh.damping == pytest.approx(0.2 * math.sqrt(4e8 * mesh.pair.reduced_mass))


def test_the_torque_of_either_shaft():
    one, two = GearSpec(20, "3 mm"), GearSpec(60, "3 mm")
    by_output, by_input = GearPair(one, two, torque="300 N m"), GearPair(one, two, input_torque="100 N m")
    assert by_input == by_output
    assert by_input.normal_force == pytest.approx(100.0 / one.base_radius)
    assert by_output.with_changes(input_torque=50.0).torque == pytest.approx(150.0)
    assert "300 N m on the driven wheel" in repr(by_output)
    assert GearPair(one, two).torque == 100.0
    with pytest.raises(ValueError, match=says("torque", "300.0", "driven wheel", "input_torque 100.0")):
        GearPair(one, two, torque=300.0, input_torque=100.0)
    with pytest.raises(gm.CaseError, match="torque is that"):
        gm.Case(operation={"input_torque": "100 N m"})


def test_diameters_and_radii():
    by_radius, by_diameter = Shaft(name="a", radius="15 mm"), Shaft(name="a", diameter="30 mm")
    assert by_radius.body() == by_diameter.body() == Shaft(name="a").body()
    pairs = [("100 mm", "15 mm"), ("50 mm", "20 mm")]
    tables = [{"length": "100 mm", "diameter": "30 mm"}, {"radius": "20 mm", "length": "50 mm"}]
    flexible = [ShaftSection("100 mm", "30 mm"), ShaftSection("50 mm", "40 mm")]
    made = [Shaft(name="a", sections=sections) for sections in (pairs, tables, flexible)]
    for one in made:
        assert np.array(one.cylinders) == pytest.approx(np.array([(0.1, 0.015), (0.05, 0.02)]))
    with pytest.raises(DrivetrainError, match=says("radius", "0.015 m", "diameter 0.03 m", "give")):
        Shaft(name="a", radius="15 mm", diameter="30 mm")
    with pytest.raises(DrivetrainError, match=says("sections", "give diameter")):
        Shaft(name="a", diameter="30 mm", sections=pairs)
    bored = Shaft(name="a", sections=[ShaftSection("100 mm", "30 mm", inner="10 mm")])
    assert bored.body()[0] == pytest.approx(7850.0 * np.pi / 4 * (0.03**2 - 0.01**2) * 0.1)
    with pytest.raises(DrivetrainError, match="give length and diameter"):
        Shaft(name="a", sections=[{"length": 0.1, "width": 0.2}])


def test_lines_of_any_harmonic():
    """Every harmonic of the mesh, and every sideband, is found by its name."""
    train = stage()
    gmf, turns = 500.0, 25.0
    rng = np.random.default_rng(seed())
    for _ in range(cases(25)):
        h, k = int(rng.integers(1, 60)), int(rng.integers(-2, 3))
        name, off = train.kinematics.nearest(h * gmf + k * turns)
        assert abs(off) < 1e-9 * gmf
        if k == 0:
            assert name == f"{h} x GMF of mesh"
        elif abs(h * gmf + k * turns) > 3 * turns:
            assert name == f"{h} x GMF of mesh {k:+d} x in"
    assert train.kinematics.nearest("2 kHz")[0] == "4 x GMF of mesh"
    # an upper bound is kept where one is given
    assert train.kinematics.nearest(2000.0, harmonics=3)[1] != 0.0
    still = stage(
        drives=[],
        loads=[],
        meshes=[],
        wheels=[],
        shafts=[Shaft(name="in")],
        bearings=[IdealBearing(name="a", shaft="in")],
    )
    with pytest.raises(DrivetrainError, match="nothing turns"):
        still.kinematics.nearest(100.0)


def test_errors_are_one_traceback():
    with pytest.raises(DrivetrainError) as caught:
        meshed(misalignment="1 apple")
    told = "".join(traceback.format_exception(caught.value))
    assert told.count("Traceback") == 1

"""Drivetrains whose shafts bend and whose housing is of finite elements, against matrices assembled here."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

from gearmbs.drivetrain import (
    Accelerometer,
    Drivetrain,
    DrivetrainError,
    GearMesh,
    Housing,
    Laser,
    Mount,
    RunSettings,
    Shaft,
    SpeedDrive,
    TorqueLoad,
    Wheel,
)
from gearmbs.drivetrain.description import read_description
from gearmbs.flexible import Interface, block_mesh, mnf_of, nodes_where, reduce_model, solid_model, write_mnf
from gearmbs.gears import GearSpec, IdealMesh
from gearmbs.studies import mode_table, named_modes, ranked_crossings, run_train, train_campbell, train_modes
from tests.drivetrain.assembled import Assembly, normal_at_pitch_point
from tests.says import says

K_MESH, K_BEARING, TIME = 4e8, (2e8, 2e8, 1e8), 1e-5
SPEED = SpeedDrive(name="motor", shaft="input", speed="1500 rpm")


def helical(teeth, module, hand, bore="20 mm"):
    return GearSpec(teeth, module, face_width="25 mm", helix_angle="15 deg", hand=hand, bore_radius=bore)


def bearing(station, **others):
    return {"station": station, "kind": "elastic", "stiffness": K_BEARING, "damping_time": TIME, **others}


def mesh(name, driver, driven, direction=0.0, **others):
    settings = {"backlash": "0.1 mm", "stiffness": K_MESH, "damping_ratio": 0.0}
    return GearMesh(name=name, driver=driver, driven=driven, direction=direction, settings=settings, pair=IdealMesh,
                    **others)  # fmt: skip


def box(modes, elements=6, **shafts):
    """Two helical stages on six elastic bearings, without damping in shafts and meshes."""
    bends = {"length": "240 mm", "modes": modes, "elements": elements, "damping": 0.0, **shafts}
    # overhangs alike would have equal modes
    ends, others = ("26 mm", "214 mm"), ("30 mm", "214 mm")
    return Drivetrain(
        "box",
        shafts=[
            Shaft(name="input", diameter="30 mm", wheels={"z1": ("80 mm", helical(21, "3 mm", "right", "15 mm"))},
                  bearings=dict(zip("ab", map(bearing, ends))), **bends),
            Shaft(name="lay", diameter="40 mm",
                  wheels={"z2": ("80 mm", helical(52, "3 mm", "left")), "z3": ("150 mm", helical(19, "4 mm", "left"))},
                  bearings=dict(zip("cd", map(bearing, others))), **bends),
            Shaft(name="output", diameter="40 mm", wheels={"z4": ("150 mm", helical(47, "4 mm", "right"))},
                  bearings=dict(zip("ef", map(bearing, ends))), **bends),
        ],
        meshes=[mesh("stage 1", "z1", "z2"), mesh("stage 2", "z3", "z4", "60 deg")],
        drives=[SPEED],
        loads=[TorqueLoad(name="brake", shaft="output", torque=1e-6)],
    )  # fmt: skip


def assembly_of(train, diameters):
    """Return the matrices of a train with its discs, without springs."""
    seats = train.layout.seats
    out = Assembly([(train.modal_models[s.name].positions[:, 2], d, seats[s.name].origin[:2])
                    for s, d in zip(train.shafts, diameters)])  # fmt: skip
    names = [s.name for s in train.shafts]
    for wheel in train.wheels:
        across, _, polar = wheel.gear.inertia
        out.disc(names.index(wheel.shaft), wheel.station, wheel.gear.mass, across, polar)
    return out, names


def add_meshes(out, train, names, senses):
    rows = []
    for one, sense in zip(train.meshes, senses):
        driver, driven = train.wheels_of(one)
        places = [(names.index(w.shaft), w.station) for w in (driver, driven)]
        normal, point = normal_at_pitch_point(
            out.point(*places[0]), out.point(*places[1]), (driver.gear.base_radius, driven.gear.base_radius),
            driver.gear.base_helix_angle, sense, driver.gear.hand == "right",
        )  # fmt: skip
        rows.append(out.mesh(*places, normal, point, K_MESH))
    return rows


def box_assembly(train):
    out, names = assembly_of(train, (0.03, 0.04, 0.04))
    for one in train.bearings:
        out.bearing(names.index(one.shaft), one.station, K_BEARING, TIME)
    add_meshes(out, train, names, (1, -1))
    return out


def oscillating(train):
    found = train_modes(train)
    return np.sort(found.frequencies[found.oscillating])


def without_damping(train):
    return train.with_parts(*(replace(b, damping_time=0.0) for b in train.bearings))


@pytest.mark.slow
def test_with_all_modes_a_helical_box_has_the_frequencies_of_its_matrices():
    train = without_damping(box("all"))
    found = oscillating(train)
    matrices = box_assembly(train)
    expected = matrices.frequencies([matrices.row(0, 0.0) + 5])
    assert found.size == expected.size
    np.testing.assert_allclose(found, expected, rtol=1e-7)


@pytest.mark.slow
def test_few_modes_a_shaft_are_near_and_more_are_nearer():
    whole = box_assembly(without_damping(box("all", 8)))
    expected = whole.frequencies([whole.row(0, 0.0) + 5])[:17]
    errors = []
    for modes in (2, 6, 12):
        train = without_damping(box(modes, 8))
        if modes == 6:
            # beside six between the seats, eighteen static ones of four seats
            assert [m.modes for m in train.modal_models.values()] == [24, 24, 24]
        errors.append(np.max(oscillating(train)[:17] / expected - 1.0))
    assert errors[1] < 2e-3
    assert errors[0] > 2.0 * errors[1] > 4.0 * errors[2] > 0.0


@pytest.mark.slow
def test_stiff_shafts_have_the_modes_of_rigid_ones():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        stiff = oscillating(box(2, youngs_modulus=2.1e17))
    rigid = oscillating(box(None))
    np.testing.assert_allclose(stiff[: rigid.size], rigid, rtol=2e-6)


def housed(time=TIME):
    """One helical stage on four bearings in a block of coarse finite elements, on four feet."""
    bends = {"length": "200 mm", "modes": "all", "elements": 3, "damping": 0.0}
    ends = ("50 mm", "150 mm")
    block = solid_model(block_mesh(("300 mm", "150 mm", "200 mm"), (4, 2, 2)), quadratic=False)
    across, along = (5e7, 8e7, 5e7), ((0.0, 0.0), (0.3, 0.0), (0.0, 0.2), (0.3, 0.2))
    feet = [
        Mount(name=f"foot {k}", at=(x, 0, z), stiffness=across, damping=[time * v for v in across], radius="110 mm")
        for k, (x, z) in enumerate(along)
    ]
    seats = dict.fromkeys("abcd", ("220 mm", "150 mm"))
    return Drivetrain(
        "housed",
        shafts=[
            Shaft(name="input", diameter="30 mm", position=(0.08, 0.07, 0.0),
                  wheels={"z1": ("100 mm", helical(21, "3 mm", "right", "15 mm"))},
                  bearings=dict(zip("ab", map(bearing, ends))), **bends),
            Shaft(name="output", diameter="40 mm", wheels={"z2": ("100 mm", helical(52, "3 mm", "left"))},
                  bearings=dict(zip("cd", map(bearing, ends))), **bends),
        ],
        meshes=[mesh("stage", "z1", "z2")],
        housings=[Housing(name="case", model=block, modes="all", mounts=feet, seats=seats, damping=0.0)],
        drives=[SPEED],
        loads=[TorqueLoad(name="brake", shaft="output", torque=1e-6)],
    )  # fmt: skip


def housed_assembly(train):
    """Return the matrices of `housed`, the row of its mesh, and rows of the motion of each bearing's seat."""
    out, names = assembly_of(train, (0.03, 0.04))
    block = train.housings[0].model
    start = out.body(block.stiffness.toarray(), block.mass.toarray())
    across = {"a": 0, "b": 0, "c": 1, "d": 1}
    rows = {}
    for one in train.bearings:
        place = out.point(across[one.name], one.station)
        arms = block.positions - place
        inside = (np.hypot(arms[:, 0], arms[:, 1]) < 0.1105) & (np.abs(arms[:, 2]) < 0.0755)
        rows[one.name] = out.seat(start, block.positions, inside, place)
        out.bearing(across[one.name], one.station, K_BEARING, TIME, rows[one.name])
    for mount in train.housings[0].mounts:
        inside = np.linalg.norm(block.positions - np.array(mount.at), axis=1) <= 0.11
        for row, k, c in zip(out.seat(start, block.positions, inside, mount.at), mount.stiffness, mount.damping):
            out.spring(row, k, c)
    (gear,) = add_meshes(out, train, names, (1,))
    return out, gear, rows


@pytest.mark.slow
def test_a_housing_of_finite_elements_joins_shafts_at_its_seats_as_matrices_do():
    train = without_damping(housed(time=0.0))
    found = oscillating(train)
    matrices, _, _ = housed_assembly(train)
    expected = matrices.frequencies([matrices.row(0, 0.0) + 5])
    assert found.size == expected.size
    np.testing.assert_allclose(found, expected, rtol=1e-7)


@pytest.mark.slow
def test_the_housing_answers_errors_of_the_teeth_as_matrices_do():
    whole = housed()
    matrices, gear, seats = housed_assembly(whole)
    plant = whole.linearize([("transmission_error", "stage")], [("marker_velocity", "c.J", "y")])
    for frequency in (90.0, 400.0, 1300.0):
        expected = matrices.response(K_MESH * gear, frequency, [matrices.row(0, 0.0) + 5])
        moved = seats["c"][1] @ expected
        s = 2j * np.pi * frequency
        states = np.linalg.solve(s * np.eye(len(plant.A)) - plant.A, plant.B[:, 0])
        found = (plant.C[0] @ states + plant.D[0, 0]) / s
        assert abs(abs(found) / abs(moved) / np.cos(0.2457) - 1.0) < 1e-3


@pytest.mark.slow
def test_energy_of_a_box_that_bends_is_closed():
    train = box(4)
    loads = [TorqueLoad(name="brake", shaft="output", torque=200.0)]
    teeth = [GearMesh(name=m.name, driver=m.driver, driven=m.driven, direction=m.direction,
                      settings={"backlash": "0.1 mm"}) for m in train.meshes]  # fmt: skip
    train = Drivetrain("box", shafts=train.shafts, wheels=train.wheels, bearings=train.bearings, meshes=teeth,
                       drives=train.drives, loads=loads, running=True, run_up=0.002)  # fmt: skip
    solution = train.build().simulate(0.004, rate=400000, tol=1e-8, rate_scale=train.rate_scale)
    balance = solution.energy_balance()
    assert abs(balance.attrs["relative_imbalance"]) < 1e-5


@pytest.mark.slow
def test_shares_of_energy_and_damping_are_those_of_the_matrices():
    train = box("all", 4)
    matrices = box_assembly(train)
    free = np.setdiff1d(np.arange(len(matrices.k)), [matrices.row(0, 0.0) + 5])
    squares, shapes = scipy.linalg.eigh(matrices.k[np.ix_(free, free)], matrices.m[np.ix_(free, free)])
    named = named_modes(without_damping(train))
    meshes, names = assembly_of(train, (0.03, 0.04, 0.04))
    rows = add_meshes(meshes, train, names, (1, -1))
    for name, row in zip(("stage 1", "stage 2"), rows):
        expected = K_MESH * (row[free] @ shapes[:, :30]) ** 2 / squares[:30]
        np.testing.assert_allclose(named.energy.sel(part=name).values[:30], expected, atol=1e-6)
    np.testing.assert_allclose(named.energy.sum("part"), 1.0, atol=1e-6)
    np.testing.assert_allclose(named.kinetic.sum("body"), 1.0, atol=1e-12)
    # little damping, which leaves the shapes as they are
    damped = named_modes(train.with_parts(*(replace(b, damping_time=0.01 * TIME) for b in train.bearings)))
    resisting = 0.01 * matrices.c[np.ix_(free, free)]
    expected = np.einsum("dk,de,ek->k", shapes, resisting, shapes) / (2.0 * np.sqrt(squares))
    np.testing.assert_allclose(damped.damping.sum("part").values[:15], expected[:15], rtol=1e-3)
    np.testing.assert_allclose(damped.damping_ratio.values[:15], expected[:15], rtol=1e-3)


@pytest.mark.slow
def test_modes_are_called_by_their_largest_part():
    names = [str(name) for name in named_modes(box("all", 4)).name.values[:12]]
    # across the axis of the lay shaft its bearings are softer than itself
    assert "bending of shaft 'input'" in names
    assert "bearing 'c'" in names
    table = mode_table(named_modes(housed(time=0.0)))
    assert table["name"].iloc[0] == "housing 'case' on its mounts"
    kinds = ["mesh", "shaft", "bearing", "housing", "mount", "load", "other"]
    assert list(table.columns[3:]) == [*kinds, "moves"]
    assert table["moves"].iloc[0].startswith("case ")
    np.testing.assert_allclose(table[kinds].sum(axis=1), 1.0, atol=1e-9)


@pytest.mark.slow
def test_gains_of_crossings_are_the_deflections_that_matrices_have_there():
    train = housed()
    matrices, gear, seats = housed_assembly(train)
    held = [matrices.row(0, 0.0) + 5]
    diagram = train_campbell(train, ["0 rpm", "60000 rpm"], harmonics=1, maximum=12000.0)
    ranked = ranked_crossings(diagram)
    assert list(ranked["gain"]) == sorted(ranked["gain"], reverse=True)
    # by what the housing does of a micrometre across the teeth's normal, at the seat that moves most
    loud = ranked_crossings(diagram, by="response")
    assert list(loud["response"]) == sorted(ranked["response"], reverse=True)
    for row in loud.iloc[[0, 3]].itertuples():
        moved = matrices.response(K_MESH * gear, row.frequency_hz, held) * np.cos(0.2457)
        most = max(np.linalg.norm(np.abs(np.array(three) @ moved)) for three in seats.values())
        assert row.response == pytest.approx(1e-6 * (2.0 * np.pi * row.frequency_hz) ** 2 * most, rel=1e-3)
    with pytest.raises(ValueError, match=says("loudness", "gain", "response")):
        ranked_crossings(diagram, by="loudness")
    best = ranked.iloc[0]
    assert best["order"] == "1 x stage"
    assert best["gain"] > 2.0
    found = gear @ matrices.response(K_MESH * gear, best["frequency_hz"], held)
    assert abs(found) == pytest.approx(best["gain"], rel=0.1)


TOML = """
name = "box"

[shafts.input]
length = "240 mm"
diameter = "30 mm"
modes = 2
bearings.a = ["26 mm", "6206"]
bearings.b = { station = "214 mm", kind = "elastic" }
wheels.z1 = { station = "80 mm", teeth = 21, module = "3 mm", bore_radius = "15 mm" }

[shafts.output]
sections = [
    { length = "100 mm", diameter = "50 mm", bore = "10 mm", end_diameter = "40 mm" },
    { length = "140 mm", radius = "20 mm" },
]
damping = [[1e4, 0.01], [inf, 1.0]]
modes = 2
elements = 40

[wheels.z2]
shaft = "output"
station = "80 mm"
teeth = 52
module = "3 mm"
bore_radius = "20 mm"

[bearings.c]
shaft = "output"
station = "26 mm"
[bearings.d]
shaft = "output"
station = "214 mm"

[meshes.stage]
driver = "z1"
driven = "z2"
backlash = "0.1 mm"

[housings.case]
model = { program = "mnf", files = ["case.mnf"] }
at = [0.0, -0.05, 0.0]
seats = { a = 1, b = 2, c = 3, d = 4 }

[housings.case.mounts]
one = { at = [-0.1, -0.05, 0.0], stiffness = ["5e7 N/m", "5e7 N/m", "5e7 N/m"], radius = "200 mm" }
two = { at = [0.1, -0.05, 0.0], stiffness = [5e7, 5e7, 5e7], radius = "200 mm" }
three = { at = [0.0, -0.05, 0.2], stiffness = [5e7, 5e7, 5e7], radius = "200 mm" }

[drives.motor]
shaft = "input"
speed = "1500 rpm"
"""


@pytest.mark.slow
def test_a_file_says_the_same_with_parts_in_tables_of_their_shafts(tmp_path):
    block = solid_model(block_mesh(("200 mm", "100 mm", "240 mm"), (2, 2, 3)), quadratic=False)
    model = reduce_model(block, [Interface("all", block.ids[::5].tolist(), "average")], modes=8)
    write_mnf(tmp_path / "case.mnf", mnf_of(model))
    (tmp_path / "box.toml").write_text(TOML)
    train = read_description(tmp_path / "box.toml").train
    assert [(w.name, w.shaft) for w in train.wheels] == [("z2", "output"), ("z1", "input")]
    kinds = {b.name: (b.shaft, b.kind) for b in train.bearings}
    expected = {
        "a": ("input", "rolling"),
        "b": ("input", "elastic"),
        "c": ("output", "ideal"),
        "d": ("output", "ideal"),
    }
    assert kinds == expected
    assert not any(shaft.wheels or shaft.bearings for shaft in train.shafts)
    body = train.part("output", Shaft).body()
    found = train.modal_models["output"].properties
    wheel = train.part("z2", Wheel).gear
    assert found.mass == pytest.approx(body[0] + wheel.mass, rel=1e-4)
    assert found.inertia[2, 2] == pytest.approx(body[2] + wheel.inertia[2], rel=1e-4)


@pytest.mark.slow
def test_the_seats_of_a_body_with_modes_are_its_own_with_a_rigid_arm():
    block = solid_model(block_mesh(("300 mm", "150 mm", "200 mm"), (4, 2, 2)), quadratic=False)
    train = housed()
    places = {name: seat.position for name, seat in train.modal_models["case"].seats.items()}
    faces = [Interface(name, nodes_where(block, lambda x, y, z, p=p: np.hypot(np.hypot(x - p[0], y - p[1]), z - p[2])
                                         < 0.12), "average", at=tuple(p)) for name, p in places.items()]  # fmt: skip
    model = reduce_model(block, faces, modes=6)
    own = train.with_parts(
        replace(train.housings[0], model=model, modes=(), seats={name: name for name in "abcd"}),
    )
    for name in "abcd":
        seat = own.modal_models["case"].seats[name]
        np.testing.assert_array_equal(seat.moved, model.seats[name].moved)
    named = replace(own.housings[0], seats={"a": "b"})
    moved = own.with_parts(named).modal_models["case"].seats["a"]
    expected = model.seats["b"].moved + np.cross(model.seats["b"].turned, places["a"] - places["b"])
    np.testing.assert_allclose(moved.moved, expected)


@pytest.mark.slow
def test_records_have_the_twist_of_wheels_and_sensors_on_what_deforms():
    train = housed()
    train = Drivetrain(
        "housed", shafts=[replace(s, modes=2) for s in train.shafts], wheels=train.wheels, bearings=train.bearings,
        meshes=train.meshes, housings=[replace(train.housings[0], modes=2)], drives=train.drives,
        loads=[TorqueLoad(name="brake", shaft="output", torque=300.0)], running=True, run_up=0.002,
        sensors=[Accelerometer(name="at c", bearing="c", direction=(0, 1, 0)),
                 Laser(name="laser", shaft="output", station="150 mm", direction=(0, 1, 0))],
    )  # fmt: skip
    record = run_train(train, RunSettings(settling=0.01, duration=0.012, tolerance=1e-6, harmonics=1))
    assert record.measured.dims[-1] == "sensor"
    assert np.isfinite(record.measured.values).all()
    matrices, gear, _ = housed_assembly(housed())
    load = np.zeros(len(matrices.k))
    load[matrices.row(1, 0.2) + 5] = 300.0
    rest = matrices.response(load, 0.0, [matrices.row(0, 0.0) + 5]).real
    turned = [rest[matrices.row(n, 0.1) + 5] for n in (0, 1)]
    first, second = (train.part(name, Wheel).gear.base_radius for name in ("z1", "z2"))
    lag = record.transmission_error.sel(mesh="stage").values.mean()
    assert lag == pytest.approx(abs(first * turned[0] + second * turned[1]), rel=5e-3)
    force = record.normal_force.sel(mesh="stage").values.mean()
    assert force == pytest.approx(K_MESH * abs(gear @ rest), rel=5e-3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"modes": 0}, ("modes", "0", "whole number")),
        ({"modes": 2, "inertia": 0.1}, ("inertia", "modes", "leave")),
        ({"modes": 2, "damping": -0.1}, ("damping", "-0.1", "0 or more")),
        ({"sections": [{"length": 0.1, "diameter": 0.02, "bore": 0.03}]}, ("bore", "0.03", "diameters")),
        ({"wheels": {"z1": "80 mm"}}, ("wheels.z1", "80 mm", "pair")),
        ({"bearings": {"a": ("10 mm", "6206x")}}, ("bearing 'a'", "6206x", "suffix")),
    ],
)
def test_what_a_shaft_is_refused_for(changes, message):
    with pytest.raises(DrivetrainError, match=says(*message)):
        Drivetrain("one", shafts=[Shaft(name="input", **{"length": None if "sections" in changes else 0.1, **changes})])


@pytest.mark.slow
def test_what_a_housing_of_finite_elements_is_refused_for():
    block = solid_model(block_mesh(("300 mm", "150 mm", "200 mm"), (4, 2, 2)), quadratic=False)
    foot = Mount(name="foot", at=(0, 0, 0), stiffness=(1e8,) * 3)
    with pytest.raises(DrivetrainError, match=says("mass", "missing", "give")):
        Housing(name="case", inertia=(1, 1, 1))
    with pytest.raises(DrivetrainError, match=says("mass", "follows", "leave")):
        Housing(name="case", model=block, mass=3.0, mounts=[foot])
    with pytest.raises(DrivetrainError, match=says("mounts", "empty", "give")):
        Housing(name="case", model=block)
    with pytest.raises(DrivetrainError, match=says("program", "mnff", "mnf")):
        Housing(name="case", model={"program": "mnff", "files": "x.mnf"}, mounts=[foot])
    with pytest.raises(DrivetrainError, match=says("axes", "rotation")):
        Housing(name="case", model=block, mounts=[foot], axes=((1, 0, 0), (0, 1, 0), (0, 0, -1)))
    train = housed()
    for changed, message in (
        ({"seats": {}}, ("'a'", "seats", "outside diameter")),
        ({"seats": dict.fromkeys("abcd", (0.02, 0.02))}, ("'a'", "0 nodes", "larger seat")),
        ({"mounts": [replace(m, radius=None) for m in train.housings[0].mounts]}, ("foot 0", "radius", "give")),
        ({"mounts": [foot]}, ("case", "'foot'", "free to turn")),
        ({"mounts": train.housings[0].mounts[:2]}, ("case", "'foot 0'", "free to turn")),
    ):
        with pytest.raises(DrivetrainError, match=says(*message)):
            _ = train.with_parts(replace(train.housings[0], **changed)).modal_models


FOOT = "[housings.case.mounts.foot]\nat = [0.0, 0.0, 0.0]\nstiffness = [1e8, 1e8, 1e8]\n"


def test_bulk_data_are_looked_for_beside_the_description(tmp_path):
    pytest.importorskip("pyyeti.nastran.op2")
    (tmp_path / "x.bdf").write_text("BEGIN BULK\nENDDATA\n")
    model = '{ program = "op2 modes", files = ["x.op2"], bulk = "x.bdf" }'
    (tmp_path / "x.toml").write_text(f"[shafts.a]\n[housings.case]\nmodel = {model}\n{FOOT}")
    with pytest.raises(DrivetrainError, match=says("x.bdf", "no grid points")):
        Drivetrain.from_file(tmp_path / "x.toml")


@pytest.mark.slow
def test_a_mode_in_which_shafts_move_is_not_called_by_the_mounts_that_give_way():
    """In bearings that are soft along them shafts slide; by its mounts only the case is called, if it moves most."""
    soft = (2e8, 2e8, 2e6)
    made = housed(time=0.0)
    made = made.with_parts(*(replace(b, stiffness=soft) for b in made.bearings))
    named = named_modes(made)
    for name, moves, kinetic in zip(named.name.values, named.moves.values, named.kinetic.values):
        body = str(named.body.values[int(np.argmax(kinetic))])
        assert moves.startswith(f"{body} ")
        if str(name).endswith("on its mounts"):
            assert body == "case"
    sliding = int(np.argmax(named.kinetic.sel(body=["input", "output"]).sum("body").values[:6]))
    assert " along " in str(named.moves.values[sliding])

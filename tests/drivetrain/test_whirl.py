"""Shafts of drivetrains that whirl, against matrices that are assembled without the package and closed forms."""

import warnings

import numpy as np
import pytest
import scipy.linalg

from gearmbs.drivetrain import Drivetrain, ElasticBearing, GearMesh, Shaft, SpeedDrive, TorqueLoad, Wheel
from gearmbs.gears import GearSpec, IdealMesh
from gearmbs.studies import train_campbell, train_modes, whirl_senses
from tests.drivetrain.assembled import RX, RY, Assembly, X, Y, bending, normal_at_pitch_point

LENGTH, DIAMETER, STIFFNESS, MESH = 0.4, 0.03, (1e8, 1e8, 5e7), 3e8
STATIONS = {"in": (0.02, 0.12, 0.38), "out": (0.02, 0.12, 0.38)}
WHEELS = {"in": GearSpec(40, "4 mm", face_width="30 mm", bore_radius="15 mm"),
          "out": GearSpec(60, "4 mm", face_width="30 mm", bore_radius="15 mm")}  # fmt: skip


def overhung(speed="3000 rpm", modes=10):
    """Two shafts with a wheel each beyond their bearings, in mesh."""
    shafts = [Shaft(name=name, length=LENGTH, diameter=DIAMETER, modes=modes, elements=20, damping=0.0)
              for name in WHEELS]  # fmt: skip
    ideal = {"stiffness": MESH, "damping_ratio": 0.0}
    return Drivetrain(
        "overhung",
        shafts=shafts,
        wheels=[Wheel(name=f"z {name}", shaft=name, station=0.38, gear=gear) for name, gear in WHEELS.items()],
        meshes=[GearMesh(name="m", driver="z in", driven="z out", pair=IdealMesh, settings=ideal)],
        bearings=[ElasticBearing(name=f"{name} {n}", shaft=name, station=z, stiffness=STIFFNESS, damping_time=0.0)
                  for name in WHEELS for n, z in enumerate(STATIONS[name][:2])],
        drives=[SpeedDrive(name="motor", shaft="in", speed=speed)],
        loads=[TorqueLoad(name="brake", shaft="out", torque=1e-6)],
    )  # fmt: skip


class Turning(Assembly):
    """Matrices with gyroscopic moments: of elements that turn, 2 rho I w times the integral of their slopes."""

    def __init__(self, shafts):
        super().__init__(shafts)
        self.g = np.zeros_like(self.k)

    def turn(self, shaft, speed, diameter, density=7850.0, e=2.1e11, nu=0.3):
        """Let a shaft turn, rad/s."""
        area, second = np.pi * diameter**2 / 4, np.pi * diameter**4 / 64
        kappa = 6 * (1 + nu) / (7 + 6 * nu)
        for n, l in enumerate(np.diff(self.stations[shaft])):
            phi = 12 * e * second / (kappa * e / (2 * (1 + nu)) * area * l**2)
            _, slopes = bending(l, phi, 1.0, 0.0, 2.0 * density * second)
            at = self.starts[shaft] + 6 * n
            x, y = ([at + k for k in (first, turn, 6 + first, 6 + turn)] for first, turn in ((X, RY), (Y, RX)))
            # the slope across y is minus the turn about x
            block = -speed * np.diag([1.0, -1.0, 1.0, -1.0]) @ slopes
            self.g[np.ix_(y, x)] += block
            self.g[np.ix_(x, y)] -= block.T

    def turn_disc(self, shaft, z, polar, speed):
        at = self.row(shaft, z)
        self.g[at + RX, at + RY] += polar * speed
        self.g[at + RY, at + RX] -= polar * speed

    def whirl(self, held):
        """Return the frequencies of whirl, Hz."""
        free = np.setdiff1d(np.arange(len(self.k)), held)
        k, m, g = (one[np.ix_(free, free)] for one in (self.k, self.m, self.g))
        unit, none = np.eye(len(k)), np.zeros_like(k)
        values = scipy.linalg.eigvals(np.block([[none, unit], [-np.linalg.solve(m, k), -np.linalg.solve(m, g)]]))
        return np.sort(values.imag[values.imag > 1.0]) / (2.0 * np.pi)


def by_hand(train, speed):
    """Return the frequencies of whirl of a train at a speed of its first shaft, Hz."""
    seats = train.layout.seats
    stations = np.unique(np.concatenate([np.linspace(0.0, LENGTH, 21), STATIONS["in"]]).round(9))
    made = Turning([(stations, DIAMETER, seats[name].origin[:2]) for name in WHEELS])
    ratio = WHEELS["in"].teeth / WHEELS["out"].teeth
    for number, (name, turns) in enumerate((("in", speed), ("out", -ratio * speed))):
        gear = WHEELS[name]
        made.turn(number, turns, DIAMETER)
        made.disc(number, 0.38, gear.mass, gear.inertia[0], gear.inertia[2])
        made.turn_disc(number, 0.38, gear.inertia[2], turns)
        for z in STATIONS[name][:2]:
            made.bearing(number, z, STIFFNESS)
    centres = [np.append(seats[name].origin[:2], 0.38) for name in WHEELS]
    normal, place = normal_at_pitch_point(*centres, [WHEELS[name].base_radius for name in WHEELS], 0.0, 1, True)
    made.mesh((0, 0.38), (1, 0.38), normal, place, MESH)
    # the drive holds the turning of the first shaft where it is
    return made.whirl([made.row(0, 0.0) + 5])


@pytest.mark.slow
@pytest.mark.parametrize("rpm", [0.0, 6000.0, 20000.0])
def test_a_pair_on_overhung_shafts_whirls_as_its_matrices(rpm):
    train, speed = overhung(), rpm * np.pi / 30.0
    modes = train_modes(train, speed=speed)
    found = np.sort(modes.eigenvalues.imag[modes.eigenvalues.imag > 1.0]) / (2.0 * np.pi)
    expected = by_hand(train, speed)
    np.testing.assert_allclose(found[:8], expected[:8], rtol=1e-4)
    if rpm:
        still = by_hand(train, 0.0)
        # gyroscopic moments move them by far more than that
        assert np.abs(expected[:8] / still[:8] - 1.0).max() > 0.02


def stodola(mass, polar, across, modulus, second, length, apart, speed):
    """Return the whirl of a disc beyond two bearings on a shaft without mass, rad/s: positive forwards.

    Compliances of displacement and slope of the disc: of a cantilever, and of the slope at the bearing before it.
    """
    free = np.array([[length**3 / 3.0, length**2 / 2.0], [length**2 / 2.0, length]])
    arm = np.array([length, 1.0])
    stiff = modulus * second * np.linalg.inv(free + apart / 3.0 * np.outer(arm, arm))
    # circular whirl exp(i w t): m w^2 r = k11 r + k12 t, (I_d w^2 - I_p W w) t = k21 r + k22 t
    m = np.diag([mass, across])
    g = np.diag([0.0, polar * speed])
    unit, none = np.eye(2), np.zeros((2, 2))
    values = np.linalg.eigvals(np.block([[none, unit], [np.linalg.solve(m, stiff), np.linalg.solve(m, g)]]))
    return np.sort(values.real)


@pytest.mark.slow
def test_a_disc_at_the_end_of_a_shaft_whirls_as_stodola_says():
    """Whose shaft has next to no mass; shear adds a percent to what it gives."""
    speed, free = 600.0, 0.3
    disc = GearSpec(50, "6 mm", face_width="25 mm", bore_radius="12 mm")
    stations = (0.0, 0.1)
    train = Drivetrain(
        "stodola",
        shafts=[Shaft(name="s", length=0.1 + free, diameter="24 mm", density=100.0, modes=6, elements=30, damping=0.0)],
        wheels=[Wheel(name="disc", shaft="s", station=0.1 + free, gear=disc)],
        bearings=[ElasticBearing(name=f"b{n}", shaft="s", station=z, stiffness=(1e11,) * 3, damping_time=0.0)
                  for n, z in enumerate(stations)],
        drives=[SpeedDrive(name="motor", shaft="s", speed=speed)],
    )  # fmt: skip
    modes = train_modes(train, speed=speed)
    senses = whirl_senses(train, modes)
    second = np.pi * 0.024**4 / 64.0
    exact = stodola(disc.mass, disc.inertia[2], disc.inertia[0], 2.1e11, second, free, 0.1, speed)
    for value in exact:
        k = int(np.argmin(np.abs(modes.eigenvalues.imag - abs(value))))
        assert modes.eigenvalues.imag[k] == pytest.approx(abs(value), rel=0.01)
        assert senses[k] == ("forward" if value > 0.0 else "backward")


@pytest.mark.slow
def test_lines_of_a_campbell_diagram_part_with_the_speed():
    # bent by its load
    train = overhung(modes=4).changed("brake", torque="40 N m")
    still = train_campbell(train, ["0 rpm", "6000 rpm", "12000 rpm"], maximum=600.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = train_campbell(train, ["0 rpm", "6000 rpm", "12000 rpm"], maximum=600.0, whirl=True)
    np.testing.assert_allclose(found["frequency"][0], still["frequency"][0], rtol=1e-9)
    moved = np.abs(found["frequency"][-1].values / still["frequency"][-1].values - 1.0)
    assert moved.max() > 0.02
    assert set(found["whirl"][0].values) == {""}
    assert {"forward", "backward"} <= set(found["whirl"][-1].values)

"""The place of a loaded ring against an independent minimisation of an energy written anew, and when there is none."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.optimize import linprog, minimize

from gearmbs.bearings import Bearing, BearingError, BearingStatics, Misalignment, OffSize, RollingBearing
from gearmbs.mechanism import Mechanism, static_equilibrium
from tests.generators import cases, seed
from tests.says import says

CATALOGUE = ("6205", "6206/C3", "6305/C4", "6005/CN", "NU206", "NJ205")


def draw(rng: np.random.Generator) -> tuple[Bearing, dict, np.ndarray, float]:
    """Return a bearing with clearance or preload, its settings, a load and the cage's angle."""
    kind = str(rng.choice(["catalogue", "deep groove", "angular contact", "four point", "cylindrical roller",
                           "tapered roller"]))  # fmt: skip
    clearance, settings = float(rng.uniform(-15e-6, 60e-6)), {}
    if kind == "catalogue":
        try:
            bearing = Bearing.from_designation(str(rng.choice(CATALOGUE)))
        except BearingError:
            bearing = Bearing.from_designation("6205/C3")
        if rng.random() < 0.5:
            bearing = bearing.changed(clearance=clearance)
    else:
        d = float(rng.uniform(5e-3, 20e-3))
        z = int(rng.integers(7, 19))
        pitch = d / np.sin(np.pi / z) * float(rng.uniform(1.05, 1.5))
        angle = 0.0
        if kind in ("angular contact", "four point", "tapered roller"):
            angle = float(np.radians(rng.uniform(10.0, 40.0)))
            if kind != "four point" and rng.random() < 0.5:
                settings = {"preload": float(rng.uniform(10.0, 500.0))}
            settings |= {} if kind == "four point" else {"sense": int(rng.choice([-1, 1]))}
        more = {"roller_length": float(rng.uniform(0.8, 2.0)) * d} if "roller" in kind else {}
        clearance = 0.0 if "preload" in settings else clearance
        bearing = Bearing(kind=kind, elements=z, element_diameter=d, pitch_diameter=pitch, contact_angle=angle,
                          clearance=clearance, **more)  # fmt: skip
    size = 10.0 ** rng.uniform(0.0, np.log10(3e4))
    turn = rng.uniform(0.0, 2.0 * np.pi)
    lift = {"radial": 0.0, "axial": 0.5 * np.pi * rng.choice([-1, 1]), "both": rng.uniform(-0.5, 0.5) * np.pi}[
        str(rng.choice(["radial", "axial", "both"]))
    ]
    load = size * np.array([np.cos(lift) * np.cos(turn), np.cos(lift) * np.sin(turn), np.sin(lift)])
    load[np.abs(load) < 1e-12 * size] = 0.0
    if rng.random() < 0.5:
        arm = rng.uniform(-0.2, 0.2, 2) * bearing.pitch_diameter * rng.choice([0.0, 1.0])
        load = np.concatenate([load, size * arm])
    return bearing, settings, load, float(rng.uniform(0.0, 2.0 * np.pi))


class Potential:
    """The energy of a bearing over (x, y, z, -a_y, a_x), rows of contacts by hand; micrometres and newtons."""

    def __init__(self, bearing: Bearing, settings: dict, cage: float) -> None:
        b, sense = bearing, settings.get("sense", 1)
        theta = cage + 2.0 * np.pi * np.arange(b.elements) / b.elements
        self.c, self.s = np.cos(theta)[:, None], np.sin(theta)[:, None]
        self.balls = "roller" not in b.kind
        self.n = 1.5 if self.balls else 10.0 / 9.0
        k_i, k_o = b.contact_stiffness
        self.k = (k_i ** (-1.0 / self.n) + k_o ** (-1.0 / self.n)) ** (-self.n)
        a, d = b.contact_angle, b.element_diameter
        if self.balls:
            self.reach = (b.inner_curvature + b.outer_curvature - 1.0) * d
            signs = np.array([1.0, -1.0] if b.kind == "four point" else [float(sense)])
            groove = (b.inner_curvature - 0.5) * d
            self.x0 = np.full(signs.size, self.reach * np.cos(a) - 0.5 * b.clearance)
            self.y0 = signs * self.reach * np.sin(a)
            self.radius = np.full(signs.size, 0.5 * b.pitch_diameter + groove * np.cos(a))
            self.height = signs * groove * np.sin(a)
            if settings.get("preload"):
                self.y0 = self.y0 + sense * self._shift(settings["preload"], abs(self.y0[0]))
        else:
            count = 15
            x = b.roller_length * ((np.arange(count) + 0.5) / count - 0.5)
            self.normal = np.cos(a), sense * np.sin(a)
            self.radius, self.height = 0.5 * b.pitch_diameter - x * np.sin(a), sense * x * np.cos(a)
            self.gap = 0.5 * b.clearance * np.cos(a) - 0.00035 * d * np.log(1.0 - (2.0 * x / b.roller_length) ** 2)
            self.k /= count
            if settings.get("preload"):
                self.gap = self.gap - self._closer(settings["preload"], b.elements * np.sin(a))
        self.z = b.elements

    def _shift(self, preload: float, y: float) -> float:
        def force(shift: float) -> float:
            length = np.hypot(self.x0[0], y + shift)
            pressed = self.k * max(length - self.reach, 0.0) ** 1.5
            return self.c.size * pressed * (y + shift) / length

        return bisect(lambda shift: force(shift) - preload, 0.0, 1e-3)

    def _closer(self, preload: float, share: float) -> float:
        return bisect(lambda way: share * self.k * (np.maximum(way - self.gap, 0.0) ** self.n).sum() - preload, 0, 1e-3)

    def contacts(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return deflections, and the normals in the plane of each element, of all contacts."""
        u = p[0] * self.c + p[1] * self.s
        phi = p[4] * self.c - p[3] * self.s
        x, y = u + self.height * phi, p[2] - self.radius * phi
        if self.balls:
            x, y = self.x0 + x, self.y0 + y
            length = np.hypot(x, y)
            return length - self.reach, x / length, y / length
        nx, ny = self.normal
        return nx * x + ny * y - self.gap, np.full_like(x, nx), np.full_like(x, ny)

    def rows(self, nx: np.ndarray, ny: np.ndarray) -> np.ndarray:
        """Return the derivatives of the deflections by p, (contacts, 5)."""
        lever = nx * self.height - ny * self.radius
        parts = (nx * self.c, nx * self.s, ny, -lever * self.s, lever * self.c)
        return np.stack(np.broadcast_arrays(*parts), axis=-1).reshape(-1, 5)

    def value(self, p: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        """Return energy (J), gradient and Hessian."""
        delta, nx, ny = self.contacts(p)
        pressed = np.maximum(delta, 0.0)
        force, rows = self.k * pressed**self.n, self.rows(nx, ny)
        slope = self.n * self.k * pressed ** (self.n - 1.0)
        hessian = rows.T @ (slope.reshape(-1, 1) * rows)
        if self.balls:
            across = self.rows(-ny, nx)
            hessian += across.T @ ((force / (delta + self.reach)).reshape(-1, 1) * across)
        stored = self.k * float((pressed ** (self.n + 1.0)).sum()) / (self.n + 1.0)
        return stored, rows.T @ force.ravel(), hessian


def bisect(function, low: float, high: float) -> float:
    """Return where a growing function is zero."""
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if function(middle) < 0.0 else (low, middle)
    return 0.5 * (low + high)


def runs_away(potential: Potential, load: np.ndarray, size: np.ndarray) -> bool:
    """Return whether a direction that closes no contact has positive work, by a linear programme."""
    if potential.balls:
        return False
    _, nx, ny = potential.contacts(np.zeros(5))
    rows = potential.rows(nx, ny)[:, : load.size] / size
    way = load / size / np.linalg.norm(load / size)
    found = linprog(-way, A_ub=rows, b_ub=np.zeros(len(rows)), bounds=[(-1.0, 1.0)] * load.size, method="highs-ds")
    assert found.status == 0
    return bool(-found.fun > 1e-7)


def independent(potential: Potential, load: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Return (d, -a_y, a_x) where energy less work is least, by the trust-region method of scipy."""
    n, p = load.size, np.zeros(5)
    unit = 1e-6 / size
    scale = 1e6 / np.abs(load / size).max()
    for _ in range(3 if n == 5 else 1):
        dual = load.copy()
        dual[3:] /= np.sqrt(1.0 - p[3] ** 2 - p[4] ** 2)

        def at(u: np.ndarray) -> np.ndarray:
            return np.concatenate([u * unit, np.zeros(5 - n)])

        def total(u, dual=dual):
            stored, slope, _ = potential.value(at(u))
            return scale * (stored - dual @ (u * unit)), scale * unit * (slope[:n] - dual)

        def bend(u):
            return scale * unit[:, None] * potential.value(at(u))[2][:n, :n] * unit

        found = minimize(total, p[:n] / unit, jac=True, hess=bend, method="trust-exact",
                         options={"gtol": 1e-9, "maxiter": 5000, "initial_trust_radius": 10.0,
                                  "max_trust_radius": 1e5})  # fmt: skip
        p = at(found.x)
    return p


def verdict(bearing: Bearing, settings: dict, load: np.ndarray, cage: float):
    """Return the loaded bearing, or None and why not."""
    try:
        return BearingStatics(bearing, **settings).under(load, cage_angle=cage), ""
    except BearingError as error:
        return None, str(error)


def lean(state) -> np.ndarray:
    """Return (d, -a_y, a_x) of a state whose displacement has a rotation vector."""
    turn = state.displacement[3:]
    angle = np.hypot(*turn)
    return np.concatenate([state.displacement[:3], turn * (np.sin(angle) / angle if angle else 1.0)])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:angular contact bearing.* against its sense")
def test_places_are_those_of_an_independent_minimisation():
    """Of random bearings, loads of 1 N to 30 kN and clearances: verdict, deflection and element forces."""
    rng = np.random.default_rng(seed())
    verdicts = []
    for case in range(cases(60)):
        bearing, settings, load, cage = draw(rng)
        potential = Potential(bearing, settings, cage)
        size = np.array([1.0, 1.0, 1.0, *(0.5 * bearing.pitch_diameter,) * 2])[: load.size]
        away = runs_away(potential, load, size)
        verdicts.append(away)
        about = f"case {case}: {bearing}, {settings}, {load}"
        state, refused = verdict(bearing, settings, load, cage)
        if "leans by more than" in refused:
            assert np.linalg.norm(independent(potential, load, size)[3:]) > 0.25, about
            continue
        assert away == ("does not carry it" in refused), f"{about}: {refused}"
        if state is None:
            assert away, f"{about}: {refused}"
            continue
        found, mine = independent(potential, load, size), lean(state)
        way = load / size / np.linalg.norm(load / size)
        assert way @ (mine[: load.size] * size) == pytest.approx(way @ (found[: load.size] * size), rel=1e-5), about
        # balanced by the energy written here, which being convex has no other minimum
        missing = (potential.value(mine)[1][: load.size] - load) / size
        assert np.abs(missing[:3]).max() < 1e-7 * np.abs(load / size).max(), about
        force = potential.k * np.maximum(potential.contacts(found)[0], 0.0) ** potential.n
        np.testing.assert_allclose(state.load[: load.size], load, atol=1e-7 * np.abs(load / size).max(), err_msg=about)
        if bearing.kind != "four point":
            np.testing.assert_allclose(
                state.element_loads, force.sum(axis=1), atol=1e-4 * force.sum(axis=1).max(), err_msg=about
            )
    if len(verdicts) >= 50:
        assert 0.02 < np.mean(verdicts) < 0.5


@pytest.mark.slow
@pytest.mark.parametrize("load", [0.1, 5.0, 20.0, 1000.0])
def test_light_loads_across_a_clearance(load):
    """In every direction, also just between two balls, as by marching down from a heavy load."""
    statics = BearingStatics(Bearing.from_designation("6205/C3"))
    for angle in np.linspace(0.0, 2.0 * np.pi, 61):
        way = np.array([np.cos(angle), np.sin(angle), 0.0])
        alone = statics.under(load * way)
        marched = statics.curve([f * way for f in np.geomspace(1e3, load, 12)])[-1]
        assert way @ alone.displacement[:3] == pytest.approx(way @ marched.displacement[:3], rel=1e-6)


@pytest.mark.parametrize(
    "settings",
    [
        {"centrifugal": True, "speed": 900.0},
        {"smooth": 2e-6},
        {"defects": Misalignment(tilt=4e-3)},
        {"defects": [OffSize(amount="4 um", element=2), Misalignment(tilt=1e-3, part="outer")]},
    ],
)
def test_balanced_with_every_setting_from_any_start(settings):
    """The moments, too; and the same place from starts far away: there is one minimum only."""
    speed = settings.pop("speed", 0.0)
    for bearing in (
        Bearing.from_designation("6205/C3"),
        Bearing(kind="angular contact", elements=11, element_diameter=7.94e-3, pitch_diameter=38.5e-3,
                contact_angle="25 deg"),
    ):  # fmt: skip
        statics = BearingStatics(bearing, speed=speed, **settings)
        for load in ([3.0, 1.0, 2.0, 0.01, -0.02], [800.0, -300.0, 500.0, 2.0, 1.0]):
            first = statics.under(load)
            np.testing.assert_allclose(first.load, load, rtol=1e-7, atol=1e-8 * max(load))
            again = statics.under(load, start=[2e-4, 1e-4, -3e-4, 2e-3, -3e-3])
            np.testing.assert_allclose(again.displacement, first.displacement, rtol=1e-5, atol=1e-9)


def test_what_rollers_carry_ends_at_the_cone_of_their_normals():
    """A tapered bearing carries a radial load with half an axial one too many tan(alpha), not with one too few."""
    tapered = Bearing(kind="tapered roller", elements=17, element_diameter=7.5e-3, pitch_diameter=46.5e-3,
                      roller_length=11e-3, contact_angle="14 deg", clearance="20 um")  # fmt: skip
    statics = BearingStatics(tapered)
    for size in (2.0, 2e4):
        # straight at one roller, whose force has the direction of its normal
        just = np.tan(np.radians(14.0))
        state = statics.under([size, 0.0, 1.001 * just * size])
        assert state.load[2] == pytest.approx(1.001 * just * size, rel=1e-6)
        with pytest.raises(BearingError, match=says("z", "inner ring along")):
            statics.under([size, 0.0, 0.999 * just * size])


@pytest.mark.slow
@pytest.mark.parametrize("size", [1.0, 20.0])
def test_mechanisms_rest_where_the_bearing_alone_does(size):
    bearing = Bearing.from_designation("6205/C3")
    for angle in np.radians([7.0, 100.0, 220.0]):
        m = Mechanism("ring")
        ring = m.body("ring", 0.2, (1e-4, 1e-4, 1e-4))
        m.add(RollingBearing("bearing", ring.marker(), m.ground.marker(), bearing=bearing))
        m.joint("orientation", "held", ring, m.ground)
        load = size * np.array([np.cos(angle), np.sin(angle), 0.2])
        m.load("pull", ring.marker(), m.ground.marker(), **{f"f{c}": str(f) for c, f in zip("xyz", load)})
        state = BearingStatics(bearing).under(load)
        np.testing.assert_allclose(
            static_equilibrium(m).com_position("ring"), state.displacement[:3], rtol=1e-6, atol=1e-12
        )


@pytest.mark.parametrize("sense", [1, -1])
def test_an_axial_load_on_the_shoulder_that_is_not_there_is_remarked(sense):
    bearing = Bearing(kind="angular contact", elements=11, element_diameter=7.94e-3, pitch_diameter=38.5e-3,
                      contact_angle="25 deg")  # fmt: skip
    statics = BearingStatics(bearing, sense=sense)
    with pytest.warns(UserWarning, match="against its sense"):
        crossed = statics.under([100.0, 0.0, -400.0 * sense])
    assert crossed.load[2] == pytest.approx(-400.0 * sense, rel=1e-8)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        statics.under([100.0, 0.0, 400.0 * sense])
        statics.under([400.0, 0.0, 0.0])

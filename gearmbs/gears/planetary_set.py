"""Planetary sets: wheels, assembly, mesh phases, speeds, torques and frequencies.

Planet k stands at the angle psi_k on the carrier. It meshes with the sun, and with the ring on its other side; a
stepped planet has a wheel of its own for the ring.

"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypedDict

import numpy as np

from gearmbs._display import Written
from gearmbs.gears.geometry import PairGeometry
from gearmbs.gears.ideal_mesh import IdealMesh
from gearmbs.gears.mesh import ContactLaw, FlankFriction, sense_of_rotation
from gearmbs.gears.modifications import Fault
from gearmbs.gears.pair import GearPair, before_own_law
from gearmbs.gears.spec import GearSpec, convert_fields
from gearmbs.units import Quantity, to_si
from gearmbs.wording import warn

MEMBERS = ("sun", "carrier", "ring")
FITTING = 1e-6
"""Part of a pitch by which planets may miss the place where they fit."""
LEFT_OVER = 1e-4
"""Share of forces in step below which their sum is none: places of planets are exact to `FITTING` of a pitch."""
UNASKED = 1e-3
"""Share of a backlash that is asked for, beyond which more than that is told."""
CLEARANCE = 0.25
"""Bottom clearance of the basic rack of ISO 53 over the module: a pin that is further off drives tips into roots."""
NEARBY = 8
"""Teeth by which sun and planet of a set that is recommended may differ."""


class StartAngles(TypedDict):
    """Angles (rad) at which a set starts: of the ring, of each planet, and of its second wheel against its first."""

    ring: float
    planets: np.ndarray
    steps: np.ndarray


@dataclass(frozen=True)
class PlanetarySet(Written):
    """A sun, planets on a carrier and a ring.

    Parameters
    ----------
    sun, planet, ring : GearSpec
    planets : int
        How many.
    angles : sequence of float or str, optional
        Where the planets stand on the carrier, rad or text; default equally spaced.
    carrier_radius : float or str, optional
        Of the planets' axes, m; default the nominal centre distance of sun and planet.
    planet_at_ring : GearSpec, optional
        Second wheel of stepped planets, which meshes with the ring instead; it is turned on each planet so that it
        fits.
    backlash_sun, backlash_ring : float or str
        Normal backlash of the meshes, m, made by thinning the teeth of sun and ring; at least what ``carrier_radius``
        leaves.
    contact : ContactLaw, optional
        Of all tooth pairs; default: each mesh has the stiffness of its own wheels and a damping ratio.
    friction : FlankFriction
    slices : int, optional
        As of `GearPair`.
    pin_errors : mapping of int to (float, float)
        By planet, from 0: how far its pin is off radially (outwards) and tangentially (in the sense of rotation, see
        `sense`), m or text.
    faults : sequence of (str, Fault)
        What has the fault and which: "sun", "ring", "planet 1", or one of a planet's sets of flanks: "planet 1 sun
        side", "planet 1 ring side". Planets count from 1.
    rotation : {1, -1}
        Sense in which the sun turns against the carrier, for the flanks that carry the load.
    ideal : (float, float), optional
        Stiffness of the sun's and the ring's meshes along the line of action, N/m, for ideal, linear meshes instead of
        tooth contact.
    ideal_damping : float
        Of ideal meshes, N s/m.
    ideal_backlash : bool
        Whether teeth of ideal meshes can part.
    stiffness, damping_ratio
        Of the meshes without ``contact``, see `GearPair.with_own_stiffness`.
    name : str

    Raises
    ------
    ValueError
        For a set that cannot be assembled, with the nearest that can, and for planets that touch each other.

    Examples
    --------
    >>> from gearmbs.gears import GearSpec, PlanetarySet
    >>> gears = PlanetarySet(GearSpec(28, "2 mm"), GearSpec(36, "2 mm"), GearSpec.ring(100, "2 mm"), planets=4)
    >>> gears.mesh_phases("sun").tolist()
    [0.0, 0.0, 0.0, 0.0]
    >>> round(gears.speeds(sun=100.0, ring=0.0)["carrier"], 6)
    21.875
    """

    sun: GearSpec
    planet: GearSpec
    ring: GearSpec
    planets: int = 3
    angles: Sequence[Quantity] | None = None
    carrier_radius: Quantity = None
    planet_at_ring: GearSpec | None = None
    backlash_sun: Quantity = 0.0
    backlash_ring: Quantity = 0.0
    contact: ContactLaw | None = None
    friction: FlankFriction = field(default_factory=FlankFriction)
    slices: int | None = None
    pin_errors: Mapping[int, tuple[Any, Any]] = field(default_factory=dict)
    faults: Sequence[tuple[str, Fault]] = ()
    rotation: int = 1
    ideal: tuple[float, float] | None = None
    ideal_damping: float = 0.0
    ideal_backlash: bool = False
    stiffness: Quantity = None
    damping_ratio: float | None = None
    name: str = "planetary set"

    def __post_init__(self) -> None:
        convert_fields(
            self, {"backlash_sun": "length", "backlash_ring": "length", "carrier_radius": "length"}, "PlanetarySet"
        )
        for name in ("backlash_sun", "backlash_ring"):
            value = getattr(self, name)
            if not 0.0 <= value < math.inf:
                raise ValueError(
                    f"PlanetarySet.{name} is {value * 1e3:.6g} mm: negative backlash; give 0 or more, or change "
                    "carrier_radius to mesh tighter"
                    if value < 0.0
                    else f"PlanetarySet.{name} is {value}; give a finite length"
                )
        if not (isinstance(self.planets, int) and self.planets >= 1):
            raise ValueError(f"PlanetarySet.planets is {self.planets!r}; give a whole number from 1 up")
        if not self.ring.internal:
            raise ValueError(f"PlanetarySet.ring ({self.ring.name}) is external; make it with GearSpec.ring")
        for wheel in (self.sun, self.planet):
            if wheel.internal:
                raise ValueError(f"PlanetarySet: {wheel.name} is internal; only the ring may be")
        inner = self.planet_at_ring or self.planet
        if not self.ring.teeth > inner.teeth:
            raise ValueError(
                f"PlanetarySet.ring has {self.ring.teeth} teeth and {inner.name} {inner.teeth}: they do not fit into "
                "it; give the ring more teeth"
            )
        sense_of_rotation(self.rotation, "PlanetarySet.rotation")
        if self.carrier_radius is None:
            object.__setattr__(self, "carrier_radius", PairGeometry(self.sun, self.planet).nominal_centre_distance)
        self._check_angles()
        self._check_neighbours()
        object.__setattr__(self, "pin_errors", {at: self._pin_error(at, e) for at, e in self.pin_errors.items()})
        for where, fault in self.faults:
            self._holder(where, fault)
        for name in ("stiffness", "damping_ratio"):
            if getattr(self, name) is not None and (self.contact is not None or self.ideal is not None):
                raise ValueError(
                    f"PlanetarySet.{name} is {getattr(self, name)!r} beside contact or ideal, which have their own; "
                    "leave one of them out"
                )
        _ = self.pairs_sun
        self._meshing_with_ring()

    def _check_angles(self) -> None:
        if self.angles is None:
            given = 2 * math.pi * np.arange(self.planets) / self.planets
        else:
            given = np.array([to_si(a, "angle", "PlanetarySet.angles") for a in self.angles], dtype=float)
            if given.size != self.planets:
                raise ValueError(
                    f"PlanetarySet.angles has {given.size} numbers for {self.planets} planets; give one each"
                )
        object.__setattr__(self, "angles", tuple(given.tolist()))
        if self.planet_at_ring is not None:
            return
        step = self.least_angle
        fitting = given[0] + np.round((given - given[0]) / step) * step
        if np.abs(fitting - given).max() <= FITTING * step:
            return
        teeth = f"{self.sun.teeth} + {self.ring.teeth} teeth"
        nearest = ", ".join(f"{math.degrees(a):.4f}" for a in fitting)
        also = ""
        if self.angles is None or np.allclose(np.diff(given), 2 * math.pi / self.planets):
            total = self.sun.teeth + self.ring.teeth
            set_that_fits = self._nearest_set()
            also = f", or equally spaced with {set_that_fits}" if set_that_fits else ""
            teeth += f", whose sum {total} is no multiple of {self.planets}"
        raise ValueError(
            f"PlanetarySet cannot be assembled: planets fit at multiples of {math.degrees(step):.4f} deg ({teeth}); "
            f"the nearest angles are {nearest} deg{also}"
        )

    def _nearest_set(self) -> str:
        """Return the nearest teeth of wheels that mesh and stand equally spaced without profile shifts, as text."""
        if any(w.profile_shift for w in (self.sun, self.planet, self.ring)):
            return ""
        teeth = self.sun.teeth, self.planet.teeth, self.ring.teeth
        steps = range(-NEARBY, NEARBY + 1)
        near = [(s, p, s + 2 * p) for s in (teeth[0] + k for k in steps) for p in (teeth[1] + k for k in steps)]
        near = [found for found in near if (found[0] + found[2]) % self.planets == 0 and min(found) > 0]
        near.sort(key=lambda found: (sum(abs(a - b) for a, b in zip(found, teeth)), found))
        for found in near:
            sun, planet, ring = (replace(w, teeth=z) for w, z in zip((self.sun, self.planet, self.ring), found))
            try:
                PlanetarySet(sun, planet, ring, self.planets, rotation=self.rotation)
            except ValueError:
                # neighbours touch, or the wheels are too small
                continue
            return f"{', '.join(str(z) for z in found)} teeth"
        return ""

    def _meshing_with_ring(self) -> None:
        """Make the pairs with the ring; where they cannot be, say so by the teeth of the set."""
        whole = self.sun.teeth + 2 * self.planet.teeth
        try:
            _ = self.pairs_ring
        except ValueError as error:
            if self.planet_at_ring is not None or self.ring.teeth == whole:
                raise
            set_that_fits = self._nearest_set()
            instead = f", or take {set_that_fits}" if set_that_fits else ""
            # its remedies are those of a single pair
            why = str(error).partition(";")[0]
            raise ValueError(
                f"PlanetarySet: {self.sun.teeth}, {self.planet.teeth}, {self.ring.teeth} teeth do not fit between sun "
                f"and ring: without profile shifts the ring needs z_r = z_s + 2 z_p = {whole} teeth; give profile "
                f"shifts that fit (and their carrier_radius){instead} ({why})"
            ) from None

    def _check_neighbours(self) -> None:
        if self.planets < 2:
            return
        order = np.sort(np.mod(np.array(self.angles, dtype=float), 2 * math.pi))
        apart = float(np.diff(np.append(order, order[0] + 2 * math.pi)).min())
        distance = 2 * self.carrier_radius * math.sin(min(apart, math.pi) / 2)
        reach = 2 * max(w.tip_radius for w in (self.planet, self.planet_at_ring or self.planet))
        if not distance > reach:
            raise ValueError(
                f"PlanetarySet.planets is {self.planets}: neighbouring planets stand {distance * 1e3:.4f} mm apart and "
                f"reach {reach * 1e3:.4f} mm; use fewer or smaller planets"
            )

    def _pin_error(self, at: int, error: Any) -> tuple[float, float]:
        """Return how far a pin is off, m."""
        field = "PlanetarySet.pin_errors"
        if not (at in range(self.planets) and np.ndim(error) == 1 and len(error) == 2):
            raise ValueError(f"{field} has planet {at!r}: {error!r}; give planets 0 to {self.planets - 1} two lengths")
        radial, ahead = (float(to_si(e, "length", f"{field}[{at}]")) for e in error)
        most = CLEARANCE * self.planet.module
        if not max(abs(radial), abs(ahead)) <= most:
            raise ValueError(
                f"{field}[{at}] is ({1e3 * radial:.6g} mm, {1e3 * ahead:.6g} mm): teeth yield by micrometres, and from "
                f"{1e3 * most:.4g} mm, the clearance at their roots, they do not fit at all; give less, or another "
                "carrier_radius for all planets"
            )
        return radial, ahead

    def _holder(self, where: str, fault: Fault) -> tuple[str, int, str]:
        """Return the member, the planet's number from 0 and the set of flanks of a fault."""
        words = where.split()
        if not isinstance(fault, Fault):
            raise ValueError(f"PlanetarySet.faults: {fault!r} is no fault of gearmbs.gears.faults")
        if where in ("sun", "ring"):
            return where, -1, "both"
        known = len(words) in (2, 4) and words[0] == "planet" and words[1].isdigit()
        known = known and (len(words) == 2 or (words[2] in ("sun", "ring") and words[3] == "side"))
        if not (known and 1 <= int(words[1]) <= self.planets):
            raise ValueError(
                f"PlanetarySet.faults: {where!r} is no place of a fault; give 'sun', 'ring', 'planet 1' to "
                f"'planet {self.planets}', or with 'sun side' or 'ring side' behind"
            )
        return "planet", int(words[1]) - 1, words[2] if len(words) == 4 else "both"

    def _faults_of(self, planet: int, mesh: str) -> tuple[Fault, ...]:
        """Return the faults of one mesh, each on its wheel of the pair."""
        found = []
        for where, fault in self.faults:
            member, number, flanks = self._holder(where, fault)
            if member == mesh:
                found.append(replace(fault, wheel="driver" if mesh == "sun" else "driven"))
            elif member == "planet" and number == planet and flanks in (mesh, "both"):
                found.append(replace(fault, wheel="driven" if mesh == "sun" else "driver"))
        return tuple(found)

    def _pairs(self, one: GearSpec, two: GearSpec, thin: str, backlash: float, mesh: str) -> tuple[GearPair, ...]:
        plain = PairGeometry(one, two)
        if not abs(plain.base_radius_sum) < self.carrier_radius:
            raise ValueError(
                f"PlanetarySet cannot be assembled: {one.name} and {two.name} do not mesh at the carrier_radius of "
                f"{self.carrier_radius * 1e3:.4f} mm, for their centres are {plain.nominal_centre_distance * 1e3:.4f} "
                "mm apart; change their teeth or profile shifts, or give another carrier_radius"
            )
        error = self.carrier_radius - plain.nominal_centre_distance
        own = plain.normal_backlash_of(self.carrier_radius)
        if own > backlash * (1.0 + UNASKED) > 0.0:
            warn(
                f"PlanetarySet.backlash_{mesh} is {backlash * 1e3:.4g} mm, but at the carrier_radius of "
                f"{self.carrier_radius * 1e3:.4f} mm {one.name} and {two.name} have {own * 1e3:.4g} mm, which thinner "
                "teeth do not lessen; change the carrier_radius or the profile shifts",
            )
        cut = max(0.0, backlash - own) / math.cos(one.transverse_pressure_angle)
        if cut > 0 and thin == "one":
            one = replace(one, thinning=one.thinning + cut)
        elif cut > 0:
            two = replace(two, thinning=two.thinning + cut)
        made: dict[tuple[Fault, ...], GearPair] = {}
        pairs = []
        for k in range(self.planets):
            faults = self._faults_of(k, mesh)
            if faults not in made:
                given: dict[str, Any] = {
                    "centre_distance_error": error,
                    "friction": self.friction,
                    "slices": self.slices,
                    "rotation": self.rotation if mesh == "sun" else -self.rotation,
                    "faults": faults,
                }
                if self.contact is None:
                    with before_own_law():
                        pair = GearPair(one, two, **given)
                    made[faults] = pair.with_own_stiffness(self.stiffness or "iso", self.damping_ratio)
                else:
                    made[faults] = GearPair(one, two, contact=self.contact, **given)
            pairs.append(made[faults])
        return tuple(pairs)

    @cached_property
    def pairs_sun(self) -> tuple[GearPair, ...]:
        """Sun and planet, one a planet: the sun drives."""
        return self._pairs(self.sun, self.planet, "one", float(self.backlash_sun), "sun")

    @cached_property
    def pairs_ring(self) -> tuple[GearPair, ...]:
        """Planet and ring, one a planet: the planet drives."""
        planet = self.planet_at_ring or self.planet
        return self._pairs(planet, self.ring, "two", float(self.backlash_ring), "ring")

    def meshes(self, which: str) -> tuple[GearPair | IdealMesh, ...]:
        """What meshes with the "sun" or the "ring", one a planet: tooth contact, or ideal meshes."""
        pairs = self.pairs_sun if which == "sun" else self.pairs_ring
        if self.ideal is None:
            return pairs
        stiffness = self.ideal[0 if which == "sun" else 1]
        return tuple(IdealMesh(p, stiffness, self.ideal_damping, self.ideal_backlash) for p in pairs)

    def law(self, which: str) -> str:
        """Law, stiffness and damping of the meshes with the "sun" or the "ring", in words."""
        mesh = self.meshes(which)[0]
        return mesh.law if isinstance(mesh, IdealMesh) else str(mesh.contact)

    # --- assembly and phases --------------------------------------------------------------------------

    @property
    def least_angle(self) -> float:
        """Angle whose multiples lie between places where planets fit, 2 pi / (z_s + z_r), rad."""
        return 2 * math.pi / (self.sun.teeth + self.ring.teeth)

    @property
    def ratios(self) -> tuple[float, float]:
        """Teeth of planet over sun, and of ring over the planet that meshes with it."""
        return self.planet.teeth / self.sun.teeth, self.ring.teeth / (self.planet_at_ring or self.planet).teeth

    def mesh_phases(self, which: str = "sun") -> np.ndarray:
        """Phases of the planets' meshes with the "sun" or the "ring", as parts of a mesh cycle against planet 1.

        gamma_s = z_s psi / 2 pi and gamma_r = -z_r psi / 2 pi.
        """
        if which not in ("sun", "ring"):
            raise ValueError(f"which is {which!r}; choose 'sun' or 'ring'")
        teeth = self.sun.teeth if which == "sun" else -self.ring.teeth
        turns = teeth * (np.array(self.angles, dtype=float) - float(self.angles[0])) / (2 * math.pi)  # type: ignore
        phase = np.round(np.mod(turns, 1.0), 9) % 1.0
        return phase

    def harmonic_action(self, harmonic: int, which: str = "ring") -> str:
        """What a mesh harmonic of equal planets does to the sun or the ring.

        Parameters
        ----------
        harmonic : int
            Of the mesh frequency; 0 is the mean.
        which : {"ring", "sun"}

        Returns
        -------
        str
            "torque", "force" (across the axis) or "none"; "torque and force" where planets are not equally spaced.

        References
        ----------
        R. G. Parker: A physical explanation for the effectiveness of planet phasing. J. Sound Vibr. 236 (2000) 561-573.
        """
        if which not in ("sun", "ring"):
            raise ValueError(f"which is {which!r}; choose 'sun' or 'ring'")
        if not (harmonic >= 0 and harmonic == int(harmonic)):
            raise ValueError(f"harmonic is {harmonic!r}; give a whole number from 0 up")
        teeth = self.sun.teeth if which == "sun" else self.ring.teeth
        psi = np.array(self.angles, dtype=float) - float(self.angles[0])  # type: ignore[index]
        turns = [
            abs(np.exp(1j * (harmonic * teeth + one) * psi).sum()) > LEFT_OVER * self.planets for one in (0, 1, -1)
        ]
        acts = {"torque": turns[0], "force": turns[1] or turns[2]}
        return " and ".join(name for name, does in acts.items() if does) or "none"

    # --- speeds, torques, frequencies -----------------------------------------------------------------

    @property
    def basic_ratio(self) -> float:
        """Speed of the sun over that of the ring with the carrier held, -z_r / z_s of a plain set."""
        one, two = self.ratios
        return -one * two

    def speeds(self, **given: float) -> dict[str, float]:
        """Speeds of all members from those of two: w_s - w_c = i_0 (w_r - w_c); planets' speeds are absolute.

        Parameters
        ----------
        **given
            Two of ``sun``, ``carrier``, ``ring``.
        """
        if not (len(given) == 2 and set(given) <= set(MEMBERS)):
            raise ValueError(f"speeds are given of {', '.join(given) or 'nothing'}; give two of sun, carrier, ring")
        ratio = self.basic_ratio
        row = {"sun": 1.0, "ring": -ratio, "carrier": ratio - 1.0}
        missing = next(m for m in MEMBERS if m not in given)
        found = dict(given)
        found[missing] = -sum(row[m] * given[m] for m in given) / row[missing]
        found["planet"] = found["carrier"] - (found["sun"] - found["carrier"]) / self.ratios[0]
        return {m: found[m] for m in (*MEMBERS, "planet")}

    def sense(self, speeds: Mapping[str, float]) -> int:
        """Sense of rotation of the set about its axis: that of the carrier, or where it stands that of the sun.

        Parameters
        ----------
        speeds : mapping
            Of "sun" and "carrier", rad/s, as far as they are known; where nothing turns ``rotation`` tells it.
        """
        return next((-1 if w < 0.0 else 1 for m in ("carrier", "sun") if (w := speeds.get(m, 0.0))), self.rotation)

    def torques(self, **given: float) -> dict[str, float]:
        """Outer torques on sun, carrier and ring in balance without losses, from one of them, N m."""
        if not (len(given) == 1 and set(given) <= set(MEMBERS)):
            raise ValueError(f"torques are given of {', '.join(given) or 'nothing'}; give that of sun, carrier or ring")
        row = {"sun": 1.0, "ring": -self.basic_ratio, "carrier": self.basic_ratio - 1.0}
        member, value = next(iter(given.items()))
        return {m: value * row[m] / row[member] for m in MEMBERS}

    def efficiency(self, basic: float) -> float:
        """Efficiency with the sun driving and the ring held, from that of the set with the carrier held."""
        ratio = -self.basic_ratio
        return (1 + basic * ratio) / (1 + ratio)

    def frequencies(self, **given: float) -> dict[str, float]:
        """Frequencies of meshes, shafts and faults, Hz, from the speeds (rad/s) of two members.

        Returns
        -------
        dict
            ``mesh`` (of the sun), ``mesh_ring``; ``sun``, ``carrier``, ``ring``, ``planet`` (against the carrier);
            ``sun_fault``, ``ring_fault`` (one faulty tooth meets all planets), ``planet_fault`` (one set of flanks) and
            ``planet_fault_both``; ``planet_pass``.
        """
        turn = 1 / (2 * math.pi)
        speed = {m: w * turn for m, w in self.speeds(**given).items()}
        sun = abs(speed["sun"] - speed["carrier"])
        ring = abs(speed["ring"] - speed["carrier"])
        planet = abs(speed["planet"] - speed["carrier"])
        return {
            "mesh": sun * self.sun.teeth,
            "mesh_ring": ring * self.ring.teeth,
            **{m: abs(speed[m]) for m in MEMBERS},
            "planet": planet,
            "sun_fault": self.planets * sun,
            "ring_fault": self.planets * ring,
            "planet_fault": planet,
            "planet_fault_both": 2 * planet,
            "planet_pass": self.planets * abs(speed["carrier"]),
        }

    # --- places ---------------------------------------------------------------------------------------

    def start_angles(self, sun: float = 0.0) -> StartAngles:
        """Angles at which all drive flanks just touch, for an angle of the sun and the carrier at 0.

        Returns
        -------
        dict
            ``ring`` in rad; ``planets`` and ``steps`` as arrays: of each planet, and how far its second wheel is turned
            against the first.
        """
        perfect = replace(self, faults=(), pin_errors={})
        planets: list[float] = []
        steps: list[float] = []
        rings: list[float] = []
        step_teeth = (self.planet_at_ring or self.planet).teeth
        for psi, first, second in zip(self.angles, perfect.pairs_sun, perfect.pairs_ring):  # type: ignore[arg-type]
            psi = float(psi)
            planet = psi + first.driven_angle(sun - psi)
            step = 0.0
            facing = psi + math.pi
            ring = facing + second.driven_angle(planet - facing)
            if rings:
                pitch = 2 * math.pi / self.ring.teeth
                miss = (ring - rings[0] + 0.5 * pitch) % pitch - 0.5 * pitch
                if self.planet_at_ring is not None:
                    step = -miss * self.ring.teeth / step_teeth
            planets.append(planet)
            steps.append(step)
            rings.append(ring)
        return {"ring": rings[0], "planets": np.array(planets), "steps": np.array(steps)}

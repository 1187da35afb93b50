"""PAC2002: the Magic Formula of Pacejka's book of 2002 with ADAMS's names of coefficients; docs/theory/tires.md."""

from __future__ import annotations

import math
from collections.abc import Callable

from gearmbs.adams.tires.chain import Contact, Wrench, linear, magic, n, root, sign, within
from gearmbs.adams.tires.property_file import PropertyFile, TireError

SECTIONS = {
    "MODEL", "DIMENSION", "VERTICAL", "PARAMETER", "LONG_SLIP_RANGE", "SLIP_ANGLE_RANGE", "INCLINATION_ANGLE_RANGE",
    "VERTICAL_FORCE_RANGE", "SCALING_COEFFICIENTS", "LONGITUDINAL_COEFFICIENTS", "OVERTURNING_COEFFICIENTS",
    "LATERAL_COEFFICIENTS", "ROLLING_COEFFICIENTS", "ALIGNING_COEFFICIENTS",
}  # fmt: skip
PLAIN = set(
    "PROPERTY_FILE_FORMAT USE_MODE VXLOW LONGVL TYRESIDE UNLOADED_RADIUS WIDTH ASPECT_RATIO RIM_RADIUS "
    "RIM_WIDTH VERTICAL_STIFFNESS VERTICAL_DAMPING BREFF DREFF FREFF FNOMIN KPUMIN KPUMAX ALPMIN ALPMAX CAMMIN "
    "CAMMAX FZMIN FZMAX MBELT".split()
)
SCALES = set(
    "LFZO LCX LMUX LEX LKX LHX LVX LGAX LCY LMUY LEY LKY LHY LVY LGAY LTR LRES LGAZ LXAL LYKA LVYKA LS LSGKP "
    "LSGAL LGYR LMX LVMX LMY LCZ".split()
)
"""Factors of everything, 1 where they are not given."""
COEFFICIENTS = set(
    "PCX1 PDX1 PDX2 PDX3 PEX1 PEX2 PEX3 PEX4 PKX1 PKX2 PKX3 PHX1 PHX2 PVX1 PVX2 RBX1 RBX2 RCX1 REX1 REX2 RHX1 "
    "PTX1 PTX2 PTX3 QSX1 QSX2 QSX3 PCY1 PDY1 PDY2 PDY3 PEY1 PEY2 PEY3 PEY4 PKY1 PKY2 PKY3 PHY1 PHY2 PHY3 PVY1 "
    "PVY2 PVY3 PVY4 RBY1 RBY2 RBY3 RCY1 REY1 REY2 RHY1 RHY2 RVY1 RVY2 RVY3 RVY4 RVY5 RVY6 PTY1 PTY2 QSY1 QSY2 "
    "QSY3 QSY4 QBZ1 QBZ2 QBZ3 QBZ4 QBZ5 QBZ9 QBZ10 QCZ1 QDZ1 QDZ2 QDZ3 QDZ4 QDZ6 QDZ7 QDZ8 QDZ9 QEZ1 QEZ2 QEZ3 "
    "QEZ4 QEZ5 QHZ1 QHZ2 QHZ3 QHZ4 SSZ1 SSZ2 SSZ3 SSZ4 QTZ1".split()
)
MODES = {0, 1, 2, 3, 4, 11, 12, 13, 14}
DIVIDING = ("VXLOW", "LONGVL", "LFZO", "LCZ", "LCX", "LCY", "LMUX", "LMUY", "LKX", "LKY")
"""What others are divided by, 1 where it is not given."""
LOWEST_SPEED = 1.0
"""m/s: VXLOW where it is not given, as in the files that ADAMS brings."""
LARGEST_SLIP = 3.0
"""In units of the slip at which sliding begins: beyond it deflections of a tire that stands grow no more (Pacejka)."""
STANDING_DAMPING = 770.0
"""N s/m at the nominal load: what a tire that stands adds to its elasticity along the road, fading out up to VXLOW; of
the passenger car in Pacejka's book."""
LEAST_RELAXING = 0.01
"""Of the nominal load: with less the relaxation lengths, which are in proportion to it, are those of this."""
LEAST_STIFFNESS = 1e-3
"""Of the ratio of lateral slip stiffness to load: it divides the longitudinal one."""


def pac2002(tire: PropertyFile, contact: Contact, friction: float, mirrored: bool) -> Wrench:
    """Return forces and moments of a tire.

    Parameters
    ----------
    tire : PropertyFile
    contact : Contact
    friction : float
        Of the road, a factor of the tire's.
    mirrored : bool
        Whether it is mounted on the other side than the one it was measured on.

    Raises
    ------
    TireError
        If the file gives what is not modelled.
    """
    return _Formula(tire, contact, friction, mirrored).wrench()


class _Formula:
    """The equations of one tire, in the order of docs/theory/tires.md; loads are divided out where they can be."""

    def __init__(self, tire: PropertyFile, contact: Contact, friction: float, mirrored: bool) -> None:
        tire.refuse_unknown(PLAIN | SCALES | COEFFICIENTS, SECTIONS)
        self.tire, self.contact = tire, contact
        self.scale: Callable[[str], float] = lambda name: tire.number(name, 1.0)
        self.k: Callable[[str], float] = lambda name: tire.number(name, 0.0)
        self.mode = int(tire.number("USE_MODE", 4.0))
        if tire.number("USE_MODE", 4.0) not in MODES:
            raise TireError(f"{tire.name}: USE_MODE = {tire.number('USE_MODE', 4.0):g}; give one of {sorted(MODES)}")
        self.side = -1.0 if mirrored else 1.0
        self.mux, self.muy = friction * self.scale("LMUX"), friction * self.scale("LMUY")
        self.r0, self.kz = tire.number("UNLOADED_RADIUS"), tire.number("VERTICAL_STIFFNESS")
        self.nominal = tire.number("FNOMIN") * self.scale("LFZO")
        self.low = tire.number("VXLOW", LOWEST_SPEED)
        relaxing = ("PTX1", "PTY1", "PTY2") if self.mode > 10 else ()
        for name in ("UNLOADED_RADIUS", "VERTICAL_STIFFNESS", "FNOMIN", "PCX1", "PCY1", "PKX1", "PKY2", *relaxing):
            if not self.k(name) > 0.0 and (self.mode or name[0] != "P"):
                raise TireError(f"{tire.name}: {name} = {self.k(name):g} must be positive")
        if self.k("PKY1") == 0.0 and self.mode:
            raise TireError(f"{tire.name}: PKY1 = 0 must not be zero")
        for name in DIVIDING:
            if not tire.number(name, 1.0) > 0.0:
                raise TireError(f"{tire.name}: {name} = {tire.number(name, 1.0):g} must be positive")

    def var(self, name: str, function: str) -> str:
        """Make a VARIABLE."""
        return self.contact.variable(name, function)

    def wrench(self) -> Wrench:
        """Return forces and moments."""
        k, scale, c, mode = self.k, self.scale, self.contact, self.mode % 10
        if mode == 0:
            return Wrench("0", "0", "0", "0", "0")
        lowest, highest = k("FZMIN"), self.tire.number("FZMAX", math.inf)
        # formulas hold between these loads: below, forces are in proportion to it; above, they stay
        load = f"MAX({n(lowest)}, {c.fz})" if lowest > 0.0 else c.fz
        if math.isfinite(highest):
            load = f"MIN({n(highest)}, {load})"
        load = self.var("load", load)
        self.dfz = self.var("load_change", f"({load} - {n(self.nominal)})/{n(self.nominal)}")
        self.fz = f"MIN({n(highest)}, {c.fz})" if math.isfinite(highest) else c.fz
        gamma = (
            within(f"{n(self.side)}*{c.gamma}", k("CAMMIN"), k("CAMMAX"))
            if k("CAMMAX")
            else f"{n(self.side)}*{c.gamma}"
        )
        self.gamma = self.var("inclination", gamma)
        # over load: sin(2 atan z)/z = 2/(1 + z^2)
        z = f"{load}/{n(k('PKY2') * self.nominal)}"
        self.ky = self.var(
            "lateral_slip_stiffness",
            f"{n(2.0 * k('PKY1') * scale('LKY') / k('PKY2'))}/(1 + ({z})**2)"
            f"*(1 - {n(k('PKY3') * scale('LGAY'))}*ABS({self.gamma}))",
        )
        self.kx = self.var(
            "longitudinal_slip_stiffness",
            f"{linear(k('PKX1'), (k('PKX2'), self.dfz))}*EXP({n(k('PKX3'))}*{self.dfz})*{n(scale('LKX'))}",
        )
        kappa, alpha, turning = self._slips(load)
        fx = self._pure_x(kappa) if mode != 2 else "0"
        fy = self._pure_y(alpha) if mode != 1 else "0"
        swept = "0"
        if mode == 4:
            self.kappa = kappa
            fx = f"{fx}*{self._reduction(alpha, 'X')}"
            swept = self.var("lateral_force_of_kappa", self._ply(kappa, alpha))
            fy = f"{fy}*{self._reduction(kappa, 'Y', alpha)} + {swept}"
        fx = self.var("longitudinal_force", f"{self.fz}*({fx})")
        fy = self.var("lateral_force_of_side", f"{self.fz}*({fy})")
        mz = self._aligning(kappa, alpha, fx, fy, swept, mode == 4) + turning if mode != 1 else "0"
        mx = (
            f"{n(self.r0)}*{self.fz}*({n(k('QSX1') * scale('LVMX'))} + {n(scale('LMX'))}*"
            f"({n(-k('QSX2'))}*{self.gamma} + {n(k('QSX3') / self.nominal)}*{fy}))"
            if mode != 1
            else "0"
        )
        my = self._rolling(fx) if mode != 2 else "0"
        side = n(self.side)
        return Wrench(fx, f"{side}*{fy}", f"{side}*({mx})", my, f"{side}*({mz})")

    def _slips(self, load: str) -> tuple[str, str, str]:
        """Return longitudinal and lateral slip, and the gyroscopic couple: at once, or through deflections."""
        k, scale, c = self.k, self.scale, self.contact
        rolling = self.nominal / (self.kz * scale("LCZ"))
        given = f"{c.deflection}/{n(rolling)}"
        radius = self.var(
            "rolling_radius",
            f"{n(self.r0)} - {n(rolling)}*({n(k('DREFF'))}*ATAN({n(k('BREFF'))}*{given}) + {n(k('FREFF'))}*{given})",
        )
        vsx = self.var("slip_speed", f"{c.vx} - {c.spin}*{radius}")
        vsy = f"{n(self.side)}*{c.vsy}"
        speed = self.var("speed", f"ABS({c.vx})")
        turning = ""
        if self.mode < 10:
            along = f"MAX({speed}, {n(self.low)})"
            kappa, alpha = f"-{vsx}/{along}", f"ATAN({vsy}/{along})"
        else:
            load = self.var("relaxing_load", f"MAX({n(LEAST_RELAXING * self.nominal)}, {load})")
            sigma_x = self.var(
                "relaxation_x",
                f"{load}*{linear(k('PTX1'), (k('PTX2'), self.dfz))}*EXP({n(-k('PTX3'))}*{self.dfz})"
                f"*{n(self.r0 / self.nominal * scale('LSGKP'))}",
            )
            sigma_y = self.var(
                "relaxation_y",
                f"{n(2.0 * k('PTY1') * self.r0 * scale('LFZO') * scale('LSGAL'))}*{self._over(load)}"
                f"*(1 - {n(k('PKY3'))}*ABS({self.gamma}))",
            )
            slips, rates = [], []
            fading = self.var(
                "standing", f"IF({speed} - {n(self.low)}: 0.5 + 0.5*COS({n(math.pi / self.low)}*{speed}), 0, 0)"
            )
            # at the nominal load: relaxation length over slip stiffness
            soft_x = k("PTX1") * self.r0 * scale("LSGKP") / (k("PKX1") * scale("LKX"))
            soft_y = abs(k("PTY1") * self._at_nominal("PTY2") * self.r0 * scale("LSGAL") * scale("LFZO"))
            soft_y /= abs(k("PKY1") * scale("LKY") * self._at_nominal("PKY2"))
            for name, rate, sigma, stiffness, mu, soft in (
                ("x", f"-{vsx}", sigma_x, self.kx, k("PDX1") * self.mux, soft_x),
                ("y", vsy, sigma_y, f"ABS({self.ky})", k("PDY1") * self.muy, soft_y),
            ):
                held = c.state(f"deflection_{name}")
                free = self.var(f"deflection_rate_{name}", f"{rate} - {speed}*{held}/{sigma}")
                # a tire that stands and slides is deflected no further
                back = f"IF({free}*{held}: {free}, {free}, 0)"
                stopped = f"IF(ABS({held})*{stiffness} - {n(LARGEST_SLIP * mu)}*{sigma}: {free}, {free}, {back})"
                rates.append(
                    self.var(f"deflection_change_{name}", f"IF({speed} - {n(self.low)}: {stopped}, {free}, {free})")
                )
                c.rate(f"deflection_{name}", rates[-1])
                slips.append(f"({held} + {n(STANDING_DAMPING * soft / self.nominal)}*{fading}*{rates[-1]})/{sigma}")
            kappa, alpha = slips[0], f"ATAN({slips[1]})"
            if k("QTZ1") and k("MBELT"):
                turning = f" + {n(k('QTZ1') * scale('LGYR') * k('MBELT'))}*{radius}*{c.spin}*{rates[1]}"
        if k("KPUMAX"):
            kappa = within(kappa, k("KPUMIN"), k("KPUMAX"))
        if k("ALPMAX"):
            alpha = within(alpha, k("ALPMIN"), k("ALPMAX"))
        return self.var("longitudinal_slip", kappa), self.var("lateral_slip", alpha), turning

    def _at_nominal(self, name: str) -> float:
        """Return sin(2 atan(1/c)) of a coefficient."""
        return math.sin(2.0 * math.atan(1.0 / self.k(name))) if self.k(name) else 0.0

    def _over(self, load: str) -> str:
        """Return sin(2 atan z)/2 of the relaxation length's load."""
        z = f"{load}/{n(self.k('PTY2') * self.nominal)}"
        return f"({z})/(1 + ({z})**2)"

    def _pure_x(self, kappa: str) -> str:
        """Return the longitudinal force over the load without lateral slip."""
        k, scale, dfz = self.k, self.scale, self.dfz
        c = k("PCX1") * scale("LCX")
        mu = self.var(
            "friction_x",
            f"{linear(k('PDX1'), (k('PDX2'), dfz))}"
            f"*(1 - {n(k('PDX3') * scale('LGAX') ** 2)}*{self.gamma}**2)*{n(self.mux)}",
        )
        shift = linear(k("PHX1") * scale("LHX"), (k("PHX2") * scale("LHX"), dfz))
        x = self.var("slip_x", f"{kappa} + {shift}")
        e = self.var(
            "curvature_x",
            f"MIN(1, {linear(k('PEX1'), (k('PEX2'), dfz), (k('PEX3'), f'{dfz}**2'))}"
            f"*(1 - {n(k('PEX4'))}*{sign(x)})*{n(scale('LEX'))})",
        )
        b = f"{self.kx}/({n(c)}*{mu})"
        raised = linear(k("PVX1"), (k("PVX2"), dfz))
        return self.var("pure_x", f"{mu}*{magic(b, x, e, c)} + {raised}*{n(scale('LVX') * self.mux)}")

    def _pure_y(self, alpha: str) -> str:
        """Return the lateral force over the load without longitudinal slip."""
        k, scale, dfz, gamma = self.k, self.scale, self.dfz, self.gamma
        c, inclined = k("PCY1") * scale("LCY"), scale("LGAY")
        self.cy = c
        self.friction_y = mu = self.var(
            "friction_y",
            f"{linear(k('PDY1'), (k('PDY2'), dfz))}*(1 - {n(k('PDY3') * inclined**2)}*{gamma}**2)*{n(self.muy)}",
        )
        self.shift_y = linear(k("PHY1") * scale("LHY"), (k("PHY2") * scale("LHY"), dfz), (k("PHY3") * inclined, gamma))
        x = self.var("slip_y", f"{alpha} + {self.shift_y}")
        e = self.var(
            "curvature_y",
            f"MIN(1, {linear(k('PEY1'), (k('PEY2'), dfz))}"
            f"*(1 - {linear(k('PEY3'), (k('PEY4') * inclined, gamma))}*{sign(x)})*{n(scale('LEY'))})",
        )
        self.by = f"{self.ky}/({n(c)}*{mu})"
        tilted = linear(k("PVY3") * inclined, (k("PVY4") * inclined, dfz))
        self.raised_y = self.var(
            "raised_y",
            f"({linear(k('PVY1') * scale('LVY'), (k('PVY2') * scale('LVY'), dfz))} + {tilted}*{gamma})*{n(self.muy)}",
        )
        return self.var("pure_y", f"{mu}*{magic(self.by, x, e, c)} + {self.raised_y}")

    def _reduction(self, other: str, axis: str, alpha: str = "") -> str:
        """Return by what the other slip reduces a force."""
        k, scale, dfz = self.k, self.scale, self.dfz
        if axis == "X":
            shift = n(k("RHX1"))
            b = f"({n(k('RBX1'))}*COS(ATAN({n(k('RBX2'))}*{self.kappa}))*{n(scale('LXAL'))})"
        else:
            shift = linear(k("RHY1"), (k("RHY2"), dfz))
            b = f"({n(k('RBY1'))}*COS(ATAN({n(k('RBY2'))}*({alpha} - {n(k('RBY3'))})))*{n(scale('LYKA'))})"
        c = k(f"RC{axis}1")
        e = f"MIN(1, {linear(k(f'RE{axis}1'), (k(f'RE{axis}2'), dfz))})"
        wave = magic(b, f"({other} + {shift})", e, c, "COS")
        return self.var(f"reduction_{axis.lower()}", f"{wave}/{magic(b, shift, e, c, 'COS')}")

    def _ply(self, kappa: str, alpha: str) -> str:
        """Return the lateral force over the load that longitudinal slip causes."""
        k, dfz = self.k, self.dfz
        part = linear(k("RVY1"), (k("RVY2"), dfz), (k("RVY3"), self.gamma))
        return (
            f"{self.friction_y}*{part}*COS(ATAN({n(k('RVY4'))}*{alpha}))"
            f"*SIN({n(k('RVY5'))}*ATAN({n(k('RVY6'))}*{kappa}))*{n(self.scale('LVYKA'))}"
        )

    def _aligning(self, kappa: str, alpha: str, fx: str, fy: str, swept: str, combined: bool) -> str:
        """Return the aligning torque: lateral force times trail, a residual, longitudinal force times its arm."""
        k, scale, dfz = self.k, self.scale, self.dfz
        gamma = f"{n(scale('LGAZ'))}*{self.gamma}"
        stiff = scale("LKY") / self.muy
        trail_slip = self.var(
            "slip_trail",
            f"{alpha} + {linear(k('QHZ1'), (k('QHZ2'), dfz), (k('QHZ3'), gamma), (k('QHZ4'), f'{dfz}*{gamma}'))}",
        )
        rest_slip = self.var("slip_residual", f"{alpha} + {self.shift_y} + {self.raised_y}/{self._held(self.ky)}")
        b = self.var(
            "trail_slope",
            f"{linear(k('QBZ1'), (k('QBZ2'), dfz), (k('QBZ3'), f'{dfz}**2'))}"
            f"*(1 + {n(k('QBZ4'))}*{gamma} + {n(k('QBZ5'))}*ABS({gamma}))*{n(stiff)}",
        )
        c = k("QCZ1")
        e = self.var(
            "trail_curvature",
            f"MIN(1, {linear(k('QEZ1'), (k('QEZ2'), dfz), (k('QEZ3'), f'{dfz}**2'))}"
            f"*(1 + {linear(k('QEZ4'), (k('QEZ5'), gamma))}*{n(2.0 / math.pi)}*ATAN({b}*{n(c)}*{trail_slip})))",
        )
        if combined:
            share = f"({self.kx}/{self._held(self.ky)}*{kappa})**2"
            both = [
                self.var(f"{name}_both", f"ATAN({root(f'TAN({x})**2 + {share}')})*{sign(x)}")
                for name, x in (("trail", trail_slip), ("residual", rest_slip))
            ]
        else:
            both = [trail_slip, rest_slip]
        peak = (
            f"{linear(k('QDZ1'), (k('QDZ2'), dfz))}*(1 + {n(k('QDZ3'))}*{gamma} + {n(k('QDZ4'))}*({gamma})**2)"
            f"*{n(self.r0 / self.nominal * scale('LTR'))}*{self.fz}"
        )
        cosine = f"COS({alpha})*{self.contact.heading(self.low)}"
        trail = self.var("trail", f"{peak}*{magic(b, both[0], e, c, 'COS')}*{cosine}")
        slope = f"({n(k('QBZ9') * stiff)} + {n(k('QBZ10') * self.cy)}*{self.by})"
        residual = (
            f"{self.fz}*({n(scale('LRES'))}*{linear(k('QDZ6'), (k('QDZ7'), dfz))} + "
            f"{linear(k('QDZ8'), (k('QDZ9'), dfz))}*{gamma})*{n(self.r0 * self.muy)}"
            f"*COS(ATAN({slope}*{both[1]}))*{cosine}"
        )
        torque = f"-{trail}*({fy} - {self.fz}*{swept}) + {residual}"
        if combined:
            arm = linear(
                k("SSZ1"), (k("SSZ2") / self.nominal, fy), (k("SSZ3"), self.gamma), (k("SSZ4"), f"{dfz}*{self.gamma}")
            )
            torque += f" + {arm}*{n(self.r0 * scale('LS'))}*{fx}"
        return torque

    @staticmethod
    def _held(stiffness: str) -> str:
        """Return a slip stiffness as a divisor."""
        return f"(SIGN(MAX(ABS({stiffness}), {n(LEAST_STIFFNESS)}), {stiffness}))"

    def _rolling(self, fx: str) -> str:
        """Return the torque of rolling resistance, against the rotation; in proportion to it below VXLOW."""
        k, c, speed = self.k, self.contact, self.tire.number("LONGVL", 1.0)
        if not any(k(f"QSY{j}") for j in range(1, 5)):
            return "0"
        ratio = f"({c.vx}/{n(speed)})"
        sum_ = linear(k("QSY1"), (k("QSY2") / self.nominal, fx), (k("QSY3"), f"ABS{ratio}"), (k("QSY4"), f"{ratio}**4"))
        turns = within(f"{c.spin}*{n(self.r0 / self.low)}", -1.0, 1.0)
        return f"-{n(self.r0 * self.scale('LMY'))}*{c.fz}*{sum_}*{turns}"

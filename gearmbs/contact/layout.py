"""Where things stand in the flat tables of a gear pair and in the kernel's scratch array.

The tables are plain arrays (``gi`` int64, ``gr`` float64) so that one compiled kernel serves every pair. The scratch
array holds everything the kernel computes on the way, at fixed places: no slices are made, nothing is allocated.
"""

from __future__ import annotations

# --- gi: integers -------------------------------------------------------------------------------
Z1 = 0  # teeth of wheel 1
Z2 = 1
N_SLICES = 2  # slices along the face; 1: a single plane at mid-face, no end effects
LAW = 3  # one of LAW_*
FRICTION = 4  # one of FRICTION_*
DRIVE = 5  # +1: wheel 1 drives turning positive about its z axis, -1: negative
LOAD = 6  # one of LOAD_*
SHAPE_S = 7  # stations of a deviation shape along the profile
SHAPE_Z = 8  # stations of a deviation shape along the face
O_TOOTH = 9  # offset in gi of the tooth records (shape, tip, compliance numbers; -1: none), 0: all teeth perfect
O_OFFSET = 10  # offset in gr of one constant deviation per tooth flank
O_SHAPE = 11  # offset in gr of the deviation shapes
O_TIP = 12  # offset in gr of tip strings over the face, for broken and chipped teeth
O_COMPLIANCE = 13  # offset in gr of relative compliances along the profile, 0: constant stiffness
N_COMPLIANCE = 14  # stations of a compliance curve
ROOT = 15  # 1: tips also meet the mate's root
GI_HEADER = 16
TOOTH = 3  # integers per tooth record

# --- gr: reals; wheel 1 at 0, wheel 2 at WHEEL ----------------------------------------------------
RB = 0  # base radius, m
PSI = 1  # half angle of the tooth at the base circle, rad
S_TIP = 2  # string length where the involute ends at the tip, m
R_CORNER = 3  # radius of the centre of the tip rounding, m (the tip corner itself when sharp)
PSI_CORNER = 4  # its half angle, rad
R_ROUND = 5  # tip rounding radius, m
R_TIP = 6  # tip circle radius, m
R_ROOT = 7  # root circle radius, m
FACE = 8  # face width, m
S_FORM = 9  # string length where the involute begins, m
R_FILLET = 10  # radius of the root arc, m
R_FILLET_CENTRE = 11  # radius of the arc's centre, m
PSI_FILLET = 12  # half angle of the arc's centre from the tooth's middle, rad
SHAPE_S0 = 13  # string length of the first profile station, m
SHAPE_DS = 14  # spacing of the profile stations, m
WHEEL = 16
PITCH = 32  # base pitch, m
LAW_K = 33  # stiffness per unit face width, N/m^(1+e)
LAW_E = 34
LAW_C = 35  # damping per unit face width, N s/m^2 (IMPACT), or rate factor (Hunt-Crossley), s/m
LAW_D = 36  # penetration of full damping, m
MU_S = 37
MU_D = 38
V_S = 39
V_D = 40
WIDTH = 41  # common face width the stiffness refers to, m
EDGE_BLEND = 42  # rounding of the face ends in the overlap, m
GAP_MARGIN = 43  # most material added to a flank pair by deviations, m
ZETA_LO = 44  # the slices' range along the mean axis, m
ZETA_HI = 45
COMPLIANCE_S0 = 46  # first station of the pair's compliance curve on wheel 1's string, m
COMPLIANCE_DS = 47
AXIAL_SHIFT = 48  # nominal axial offset of wheel 2, m
GR_HEADER = 50

LAW_IMPACT = 0
LAW_HUNT_CROSSLEY = 1

FRICTION_NONE = 0
FRICTION_ADAMS = 1
FRICTION_SMOOTH = 2

LOAD_SLICES = 0
LOAD_ADAMS = 1

# --- pose numbers -----------------------------------------------------------------------------------
# centre distance, axial offset, tilt (inclination, skew), spin angles
X_A, X_H, X_P, X_Q, X_F1, X_F2 = range(6)

# --- scratch: node records ----------------------------------------------------------------------------
N_ALPHA = 0  # operating angle of the contact normal in this section, its sine and cosine
N_SIN = 1
N_COS = 2
N_GAP = 3
N_GRAD = 4  # 6: d gap / d x at fixed station
N_HESS = 10  # 36: d2 gap / dx2
N_DALPHA = 46  # 6: d alpha / d x
N_PN = 52  # contact point, along the normal and the tangent, from wheel 1's centre
N_PT = 53
N_DPN = 54  # 6
N_DPT = 60  # 6
N_FORCE = 66  # nodal normal force, N
N_FX = 67  # 6: its derivative with respect to x
N_FV = 73  # 6: and to dx/dt
N_RATE = 79  # d gap / dt
N_S1 = 80  # string length on wheel 1 at the contact
N_S2 = 81
N_KIND = 82  # 0 flank on flank, 1 corner of wheel 1, 2 corner of wheel 2
N_DRATE = 83  # 6: d (d gap / d t) / d x
N_ELASTIC = 89  # elastic part of the nodal force, N
NODE = 90

# --- scratch: sums over all contacts, in the mean frame -------------------------------------------------
W_SUMS = 560
Q_ = W_SUMS  # 6: generalised normal force
H_ = Q_ + 6  # 36: dQ/dx
B_ = H_ + 36  # 36: dQ/d(dx/dt)
F_ = B_ + 36  # 6: friction wrench on wheel 1
FX_ = F_ + 6  # 36: its derivative by x
FV_ = FX_ + 36  # 36: and by the relative twist
FR_ = FV_ + 36  # 36: and by dx/dt, through the damping in the normal force
SUMS = 192

# --- scratch: single places -------------------------------------------------------------------------------
W_X = 0  # 6: pose numbers
W_XD = 6  # 6: their rates
W_V = 12  # 6: relative twist of wheel 1 in the mean frame
W_M = 18  # 9: mean frame, row by row
W_XDX = 27  # 24: d(dx/dt)/d(a, h, p, q)
S_X = 51  # the same, as seen on the side of the teeth at work
S_XD = 57
S_V = 63
S_W = 69  # cosine of half the angle between the axes
S_A0 = 70  # operating angle of parallel axes, its sine and cosine
S_LENGTH = 73  # length of the line of action, m
S_ALPHA = 74  # running normal: alpha, sine, cosine
S_SIN = 75
S_COS = 76
C_SIN = 77  # tip corner at work: its polar angle's sine and cosine, radius, rounding, string, half angle
C_COS = 78
C_R = 79
C_ROUND = 80
C_STRING = 81
C_PSI = 82
S_IW = 529  # 1/w, its third and fifth power, 1/(1 + w), and m = 1/(w (1 + w)) with two derivatives by w
S_IW3 = 530
S_IW5 = 531
S_ONE = 532
S_M = 533
S_MW = 534
S_MWW = 535
S_SLOPE = 536  # d alpha / d zeta at the last solution
S_CURVE = 537  # lower bound of the corner gap's growth beyond the path of contact, 1/m
S_OVERHANG = 538  # how far the common face may reach beyond the slices, m
P_MOVED = 539  # 6: derivative of a pair's elastic energy by the pose as its centroid moves along the face
P_SOFT = 83  # stiffness factor of the tooth pair at work, and its gradient (6) and Hessian (36)
P_SOFT_X = 84
P_SOFT_XX = 90
P_DEV = 126  # deviation lookup: value, gradient (6), Hessian (36)
W_SUP = 169  # 30: two support records
W_LIMIT = 199  # 172: limits of the face, with derivatives
W_G = 371  # 36
W_MU = 407  # 18
W_W = 425  # 6
W_WX = 431  # 24
W_KX = 455  # 36
W_KV = 491  # 36
W_NODES = W_SUMS + SUMS + 72
W_J = W_SUMS + SUMS  # 72


def work_size(n_slices: int) -> int:
    """Length of the scratch array the kernel needs for so many slices."""
    return W_NODES + (2 * NODE + 1) * (n_slices + 1)

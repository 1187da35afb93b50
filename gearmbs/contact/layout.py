"""Where things stand in the flat tables of a gear pair, and how large they are.

The tables are plain arrays (``gi`` int64, ``gr`` float64) so that one compiled kernel serves every pair.
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
N_SHAPE_S = 7  # stations of a deviation shape along the profile
N_SHAPE_Z = 8  # stations of a deviation shape along the face
O_TEETH_I = 9  # offset in gi of the shape numbers per wheel, flank and tooth (-1: none)
O_TEETH_R = 10  # offset in gr of the tooth records
O_SHAPES = 11  # offset in gr of the deviation shapes
HAS_TEETH = 12  # 0: every tooth is the same and perfect
O_STIFF = 13  # offset in gr of the stiffness curves
N_STIFF = 14  # stations of a stiffness curve, 0: none
ROOT = 15  # 1: tip corners also meet the mate's root arc and root circle
GI_HEADER = 16

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
WHEEL = 16
PITCH = 32  # base pitch, m
LAW_K = 33  # stiffness per unit face width, N/m^(1+e)
LAW_E = 34
LAW_C = 35  # damping per unit face width, N s/m^2 (IMPACT), or restitution factor (Hunt-Crossley), s/m
LAW_D = 36  # penetration of full damping, m
MU_S = 37
MU_D = 38
V_S = 39
V_D = 40
WIDTH = 41  # common face width the stiffness refers to, m
EDGE_BLEND = 42  # rounding of the face ends in the overlap, m
ZETA_LO = 51  # the slices' range along the mean axis, m
ZETA_HI = 52
GAP_MARGIN = 43  # most material added to a flank pair by deviations, m
SHAPE_S0 = 44  # string length of the first profile station of wheel 1, m; wheel 2 follows
SHAPE_DS = 46  # spacing of the profile stations of wheel 1, m; wheel 2 follows
STIFF_S0 = 48  # first station of the stiffness curves along the path of contact, m
STIFF_DS = 49
ROOT_K = 50  # stiffness per unit width of tip-root contact, N/m^(1+e)
GR_HEADER = 56

LAW_IMPACT = 0
LAW_HUNT_CROSSLEY = 1
LAW_LINEAR = 2
LAW_HERTZ = 3

FRICTION_NONE = 0
FRICTION_ADAMS = 1
FRICTION_SMOOTH = 2

LOAD_SLICES = 0
LOAD_ADAMS = 1

# --- records in the work array --------------------------------------------------------------------
X_A, X_H, X_P, X_Q, X_F1, X_F2 = range(6)  # centre distance, axial offset, tilt, spin angles

N_ALPHA = 0  # operating angle of the contact normal in this section
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
NODE = 89

# sums over all contacts, in the mean frame, and the matrices of the final chain
Q_ = 0  # 6: generalised normal force
H_ = 6  # 36: dQ/dx
B_ = 42  # 36: dQ/d(dx/dt)
F_ = 78  # 6: friction wrench on wheel 1
FX_ = 84  # 36: its derivative by x
FV_ = 120  # 36: and by the relative twist
FR_ = 156  # 36: and by dx/dt, through the damping in the normal force
SUMS = 192

W_X, W_XD, W_V, W_MX, W_MXD, W_MV = 0, 6, 12, 18, 24, 30
W_FRAME = 36  # 9
W_XDX = 45  # 24
W_WX = 69  # 24
W_G = 93  # 36
W_MU = 129  # 18
W_W = 147  # 6
W_KX = 153  # 36
W_KV = 189  # 36
W_J = 225  # 72
W_SUP = 297  # 30
W_LIMIT = 327  # 2 x (1 + 6 + 36) for the ends, 2 x 43 scratch
W_SUMS = 499
W_NODES = W_SUMS + SUMS


def work_size(n_slices: int) -> int:
    """Length of the scratch array the kernel needs for so many slices."""
    return W_NODES + (2 * NODE + 1) * (n_slices + 1)

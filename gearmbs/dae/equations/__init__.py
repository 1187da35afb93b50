"""The equations of the paper, (1) to (9), as compiled kernels over the tables of a mechanism.

Unknowns and tables, rotations, kinematics, constraint terms, applied loads, the residual and its exact Jacobian, and
the linear system of the accelerations. Nothing here knows how the equations are integrated, or
what the machines are that they describe.
"""

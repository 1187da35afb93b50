"""Integrators of DAEs G(t, y, y') = 0: WSTIFF, GSTIFF and IDA.

Any `gearmbs.dae.problem.DAEProblem` will do; nothing here knows the equations of a mechanism.
The table of constants, of what halving and doubling them changes, is ``docs/data/integrator_constants.txt``.
"""

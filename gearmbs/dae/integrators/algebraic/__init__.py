"""Algebraic unknowns at an instant: solved for from the differential ones, where outputs lie between the steps.

The polynomial of a step interpolates differential unknowns within the tolerance, for the error test looks at them. It
says nothing of an algebraic unknown outside error control, which may do anything between two steps. Such unknowns z
are solved for where they are asked for. With t and the differential unknowns x given, the unknowns are z and, as far
as their equations hold them, the rates x'. In the graph of equations and these unknowns

* an equation that holds some of them stands for itself, G_i(t, x, x', z) = 0;
* one that holds none, g(t, x) = 0, is a constraint. Its derivative g_t + g_x x' = 0 takes its place: it determines
  the multipliers of a system of index two;
* a largest matching tells what the equations determine: all that no path alternating between matched and other edges
  connects with an unmatched unknown (Dulmage and Mendelsohn).

Of these the equations that the wanted unknowns need are solved by Newton's method with a frozen matrix. Then z', the
slope along x', solves G_x x' + G_z z' + G_t = 0 with the same matrix.

References
----------
.. [1] A. L. Dulmage, N. S. Mendelsohn, "Coverings of bipartite graphs", Canad. J. Math. 10 (1958) 517-534.
.. [2] C. C. Pantelides, "The consistent initialization of differential-algebraic systems", SIAM J. Sci. Stat. Comput.
       9 (1988) 213-231.
"""

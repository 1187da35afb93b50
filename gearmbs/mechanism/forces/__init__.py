"""Force elements with kernels of their own: a kernel, and a small class that fills its tables.

The kernels are imported when a mechanism that uses them is compiled, never before.
"""

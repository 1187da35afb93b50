"""Force elements with kernels of their own: a kernel with the signature of the door, and a small class that fills it.

The kernels are imported when a mechanism that uses them is compiled, never before.
"""

"""The own stages: what of `gearmbs.kernels` uses numba's private parts, imported where something is compiled."""

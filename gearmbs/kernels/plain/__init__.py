"""Stand-ins for modules of `gearmbs.kernels` that leave compiling and keeping to numba's documented interface."""

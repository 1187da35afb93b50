"""All benchmarks, or those named: ``python -m benchmarks [gear] [precision] [digits] [size] [contact] [step] ..``."""

import os

# one thread everywhere, before any library reads it
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[_name] = "1"

from benchmarks.runner import main  # noqa: E402

if __name__ == "__main__":
    main()

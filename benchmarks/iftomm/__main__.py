"""Print the benchmark problems' deviations: ``python -m benchmarks.iftomm [name ...]``."""

import sys

from benchmarks.iftomm import PROBLEMS, run, table

for name in sys.argv[1:] or PROBLEMS:
    print(table([run(name)]), flush=True)

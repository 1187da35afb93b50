"""Print the benchmark problems' deviations: ``python -m gearmbs.studies.iftomm [name ...]``."""

import sys

from gearmbs.studies.iftomm import PROBLEMS, run, table

for name in sys.argv[1:] or PROBLEMS:
    print(table([run(name)]), flush=True)

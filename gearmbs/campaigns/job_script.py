"""Job scripts for Slurm and PBS."""

from __future__ import annotations

import shlex
from pathlib import Path

from gearmbs.campaigns.errors import CampaignError
from gearmbs.campaigns.settings import whole

HEADS = {
    "slurm": """#!/bin/bash
#SBATCH --job-name={name}
#SBATCH --array=1-{elements}
#SBATCH --time={minutes}
#SBATCH --cpus-per-task=1
#SBATCH --mem=2G
#SBATCH --requeue
""",
    "pbs": """#!/bin/bash
#PBS -N {name}
#PBS -J 1-{elements}
#PBS -l walltime={hours:02d}:{rest:02d}:00
#PBS -l select=1:ncpus=1:mem=2gb
#PBS -r y
""",
}
VARIABLES = {"slurm": ("SLURM_TMPDIR", "SLURM_ARRAY_TASK_ID"), "pbs": ("TMPDIR", "PBS_ARRAY_INDEX")}
"""Where a system keeps the node's own disk and the number of an element."""

BODY = """
# compiled code on the node's own disk, so that nodes of different processors do not share it
export NUMBA_CACHE_DIR=${{{disk}:-/tmp}}/gearmbs-kernels
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 NUMBA_NUM_THREADS=1

gearmbs campaign work {folder} --part ${element}/{elements} --minutes {stop}
"""


def job_script(folder: str | Path, elements: int, minutes: int, system: str = "slurm") -> str:
    """Return the script of a job array whose elements work on parts of a campaign.

    Parameters
    ----------
    folder : path-like
    elements : int
        Parts.
    minutes : int
        Wall time of an element; it starts no unit in the last tenth.
    system : {"slurm", "pbs"}

    Raises
    ------
    CampaignError
        For another system, and for numbers below one.
    """
    if system not in HEADS:
        raise CampaignError(f"--system is {system!r}; choose {' or '.join(HEADS)}")
    elements, minutes = whole(elements, "--elements", 1), whole(minutes, "--minutes", 1)
    folder = Path(folder).resolve()
    stop = max(1, minutes - max(2, minutes // 10))
    disk, element = VARIABLES[system]
    given = {
        "name": folder.stem.replace(" ", "_"),
        "elements": elements,
        "folder": shlex.quote(str(folder)),
        "disk": disk,
        "element": element,
    }
    hours, rest = divmod(minutes, 60)
    return (HEADS[system] + BODY).format(**given, minutes=minutes, hours=hours, rest=rest, stop=stop)

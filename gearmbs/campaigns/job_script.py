"""A job script for Slurm."""

from __future__ import annotations

from pathlib import Path

SCRIPT = """#!/bin/bash
#SBATCH --job-name={name}
#SBATCH --array=1-{elements}
#SBATCH --time={minutes}
#SBATCH --cpus-per-task=1
#SBATCH --mem=2G
#SBATCH --requeue

# compiled code on the node's own disk, so that nodes of different processors do not share it
export NUMBA_CACHE_DIR=${{SLURM_TMPDIR:-/tmp}}/gearmbs-kernels
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 NUMBA_NUM_THREADS=1

gearmbs campaign work {folder} --part $SLURM_ARRAY_TASK_ID/{elements} --minutes {stop}
"""


def job_script(folder: str | Path, elements: int, minutes: int) -> str:
    """Return the script of a job array whose elements work on parts of a campaign.

    Parameters
    ----------
    folder : path-like
    elements : int
        Parts.
    minutes : int
        Wall time of an element; it starts no unit in the last tenth.
    """
    folder = Path(folder).resolve()
    stop = max(1, minutes - max(2, minutes // 10))
    return SCRIPT.format(name=folder.stem, elements=elements, minutes=minutes, folder=folder, stop=stop)

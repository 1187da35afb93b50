"""Jobs for worker processes, in a module that imports little else."""

import os
import signal
import threading

from gearmbs.studies.run.engine import Refused


def square(job, report):
    report(0.5)
    return job**2


def fail_or_wait(job, report):
    report(os.getpid())
    if job == "fail":
        raise ValueError("the job failed")
    if job == "die":
        os._exit(3)
    threading.Event().wait()


def raise_what_cannot_travel(job, report):
    class Local(Exception):
        pass

    raise Local("only here")


def return_what_cannot_travel(job, report):
    return lambda: job


class Unreadable:
    """What can be sent but not read."""

    def __reduce__(self):
        return int, ("no number",)


def square_or_die(job, report):
    if job == "die":
        os._exit(3)
    return job**2


def refuse_at_first(job, report):
    if not job or not os.path.exists(job):
        if job:
            open(job, "w").close()
        raise Refused("host x: no module", lasting=True)
    return job


def stop_at_first(job, report):
    if not os.path.exists(job):
        with open(job, "w") as file:
            file.write(str(os.getpid()))
        os.kill(os.getpid(), signal.SIGSTOP)
    return job

"""Find runs that go on without getting anywhere."""

from __future__ import annotations

from dataclasses import dataclass

WINDOW = 50_000
"""Steps that are looked at together."""
HOPELESS = 1e10
"""Steps to the end of the span, at the rate of the last window, from which on a run that does not speed up is ended.

The smallest models take a day for so many, and what is kept of each, 24 bytes, comes to 240 GB.
"""


@dataclass
class StallWatch:
    """Progress over windows of steps.

    A start, a jump or an impact may take many small steps, but they grow again. Where the equations have no solution
    beyond some time, as where friction jams a joint, they do not: the integrator creeps towards that time for ever.

    Attributes
    ----------
    steps : int
        Accepted steps at the start of the present window.
    t : float
        Time at the start of the present window.
    progress : float
        What the last whole window went; 0 before there is one.
    """

    steps: int
    t: float
    progress: float = 0.0

    def steps_needed(self, steps: int, t: float, t_end: float) -> float:
        """Return the steps from ``t`` to the end if the run is stalled, else 0.

        Stalled means that two whole windows have passed, that the second went no more than twice as far as the first,
        and that at this rate the end is more than `HOPELESS` steps away.
        """
        if steps - self.steps < WINDOW:
            return 0.0
        progress = t - self.t
        needed = (t_end - t) * (steps - self.steps) / progress if progress > 0.0 else float("inf")
        stalled = 0.0 < self.progress and progress <= 2.0 * self.progress and needed > HOPELESS
        self.steps, self.t, self.progress = steps, t, progress
        return needed if stalled else 0.0

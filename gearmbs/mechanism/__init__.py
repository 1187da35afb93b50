"""What a person builds: bodies, markers, joints, motions, forces."""

from gearmbs._lazy import late

__all__ = late(__name__)

"""Studies of drivetrains and planetary sets."""

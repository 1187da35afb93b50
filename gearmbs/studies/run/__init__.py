"""From a case to its record: the rig, the simulation, many at once, and files."""

"""What a drivetrain does at rest under its loads: torques of all its parts, forces of meshes and bearings, tilts."""

"""Files of flexible bodies: neutral files, Nastran, Ansys, and matrices."""

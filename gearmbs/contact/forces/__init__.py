"""Forces of one slice of the face and of friction in one section, with all derivatives, from one statement."""

"""Command files of ADAMS View (.cmd): read, evaluated by an interpreter of its own, and stated as a deck."""

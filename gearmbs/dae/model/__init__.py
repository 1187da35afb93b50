"""A mechanism as a DAE: its tables with names, assembly, redundancy, consistent initial values, records at outputs."""

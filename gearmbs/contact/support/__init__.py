"""Support functions of tooth profiles in a section across two tilted wheels, with all second derivatives."""

"""Designations of bearings of which there is no kind, or no size: what they are, and what would do."""

from __future__ import annotations

import re

NOT_THERE = ((r"29[2-4]\d\d(?!\d)", "a spherical roller thrust bearing"),)
"""Designations of thrust bearings, of which there is no kind."""
BALLS = re.compile(r"5(?P<form>[2-4])(?P<section>[1-4]\d\d)(?!\d)")
"""Thrust ball bearings with the balls of those that begin with 51: 52 of two directions, 53 and 54 on a sphere."""
NOT_TABULATED = (
    (
        r"89[34]\d\d(?!\d)",
        "a cylindrical roller thrust bearing of a series that is not tabulated",
        "give kind= of thrust rollers with bore=, outside_diameter=, width=, dynamic_rating= and "
        "static_rating= of the catalogue, and elements=, element_diameter=, roller_length= and pitch_diameter=",
    ),
    (
        r"C\d{4}(?!\d)",
        "a toroidal roller bearing, which gives way along its axis",
        "one with a spherical roller bearing's kind= and its own numbers carries axially, too",
    ),
    (
        r"(?:BS2-|WS)\d{4}",
        "a sealed spherical roller bearing of a maker's own width",
        "give the designation without the letters before it, and width=",
    ),
    (
        r"(?:[RKL]?LS|RMS|N?LRJ|MRJ|[HL]?M|LL|JL?M?)\d+",
        "an inch bearing; inch sizes are not tabulated",
        "give kind=, bore=, outside_diameter=, width= and elements=, element_diameter=, pitch_diameter=",
    ),
)
"""Designations of other bearings that are told by name: what they are, and what would do."""


def told_of(designation: str) -> str:
    """Return what is said of a designation of no kind, in capitals; empty if nothing is known of it."""
    balls = BALLS.match(designation)
    if balls is not None:
        one = f"51{balls['section']}"
        if balls["form"] == "3":
            return f"is a thrust ball bearing whose washer stands on a sphere; its balls and C are those of '{one}'"
        return (
            "is a thrust ball bearing of two directions, which carries in each what one of one does: give two of "
            f"'{one}' at its station, with sense=1 and sense=-1"
        )
    for pattern, name in NOT_THERE:
        if re.match(pattern, designation):
            return (
                f"is {name}, which carries axial loads, and of which there is no kind; hold the shaft along "
                "its axis by Mechanism.bushing with the axial stiffness, and count its life by the C of its catalogue"
            )
    for pattern, name, remedy in NOT_TABULATED:
        if re.match(pattern, designation):
            return f"is {name}; {remedy}"
    return ""

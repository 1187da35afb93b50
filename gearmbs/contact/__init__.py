"""Compiled kernels of tooth contact: force laws, friction, tooth gaps, slices; values and exact derivatives."""

from typing import TYPE_CHECKING

from gearmbs._lazy import late

if TYPE_CHECKING:
    from gearmbs.contact.kernel import GEAR_CONTACT_SIG, gear_contact
    from gearmbs.contact.layout import work_size
    from gearmbs.contact.probe import COLUMNS as GAP_COLUMNS
    from gearmbs.contact.probe import pair_gaps

__all__ = [
    "GAP_COLUMNS",
    "GEAR_CONTACT_SIG",
    "gear_contact",
    "pair_gaps",
    "work_size",
]

late(
    __name__,
    {
        "GAP_COLUMNS": ".probe:COLUMNS",
        "GEAR_CONTACT_SIG": ".kernel",
        "gear_contact": ".kernel",
        "pair_gaps": ".probe",
        "work_size": ".layout",
    },
)

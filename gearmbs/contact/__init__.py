"""Compiled kernels of tooth contact: force laws, friction, tooth gaps, slices; values and exact derivatives."""

from typing import TYPE_CHECKING

from gearmbs._lazy import late
from gearmbs.contact.layout import work_size

if TYPE_CHECKING:
    from gearmbs.contact.kernel import GEAR_CONTACT_SIG, gear_contact
    from gearmbs.contact.probe import COLUMNS as GAP_COLUMNS
    from gearmbs.contact.probe import pair_gaps

__all__ = ["GAP_COLUMNS", "GEAR_CONTACT_SIG", "gear_contact", "pair_gaps", "work_size"]

# the layout of the tables is needed where nothing is to be compiled
__getattr__ = late(
    __name__,
    {
        "GEAR_CONTACT_SIG": "gearmbs.contact.kernel",
        "gear_contact": "gearmbs.contact.kernel",
        "GAP_COLUMNS": "gearmbs.contact.probe:COLUMNS",
        "pair_gaps": "gearmbs.contact.probe",
    },
)

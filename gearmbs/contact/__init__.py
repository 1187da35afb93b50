"""Compiled kernels of tooth contact: force laws, friction, tooth gaps, slices; values and exact derivatives."""

from gearmbs.contact.kernel import GEAR_CONTACT_SIG, gear_contact
from gearmbs.contact.layout import work_size
from gearmbs.contact.probe import COLUMNS as GAP_COLUMNS
from gearmbs.contact.probe import pair_gaps

__all__ = ["GAP_COLUMNS", "GEAR_CONTACT_SIG", "gear_contact", "pair_gaps", "work_size"]

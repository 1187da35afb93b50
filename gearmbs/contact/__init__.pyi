from .kernel import GEAR_CONTACT_SIG as GEAR_CONTACT_SIG
from .kernel import gear_contact as gear_contact
from .layout import work_size as work_size
from .probe import GAP_COLUMNS as GAP_COLUMNS
from .probe import pair_gaps as pair_gaps

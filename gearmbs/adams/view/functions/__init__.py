"""Functions of View's design-time expressions: a table of names, numbers of arguments, and what they do.

Nothing here reads a file, starts a program or asks the system.
"""

from gearmbs.adams.view.functions import matrices, numeric, objects, places, texts
from gearmbs.adams.view.functions.table import FUNCTIONS

__all__ = ["FUNCTIONS", "matrices", "numeric", "objects", "places", "texts"]

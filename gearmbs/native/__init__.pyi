from .foreign import ForeignFMU as ForeignFMU
from .library import Exported as Exported
from .library import export as export

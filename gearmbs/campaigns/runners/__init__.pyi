from .dask import DaskRunner as DaskRunner
from .processes import ProcessRunner as ProcessRunner
from .processes import SerialRunner as SerialRunner

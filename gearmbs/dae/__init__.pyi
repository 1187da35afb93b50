from .integrators.options import Options as Options
from .integrators.wstiff import resume as resume
from .problem import DAEProblem as DAEProblem
from .result import DAEResult as DAEResult
from .result import SolverStats as SolverStats
from .result import Status as Status
from .solve import solve_dae as solve_dae
from .state import State as State

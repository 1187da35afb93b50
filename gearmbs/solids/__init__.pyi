from .bodies import Body as Body
from .bodies import Face as Face
from .bodies import Primitive as Primitive
from .bodies import faceted as faceted
from .bodies import primitive as primitive
from .bodies import read_bodies as read_bodies

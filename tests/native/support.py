"""Exported libraries called through ctypes."""

import ctypes
from ctypes import c_char_p, c_double, c_int, c_longlong, c_size_t, c_void_p

import numpy as np

FUNCTIONS = {
    "message": (c_char_p, [c_int]),
    "start_time": (c_double, []),
    "end_time": (c_double, []),
    "numbers": (c_size_t, []),
    "number_name": (c_char_p, [c_size_t]),
    "number_unit": (c_char_p, [c_size_t]),
    "outputs": (c_size_t, []),
    "output_name": (c_char_p, [c_size_t]),
    "unknowns": (c_size_t, []),
    "unknown_name": (c_char_p, [c_size_t]),
    "create": (c_void_p, []),
    "free": (None, [c_void_p]),
    "time": (c_double, [c_void_p]),
    "steps": (c_longlong, [c_void_p]),
    "set": (c_int, [c_void_p, c_size_t, c_double]),
    "number_range": (c_int, [c_size_t, c_void_p, c_void_p]),
    "number": (c_int, [c_void_p, c_size_t, c_void_p]),
    "advance": (c_int, [c_void_p, c_double]),
    "get": (c_int, [c_void_p, c_void_p]),
    "get_unknowns": (c_int, [c_void_p, c_void_p, c_void_p]),
    "state_size": (c_size_t, []),
    "save": (c_int, [c_void_p, c_void_p]),
    "restore": (c_int, [c_void_p, c_void_p, c_size_t]),
}


class Library:
    """A library with its functions, without the beginning of their names."""

    def __init__(self, path):
        library = ctypes.CDLL(str(path))
        for name, (result, arguments) in FUNCTIONS.items():
            function = getattr(library, f"gearmbs_{name}")
            function.restype, function.argtypes = result, arguments
            setattr(self, name, function)
        self.number_names = [self.number_name(k).decode() for k in range(self.numbers())]
        self.output_names = [self.output_name(k).decode() for k in range(self.outputs())]


class Instance:
    """An instance of a library; codes other than 0 are errors."""

    def __init__(self, library):
        self.library = library
        self.address = library.create()

    def __del__(self):
        self.library.free(self.address)

    def check(self, code):
        if code:
            raise RuntimeError(f"{code}: {self.library.message(code).decode()}")

    @property
    def t(self):
        return self.library.time(self.address)

    def set(self, name, value):
        self.check(self.library.set(self.address, self.library.number_names.index(name), value))

    def number(self, name):
        value = c_double()
        self.check(self.library.number(self.address, self.library.number_names.index(name), ctypes.byref(value)))
        return value.value

    def advance(self, t):
        self.check(self.library.advance(self.address, t))

    def outputs(self):
        out = np.empty(self.library.outputs())
        self.check(self.library.get(self.address, out.ctypes.data))
        return out

    def get(self, name):
        return self.outputs()[self.library.output_names.index(name)]

    def unknowns(self):
        """Unknowns and rates, shape (2, n)."""
        out = np.empty((2, self.library.unknowns()))
        self.check(self.library.get_unknowns(self.address, out[0].ctypes.data, out[1].ctypes.data))
        return out

    def save(self):
        state = ctypes.create_string_buffer(self.library.state_size())
        self.check(self.library.save(self.address, state))
        return state.raw

    def restore(self, state):
        self.check(self.library.restore(self.address, state, len(state)))

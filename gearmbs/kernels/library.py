"""LLVM code of kernels: parts that wait to be linked, and entries that are linked, optimised and made machine code.

A part is compiled once and holds its own function only; of the parts it calls it keeps the names. An entry is linked
from its own code and all parts below it, optimised as a whole, and becomes the only machine code there is.
"""

from __future__ import annotations

import functools
import pickle
import sys
from types import SimpleNamespace
from typing import Any

import llvmlite.binding as llvm
from numba.core import compiler, environment, serialize
from numba.core.codegen import JITCodeLibrary
from numba.core.registry import cpu_target
from numba.core.runtime import _nrt_python

from gearmbs.kernels import cache
from gearmbs.kernels.entries import Kept


class _Ready(JITCodeLibrary):
    """Machine code in this process, to which others refer by its symbols."""

    def _get_module_for_linking(self) -> Any:
        """Return nothing to link; whoever takes the address of an entry finds it where it is."""
        self._ensure_finalized()
        return llvm.parse_assembly(str(self._codegen._create_empty_module(self.name)))


class _Linked(JITCodeLibrary):
    """A library that links the parts below it by name."""

    def __init__(self, codegen: Any, name: str) -> None:
        super().__init__(codegen, name)
        self.parts: dict[str, PartLibrary] = {}
        self.lasting = True

    def add_linking_library(self, library: Any) -> None:
        """Note a part that is called; take in any other library as numba does."""
        if isinstance(library, PartLibrary):
            self.parts[library.file] = library
        else:
            # an address of an entry holds in this process only
            self.lasting &= not isinstance(library, _Ready) and getattr(library, "lasting", True)
            super().add_linking_library(library)

    def _optimize_functions(self, module: Any) -> None:
        """Simplify what a module defines; numba also sets up passes for each function that it declares."""
        module.data_layout = self._codegen._data_layout
        manager, passes = self._codegen._function_pass_manager()
        for function in module.functions:
            if not function.is_declaration:
                manager.run(function, passes)

    def _link_others(self) -> None:
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)


class PartLibrary(_Linked):
    """Code of a kernel for its callers: never optimised on its own, never machine code."""

    file = ""
    _shared_module: Any

    @staticmethod
    def customise(flags: Any) -> None:
        """Ask numba for the function alone, without wrappers."""
        flags.no_compile = True
        flags.no_cpython_wrapper = True
        flags.no_cfunc_wrapper = True

    def finalize(self) -> None:
        """Take in what numba itself provides, hidden, since numba names it by chance of the process."""
        self._raise_if_finalized()
        own = {f.name for f in self._final_module.functions if not f.is_declaration}
        self._link_others()
        for function in self._final_module.functions:
            if function.is_declaration or function.name in own:
                continue
            if function.name.startswith("_ZN"):
                function.linkage = llvm.Linkage.internal
        self._finalize_dynamic_globals()
        self._finalized = True

    def close(self, name: str) -> None:
        """Finish the module: its function may stand in several entries."""
        self._final_module.get_function(name).linkage = llvm.Linkage.linkonce_odr

    def _get_module_for_linking(self) -> Any:
        """Return the part with all below it, for a caller that is compiled by numba alone."""
        if self._shared_module is None:
            self._shared_module = self._final_module.clone()
            for part in reversed(_below(self.parts)):
                self._shared_module.link_in(part._final_module, preserve=True)
        return self._shared_module

    @staticmethod
    def made(compiled: Any, file: str) -> SimpleNamespace:
        """Return the part of a compile result, to be known by the name of its file."""
        library = compiled.library
        library.file = file
        library._ensure_finalized()
        library.close(compiled.fndesc.llvm_func_name)
        fndesc = compiled.fndesc
        fndesc.typemap = fndesc.calltypes = None
        environments = {
            id(e): e for e in (compiled.environment, *_environments(library._final_module)) if e.can_cache()
        }
        return SimpleNamespace(
            key=object(),
            library=library,
            fndesc=fndesc,
            signature=compiled.signature,
            environments=list(environments.values()),
            reload_init=list(library._reload_init),
            origins=tuple(sorted(compiled.metadata["origins"].returned)),
        )

    @staticmethod
    def reduce(part: SimpleNamespace) -> tuple | None:
        """Return what a part is rebuilt from, or None if it cannot be kept."""
        library = part.library
        if library.has_dynamic_globals or not library.lasting:
            return None
        code = library._final_module.as_bitcode()
        environments = [_kept(e) for e in part.environments]
        return code, part.fndesc, part.signature, environments, part.reload_init, tuple(library.parts), part.origins

    @staticmethod
    def rebuild(package: str, file: str, payload: tuple) -> SimpleNamespace | None:
        """Return a part from what was kept of it; None if a part below it is gone."""
        code, fndesc, signature, environments, reload_init, parts, origins = payload
        target = cpu_target.target_context
        for function in reload_init:
            function()
        target.refresh()
        library = PartLibrary(target.codegen(), fndesc.qualname)
        library.file = file
        for name in parts:
            below = cache.loaded_part(name, package, PartLibrary.rebuild)
            if below is None:
                return None
            library.parts[name] = below.library
        library._final_module = llvm.parse_bitcode(code)
        library._reload_init.update(reload_init)
        library._finalized = True
        return SimpleNamespace(
            key=object(),
            library=library,
            fndesc=fndesc,
            signature=signature,
            environments=[_environment(*e) for e in environments],
            reload_init=reload_init,
            origins=origins,
        )


class EntryLibrary(_Linked, _Ready):
    """Machine code of a kernel and all below it, with a wrapper for Python and one for C."""

    @staticmethod
    def customise(flags: Any) -> None:
        """Leave numba's flags as they are."""

    def finalize(self) -> None:
        """Link, optimise and compile."""
        self._codegen._check_llvm_bugs()
        self._raise_if_finalized()
        self._link_others()
        # callers before callees: the linker leaves out what nobody has asked for yet
        for part in reversed(_below(self.parts)):
            self._reload_init.update(part._reload_init)
            self._final_module.link_in(part._final_module, preserve=True)
        names = (f.name for f in self._final_module.functions if f.is_declaration and f.name.startswith("_ZN"))
        missing = [name for name in names if not self._codegen._engine.is_symbol_defined(name)]
        if missing:
            raise RuntimeError(f"kernel {self.name} cannot be linked: {', '.join(missing)} is missing")
        self._optimize_final_module()
        self._final_module.verify()
        self._finalize_final_module()

    @staticmethod
    def reduce(compiled: Any) -> tuple | None:
        """Return what an entry is rebuilt from, or None if it cannot be kept."""
        library = compiled.library
        if library.has_dynamic_globals or not library.lasting:
            return None
        fndesc = compiled.fndesc
        fndesc.typemap = fndesc.calltypes = None
        environments = [_kept(e) for e in _environments(library._final_module) if e.can_cache()]
        defined = [
            value.name
            for values in (library._final_module.functions, library._final_module.global_variables)
            for value in values
            if not value.is_declaration and value.linkage == llvm.Linkage.external
        ]
        own = compiled.environment
        rest = (fndesc, compiled.signature, compiled.reload_init, defined, [_kept(own), *environments])
        kept = {symbol: (module, constants, symbol) for module, constants, symbol in rest[-1]}
        return tuple(
            Kept(
                library._get_compiled_object(),
                fndesc.llvm_func_name,
                fndesc.llvm_cpython_wrapper_name,
                fndesc.qualname.split(".")[-1],
                own.env_name,
                list(kept.values()),
                not compiled.reload_init,
                serialize.dumps(rest),
            )
        )

    @staticmethod
    def rebuild(package: str, file: str, payload: tuple) -> Any:
        """Return a compile result from what was kept of it; only machine code is loaded."""
        code, rest = payload[0], payload[-1]
        fndesc, signature, reload_init, defined, (own, *environments) = pickle.loads(rest)
        target = cpu_target.target_context
        for function in reload_init:
            function()
        _name_helpers()
        codegen = target.codegen()
        library = _Ready(codegen, fndesc.qualname)
        library.enable_object_caching()
        library._set_compiled_object(code)
        library._finalize_final_module()
        codegen._engine._defined_symbols.update(defined)
        environments = [_environment(*e) for e in environments]
        own = _environment(*own)
        entry = target.get_executable(library, fndesc, own)
        for other in environments:
            codegen.set_env(other.env_name, other)
        return compiler.CompileResult(
            typing_context=target.typing_context,
            target_context=target,
            library=library,
            environment=own,
            entry_point=entry,
            fndesc=fndesc,
            type_annotation="",
            signature=signature,
            objectmode=False,
            lifted=(),
            typing_error=None,
            call_helper=None,
            metadata=None,
            reload_init=reload_init,
            referenced_envs=tuple(environments),
        )


@functools.cache
def _name_helpers() -> None:
    """Let machine code find what numba's runtime has in C; its own copies of the rest are linked into each entry.

    ``rtsys.initialize``, which numba calls itself before it compiles anything, also compiles that rest.
    """
    for name, where in _nrt_python.c_helpers.items():
        llvm.add_symbol(name if name.startswith("_") else f"NRT_{name}", where)


def _below(parts: dict[str, PartLibrary], seen: dict[str, PartLibrary] | None = None) -> list[PartLibrary]:
    """Return parts and all that they call, callees before callers."""
    seen = {} if seen is None else seen
    out = []
    for file, part in parts.items():
        if file not in seen:
            seen[file] = part
            out += [*_below(part.parts, seen), part]
    return out


def _kept(env: Any) -> tuple:
    """Return what an environment is rebuilt from."""
    return env.globals.get("__name__"), list(env.consts), env.env_name


def _environment(module: str, constants: list, name: str) -> Any:
    """Return an environment; the module it belongs to, often one of numba's, is not imported for its sake.

    Compiled code takes constants from it, for its exceptions; only numba's object mode looks at the module.
    """
    found = environment.lookup_environment(name)
    if found is None:
        home = sys.modules.get(module)
        found = environment.Environment({"__name__": module} if home is None else vars(home))
        found.consts[:] = constants
        found.env_name = name
        environment.Environment._memo[name] = found
    return found


def _environments(module: Any) -> list:
    """Return the environments, of functions compiled in this process, that a module refers to."""
    names = (value.name for value in module.global_variables)
    found = (environment.lookup_environment(name) for name in names if name.startswith("_ZN08NumbaEnv"))
    return [env for env in found if env is not None]

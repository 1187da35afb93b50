"""Kernels as object files that a linker takes: for libraries which run without Python.

The code of an object is that of the kernel's entry, linked and optimised in the same way, but without the wrappers for
Python, independent of where it is loaded, and for a processor that is named.
"""

from __future__ import annotations

import re
from typing import Any, NamedTuple

import llvmlite.binding as llvm
from numba.core.compiler_lock import global_compiler_lock

from gearmbs.kernels import cache
from gearmbs.kernels.library import EntryLibrary

NATIVE = "native"
"""The processor of this machine."""
KIND = "object"
"""End of the names of files in which objects are kept."""


class Object(NamedTuple):
    """A compiled kernel.

    Attributes
    ----------
    symbol : str
        Name of its function. It returns 0, or a number of numba's where an exception of Python would be raised, and
        takes the address of its result, the address of a pointer to an exception, then the arguments.
    code : bytes
        Object file.
    late : tuple of str
        Late kernels that it may look for, as ``module:name``.
    """

    symbol: str
    code: bytes
    late: tuple[str, ...]


class _ObjectLibrary(EntryLibrary):
    """A kernel and all below it, linked and optimised, that does not become machine code of this process."""

    @staticmethod
    def customise(flags: Any) -> None:
        """Ask numba not to look for the machine code."""
        flags.no_compile = True

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


def compiled_object(kernel: Any, processor: str = NATIVE, signature: Any = None) -> Object:
    """Return the object of a kernel, which is kept beside its entry.

    Parameters
    ----------
    kernel : Kernel
    processor : str
        A name of LLVM's, as "x86-64-v3", or `NATIVE`.
    signature : signature, optional
        Result and arguments of a kernel that has declared none.

    Raises
    ------
    ValueError
        If the code holds addresses of this process.
    """
    args, result = (signature.args, signature.return_type) if signature is not None else kernel.declared_types()
    ending = KIND + re.sub(r"[^a-z0-9]", "_", f"_{processor}")
    with global_compiler_lock:
        found = cache.load(kernel, ending, args, _rebuilt)
        if found is None:
            with cache.compiling(kernel, ending, args) as slot:
                found = slot.load(_rebuilt)
                if found is None:
                    found = _made(kernel, processor, args, result, slot.name)
                    slot.save(tuple(found))
    return found


def _rebuilt(target: Any, package: str, file: str, payload: tuple) -> Object:
    return Object(*payload)


def _made(kernel: Any, processor: str, args: tuple, result: Any, name: str) -> Object:
    compiled = kernel._compile(_ObjectLibrary, args, result, name)
    library = compiled.library
    library._ensure_finalized()
    if library.has_dynamic_globals or not library.lasting:
        raise ValueError(f"kernel {kernel.__name__} holds addresses of this process and cannot be exported")
    module, own = library._final_module, compiled.fndesc.llvm_func_name
    for value in [*module.functions, *module.global_variables]:
        if not value.is_declaration:
            value.linkage = llvm.Linkage.external if value.name == own else llvm.Linkage.internal
    symbol = f"gearmbs_kernel_{kernel.__name__.strip('_')}_{name}"
    function = module.get_function(own)
    function.name, function.visibility = symbol, llvm.Visibility.hidden
    machine = _machine(library._codegen, processor)
    builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options())
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.run(module, builder)
    return Object(symbol, machine.emit_object(module), _late_names(module))


def _late_names(module: Any) -> tuple[str, ...]:
    """Return the names of the late kernels that a module may look for, see `gearmbs.kernels.late`."""
    return tuple(sorted(set(re.findall(r'c"([\w.]+:\w+)\\00"', str(module)))))


def _machine(codegen: Any, processor: str) -> Any:
    """Return what makes objects for a processor, to be placed anywhere."""
    name, features = (codegen._get_host_cpu_name(), codegen._tm_features) if processor == NATIVE else (processor, "")
    target = llvm.Target.from_triple(llvm.get_process_triple())
    return target.create_target_machine(cpu=name, features=features, opt=3, reloc="pic", codemodel="default")

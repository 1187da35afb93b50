"""Kernels as object files that a linker takes: for libraries which run without Python.

The code of an object is that of the kernel's entry, linked and optimised in the same way, but without the wrappers for
Python, independent of where it is loaded, and for a processor that is named.
"""

from __future__ import annotations

import re
import subprocess
import sys
from typing import Any, NamedTuple

import llvmlite.binding as llvm
from numba.core import compiler
from numba.core.compiler_lock import global_compiler_lock

from gearmbs.kernels import cache
from gearmbs.kernels.kinds import numba_of
from gearmbs.kernels.library import EntryLibrary

NATIVE = "native"
"""The processor of this machine."""
KIND = "object"
"""End of the names of files in which objects are kept."""


ANSWERED = frozenset(
    "PyErr_SetString PyImport_ImportModule PyLong_AsVoidPtr PyObject_CallFunctionObjArgs PyObject_GetAttrString "
    "PyObject_Hash PyTuple_Pack PyUnicode_FromKindAndData Py_DecRef".split()
)
"""Functions of Python that a library has stand-ins for (``gearmbs/native/source/runtime.c``): of exceptions."""


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


def compiled_object(kernel: Any, processor: str = NATIVE, signature: Any = None, triple: str = "") -> Object:
    """Return the object of a kernel, which is kept beside its entry.

    Parameters
    ----------
    kernel : Kernel
    processor : str
        A name of LLVM's, as "x86-64-v3", or `NATIVE`.
    signature : signature, optional
        Result and arguments of a kernel that has declared none.
    triple : str
        A system by its name of LLVM's; default: the one this is.

    Raises
    ------
    ValueError
        If the code holds addresses of this process.
    """
    args, result = _types(kernel, signature)
    ending = _ending(processor, triple)
    with global_compiler_lock:
        found = cache.load(kernel, ending, args, _rebuilt)
        if found is None:
            with cache.compiling(kernel, ending, args) as slot:
                found = slot.load(_rebuilt)
                if found is None:
                    found = _made(kernel, processor, triple, args, result, slot.name)
                    slot.save(tuple(found))
    return found


def file_of_object(kernel: Any, processor: str = NATIVE, signature: Any = None) -> str:
    """Return the name of the file of an object; arguments as of `compiled_object`."""
    return cache.file_name(kernel, _ending(processor), _types(kernel, signature)[0])


def _types(kernel: Any, signature: Any) -> tuple[tuple, Any]:
    """Return the types of a kernel's arguments, and of its result."""
    return (tuple(signature.args), signature.return_type) if signature is not None else kernel.declared_types()


def _ending(processor: str, triple: str = "") -> str:
    """Return the end of the name of a file."""
    told = f"_{processor}_{triple}" if triple else f"_{processor}"
    return KIND + re.sub(r"[^a-z0-9]", "_", told)


def _rebuilt(package: str, file: str, payload: tuple) -> Object:
    return Object(*payload)


def object_of_function(function: Any, processor: str, signature: Any, name: str, triple: str = "") -> Object:
    """Return the object of a function of `numba.njit`, compiled anew: it is a user's, and kept nowhere.

    Parameters
    ----------
    function : dispatcher of numba's
    processor : str
        As of `compiled_object`.
    signature : signature
    name : str
        What its symbol ends with, another one for each function of a library.
    triple : str
        As of `compiled_object`.

    Raises
    ------
    ValueError
        If the code holds addresses of this process, or calls Python.
    """
    with global_compiler_lock:
        flags = compiler.Flags()
        function.targetdescr.options.parse_as_flags(flags, function.targetoptions)
        _ObjectLibrary.customise(flags)
        target = function.targetctx
        code = _ObjectLibrary(target.codegen(), function.py_func.__qualname__)
        code.enable_object_caching()
        wanted = numba_of(signature)
        args, result = tuple(wanted.args), wanted.return_type
        compiled = compiler.compile_extra(
            function.typingctx, target, function.py_func, args, result, flags, {}, code, compiler.Compiler
        )
        return _emitted(function, compiled, processor, triple, name)


def _made(kernel: Any, processor: str, triple: str, args: tuple, result: Any, name: str) -> Object:
    return _emitted(kernel, kernel._compile(_ObjectLibrary, args, result, name), processor, triple, name)


def _emitted(kernel: Any, compiled: Any, processor: str, triple: str, name: str) -> Object:
    """Return the object of a compile result."""
    library = compiled.library
    library._ensure_finalized()
    if library.has_dynamic_globals or not library.lasting:
        raise ValueError(
            f"function {kernel.__name__!r} holds addresses of this process, as of a function of C; it cannot be "
            "exported: hand over numbers as parameters, and call compiled functions alone"
        )
    module, own = library._final_module, compiled.fndesc.llvm_func_name
    for value in [*module.functions, *module.global_variables]:
        if not value.is_declaration:
            value.linkage = llvm.Linkage.external if value.name == own else llvm.Linkage.internal
    symbol = f"gearmbs_kernel_{kernel.__name__.strip('_')}_{name}"
    function = module.get_function(own)
    function.name, function.visibility = symbol, llvm.Visibility.hidden
    machine = _machine(library._codegen, processor, triple)
    if triple:
        module = _brought_to(module, triple, machine)
    builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options())
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.run(module, builder)
    asked = {one.name for one in module.functions if one.is_declaration and one.name.startswith("Py")} - ANSWERED
    if asked:
        raise ValueError(
            f"function {kernel.__name__!r} calls Python ({', '.join(sorted(asked))}), as print does; it cannot be "
            "exported: leave out what is not compiled"
        )
    return Object(symbol, machine.emit_object(module), _late_names(module))


_COUNTED = "@llvm.x86.atomic.sub.cc.i64"
"""What LLVM has made of counting references, in numba's own runtime, when it compiled that for this process."""
_COUNTED_ANYWHERE = """
define internal i8 @gearmbs_counted_down(ptr %place, i64 %by, i32 %what) {
  %before = atomicrmw sub ptr %place, i64 %by monotonic
  %zero = icmp eq i64 %before, %by
  %told = zext i1 %zero to i8
  ret i8 %told
}
"""
"""The same for any processor: count down, tell whether nothing is left (condition 4)."""


def _brought_to(module: Any, triple: str, machine: Any) -> Any:
    """Return a module for another system, without what is of the processors that this one is of."""
    text = "" if triple.startswith("x86_64") else str(module)
    if _COUNTED in text:
        text = re.sub(rf"^declare .*{re.escape(_COUNTED)}\(.*$", _COUNTED_ANYWHERE, text, flags=re.MULTILINE)
        text = text.replace(_COUNTED, "@gearmbs_counted_down")
        # symbols of numba's tell all types
        llvm.set_option("gearmbs", "-non-global-value-max-name-size=1000000")
        made = llvm.parse_assembly(text)
    else:
        made = llvm.parse_bitcode(module.as_bitcode())
    made.triple, made.data_layout = triple, str(machine.target_data)
    return made


def _late_names(module: Any) -> tuple[str, ...]:
    """Return the names of the late kernels that a module may look for, see `gearmbs.kernels.own.late`."""
    return tuple(sorted(set(re.findall(r'c"([\w.]+:\w+)\\00"', str(module)))))


def _machine(codegen: Any, processor: str, triple: str) -> Any:
    """Return what makes objects for a processor and a system, to be placed anywhere."""
    name, features = (codegen._get_host_cpu_name(), codegen._tm_features) if processor == NATIVE else (processor, "")
    if triple:
        llvm.initialize_all_targets()
        llvm.initialize_all_asmprinters()
    target = llvm.Target.from_triple(triple or llvm.get_process_triple())
    return target.create_target_machine(cpu=name, features=features, opt=3, reloc="pic", codemodel="default")


_ASK = """
import sys
import llvmlite.binding as llvm
llvm.initialize_all_targets()
llvm.initialize_all_asmprinters()
triple = sys.argv[1] or llvm.get_process_triple()
machine = llvm.Target.from_triple(triple).create_target_machine(cpu=sys.argv[2])
module = llvm.parse_assembly("define double @f(double %x) { ret double %x }")
module.triple = triple
machine.emit_object(module)
"""
"""Of a processor that it does not know LLVM writes so and takes another, or ends the process: not this one."""


def processors(triple: str) -> list[str]:
    """Return the names that LLVM has for processors of a system's kind, those of others of its family among them."""
    return re.findall(r"^  (\S+) +- Select the", _asked(triple, "help").stderr, re.MULTILINE)


def is_processor(triple: str, name: str) -> bool:
    """Return whether a name is that of a processor of a system's kind."""
    done = _asked(triple, name)
    return not done.returncode and "not a recognized processor" not in done.stderr


def _asked(triple: str, processor: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", _ASK, triple, processor]
    return subprocess.run(command, capture_output=True, text=True, check=False)

"""How kernels are compiled: two decorators, and a cache folder that changes with the source.

Numba's own cache checks only the file of the kernel. It would keep an old kernel if a called function in another file changes. Here the
name of the folder is a hash of all files with kernels, so this cannot happen.
"""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import llvmlite.binding
import numba
import numba.core.config
import numba.np.arrayobj
from llvmlite import ir
from numba import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.extending import intrinsic

from .. import cache
from . import kept


def source_key(package: Path) -> str:
    """16 hexadecimal digits: a hash of the sources of kernels in `package`, of `scene`, and of the tables of numbers (.npz)."""
    digest = hashlib.sha256()
    for file in sorted(package.rglob("*")):
        if file.suffix == ".npz" or (file.suffix == ".py" and (file.parent.name in ("kernels", "scene", "tracing") or _has_kernels(file))):
            digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def _has_kernels(file: Path) -> bool:
    source = file.read_bytes()
    return b"kernels import" in source or b"import numba" in source


# With NUMBA_BOUNDSCHECK=1 kernels check every index and raise IndexError. This finds faults; rendering has 0.6 of the speed.
CHECKED = bool(getattr(numba.core.config, "BOUNDSCHECK"))  # noqa: B009  # unknown to the type checker
_FOLDER = cache.folder("kernels", source_key(Path(__file__).parents[1]) + ("-checked" if CHECKED else ""))
if _FOLDER:
    kept.sweep(_FOLDER)

# LLVM inlines functions that are shorter than a limit. In this program short functions call each other in long chains. With LLVM's
# default limit, 225, calls take a fifth of the rendering time. Checked kernels are not inlined: each index adds an exit, and with
# inlining they did not compile within ten minutes.
llvmlite.binding.set_option("blender_rl_guiding", f"-inline-threshold={0 if CHECKED else 5000}")


def _counted_from_the_front(context, builder, kind, index, size):
    """The index unchanged. Numba would turn -1 into the last place before the check."""
    return context.cast(builder, index, kind, types.intp if kind.signed else types.uintp)


if CHECKED:
    setattr(numba.np.arrayobj, "fix_integer_index", _counted_from_the_front)  # noqa: B010


class _PartLibrary(JITCodeLibrary):
    """Code that is only linked into kernels, and is optimised there. Optimising at each level of calls would take twice the time."""

    def _optimize_final_module(self) -> None: ...

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """0, because there is no machine code."""
        return 0

    @property
    def codegen(self) -> Any:
        """The object whose `set_env` Numba calls."""
        return self

    def set_env(self, name: str, env: Any) -> None:
        """Do nothing: Numba sets the environment of the kernel."""


class _PartCompiler(Compiler):
    def _compile_core(self) -> Any:
        self.state.library = _PartLibrary(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        return super()._compile_core()


# Not full fastmath, for two reasons. It may order sums in a vectorised loop differently from the remainder of the loop, so a path's value
# would depend on its place in the batch. And it assumes that there are no NaNs, but the film checks for NaNs.
# `_nrt` False: references are not counted. Kernels make no arrays, and counting would add a call for each array in each call.
_options: Any = {"_nrt": False, "nogil": True, "error_model": "numpy", "fastmath": {"contract", "nsz", "arcp"}, "no_cfunc_wrapper": True}


def kernel(function: Callable[..., Any]) -> Any:
    """Decorator of a function that Python calls. Numba compiles it with all functions that it calls; `kept` stores it on disk."""
    compiled: Any = numba.njit(**_options)(function)
    if _FOLDER:
        compiled._cache = kept.Kept(_FOLDER, function)
    return compiled


# Decorator of a function that only kernels call. It is compiled into the kernels, without a wrapper or a file of its own.
part = numba.njit(pipeline_class=_PartCompiler, **(_options | {"no_cpython_wrapper": True}))
# Like `part`, for a function that returns a view of an array: without reference counts, Numba must inline it into its caller.
merged = numba.njit(pipeline_class=_PartCompiler, inline="always", **(_options | {"no_cpython_wrapper": True}))


@intrinsic
def _unlikely(typingctx, condition):
    """The condition, expected to be false: LLVM places the code for true apart from the rest."""

    def codegen(context, builder, signature, args):
        bit = ir.IntType(1)
        expect = builder.module.declare_intrinsic("llvm.expect", [bit], ir.FunctionType(bit, [bit, bit]))
        return builder.call(expect, [args[0], ir.Constant(bit, 0)])

    return types.boolean(types.boolean), codegen


# Declared as Any, because type checkers count `typingctx` as an argument of each call.
unlikely: Any = _unlikely

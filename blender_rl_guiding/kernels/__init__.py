"""How kernels are compiled: two decorators, and a cache folder that changes with the source.

Numba's own cache looks only at the file a function stands in, so a kernel would go stale when a function it calls in another
file changes. Keying the folder by every file that goes into kernels makes that impossible.
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
    """16 hexadecimal digits that change with the sources of kernels below `package`, the scene's constants, and tables of numbers."""
    digest = hashlib.sha256()
    for file in sorted(package.rglob("*")):
        if file.suffix == ".npz" or (file.suffix == ".py" and (file.parent.name in ("kernels", "scene", "tracing") or _has_kernels(file))):
            digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def _has_kernels(file: Path) -> bool:
    source = file.read_bytes()
    return b"kernels import" in source or b"import numba" in source


# With NUMBA_BOUNDSCHECK=1 kernels compare every index with its array, and raise IndexError: for hunting faults, at 0.6 of the speed.
CHECKED = bool(getattr(numba.core.config, "BOUNDSCHECK"))  # noqa: B009  # unknown to the type checker
_FOLDER = cache.folder("kernels", source_key(Path(__file__).parents[1]) + ("-checked" if CHECKED else ""))
if _FOLDER:
    kept.sweep(_FOLDER)

# LLVM inlines functions up to a limit of length. Here short functions call each other in long chains: with its own limit of 225, a
# fifth of the rendering is calling. Checked kernels have a way out at every index: inlined, they did not compile in ten minutes, so
# they call.
llvmlite.binding.set_option("blender_rl_guiding", f"-inline-threshold={0 if CHECKED else 5000}")


def _counted_from_the_front(context, builder, kind, index, size):
    """The index as it is. Numba would turn -1 into the last place before the check."""
    return context.cast(builder, index, kind, types.intp if kind.signed else types.uintp)


if CHECKED:
    setattr(numba.np.arrayobj, "fix_integer_index", _counted_from_the_front)  # noqa: B010


class _PartLibrary(JITCodeLibrary):
    """Code that is only linked into kernels, and optimised there: optimising it at each level of calls takes twice the time."""

    def _optimize_final_module(self) -> None: ...

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """0: there is no machine code."""
        return 0

    @property
    def codegen(self) -> Any:
        """The object whose `set_env` Numba calls."""
        return self

    def set_env(self, name: str, env: Any) -> None:
        """Set nothing: the kernel's is set."""


class _PartCompiler(Compiler):
    def _compile_core(self) -> Any:
        self.state.library = _PartLibrary(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        return super()._compile_core()


# Not full fastmath: it may reorder sums differently in a vectorised loop and in its remainder. A path's value would then depend on its
# place in the batch. It also assumes that there are no NaNs, and the film looks for them.
# References are not counted (`_nrt`): kernels make no arrays, and counting would be a call for each array at each call.
_options: Any = {"_nrt": False, "nogil": True, "error_model": "numpy", "fastmath": {"contract", "nsz", "arcp"}, "no_cfunc_wrapper": True}


def kernel(function: Callable[..., Any]) -> Any:
    """Decorator of a function that Python calls: compiled with all that it calls, and kept on disk."""
    compiled: Any = numba.njit(**_options)(function)
    if _FOLDER:
        compiled._cache = kept.Kept(_FOLDER, function)
    return compiled


# Decorator of a function that only kernels call: compiled into them, without a wrapper or a file of its own.
part = numba.njit(pipeline_class=_PartCompiler, **(_options | {"no_cpython_wrapper": True}))
# The same for a part that returns a view of an array: without reference counts it has to be inlined into its caller.
merged = numba.njit(pipeline_class=_PartCompiler, inline="always", **(_options | {"no_cpython_wrapper": True}))


@intrinsic
def _unlikely(typingctx, condition):
    """The condition, expected to be false: LLVM moves the code for true out of the way of all else."""

    def codegen(context, builder, signature, args):
        bit = ir.IntType(1)
        expect = builder.module.declare_intrinsic("llvm.expect", [bit], ir.FunctionType(bit, [bit, bit]))
        return builder.call(expect, [args[0], ir.Constant(bit, 0)])

    return types.boolean(types.boolean), codegen


# Declared, because type checkers take the typing context for an argument of the call.
unlikely: Any = _unlikely

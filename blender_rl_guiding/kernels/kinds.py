"""Calls that Numba resolves when it compiles them, by the kind of the first argument: a class of named tuples.

The choice costs nothing at run time, and a kernel that is compiled for one kind holds no code of the others.
"""

from typing import Any

from .pointers import Ref


def call_by_kind(typingctx: Any, parts: dict[type, Any], arguments: tuple[Any, ...]) -> tuple[Any, Any]:
    """What an intrinsic returns that calls `parts[kind]` with its own arguments: the signature, and the maker of code."""
    first = arguments[0]
    kind = (first.pointee if isinstance(first, Ref) else first).instance_class
    part = typingctx.resolve_value_type(parts[kind])
    signature = typingctx.resolve_function_type(part, arguments, {})

    def codegen(context, builder, called, values):
        return context.get_function(part, signature)(builder, values)

    return signature, codegen

"""Calls that Numba resolves at compile time, by the kind of the first argument. A kind is a class of named tuples.

The choice costs no run time. A kernel compiled for one kind has no code of the other kinds.
"""

from typing import Any

from numba import types

from .pointers import Ref


def constant_by_kind(numbers: dict[type, int], first: Any) -> tuple[Any, Any]:
    """Signature and code of an intrinsic whose value is `numbers[kind]`, an int64."""

    def codegen(context, builder, called, values):
        return context.get_constant(types.int64, numbers[_kind(first)])

    return types.int64(first), codegen


def call_by_kind(typingctx: Any, parts: dict[type, Any], arguments: tuple[Any, ...]) -> tuple[Any, Any]:
    """Signature and code of an intrinsic that calls `parts[kind]` with the intrinsic's arguments."""
    part = typingctx.resolve_value_type(parts[_kind(arguments[0])])
    signature = typingctx.resolve_function_type(part, arguments, {})

    def codegen(context, builder, called, values):
        return context.get_function(part, signature)(builder, values)

    return signature, codegen


def _kind(argument: Any) -> type:
    named: Any = argument.pointee if isinstance(argument, Ref) else argument
    return named.instance_class

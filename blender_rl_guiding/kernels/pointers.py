"""Passes named tuples to kernels by reference.

Numba passes each number of a tuple as one argument, and each array as nine. With a whole scene as a tuple, compiling took three times as
long. `ref(x)` stores a named tuple in memory and passes its address. Fields are read as before, `r.field`; a field that is a named tuple
gives a reference again. Arrays read through a reference are not reference-counted, so threads do not contend for the counts.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel import models
from numba.core.typing.templates import AttributeTemplate
from numba.extending import infer_getattr, intrinsic, lower_getattr_generic, register_model


class Ref(types.Type):
    """The address of a named tuple that lives until the kernel that made it returns."""

    def __init__(self, pointee: types.BaseNamedTuple) -> None:
        self.pointee = pointee
        super().__init__(f"Ref({pointee})")


@register_model(Ref)
class _RefModel(models.PrimitiveModel):
    def __init__(self, dmm, fe_type) -> None:
        super().__init__(dmm, fe_type, dmm.lookup(fe_type.pointee).get_value_type().as_pointer())


@intrinsic
def _ref(typingctx, value):
    """The address of a named tuple; a Ref stays as it is."""
    if isinstance(value, Ref):
        return value(value), lambda context, builder, signature, args: args[0]

    def codegen(context, builder, signature, args):
        place = cgutils.alloca_once(builder, args[0].type)
        builder.store(args[0], place)
        return place

    return Ref(value)(value), codegen


# Declared as Any, because type checkers count `typingctx` as an argument of each call.
ref: Any = _ref


@infer_getattr
class _RefFields(AttributeTemplate):
    key = Ref

    def generic_resolve(self, typ, attr):
        if attr not in typ.pointee.fields:
            return None
        field = typ.pointee[typ.pointee.fields.index(attr)]
        return Ref(field) if isinstance(field, types.BaseNamedTuple) else field


@lower_getattr_generic(Ref)
def _field(context, builder, typ, value, attr):
    index = typ.pointee.fields.index(attr)
    field = typ.pointee[index]
    place = cgutils.gep_inbounds(builder, value, 0, index)
    if isinstance(field, types.BaseNamedTuple):
        return place
    return _borrowed(context, builder, field, place) if isinstance(field, types.Array) else builder.load(place)


def _borrowed(context, builder, field, place):
    """The array at an address. Loads of its members are marked invariant; otherwise LLVM repeats them after every store to an array."""
    array = context.make_array(field)(context, builder)
    for index, name in enumerate(array._datamodel._fields):
        if name not in ("meminfo", "parent"):
            setattr(array, name, _constant_load(builder, cgutils.gep_inbounds(builder, place, 0, index)))
    array.meminfo = cgutils.get_null_value(array.meminfo.type)
    array.parent = cgutils.get_null_value(array.parent.type)
    return array._getvalue()


def _constant_load(builder, place):
    kind = place.type.pointee
    if isinstance(kind, ir.ArrayType):
        parts = [_constant_load(builder, cgutils.gep_inbounds(builder, place, 0, k)) for k in range(kind.count)]
        return cgutils.pack_array(builder, parts)
    loaded = builder.load(place)
    loaded.set_metadata("invariant.load", builder.module.add_metadata([]))
    return loaded

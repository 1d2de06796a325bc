"""Registering modules, and groups of properties, in order, as `bpy.utils.register_classes_factory` does it for classes."""

from collections.abc import Callable, Sequence
from types import ModuleType

import bpy

Both = tuple[Callable[[], None], Callable[[], None]]  # the functions `register` and `unregister`


def registering(modules: Sequence[ModuleType]) -> Both:
    """`register` calls that of each module, `unregister` that of each in reverse."""

    def register() -> None:
        for module in modules:
            module.register()

    def unregister() -> None:
        for module in reversed(modules):
            module.unregister()

    return register, unregister


def holding(owner: type, name: str, classes: Sequence[type], label: str) -> Both:
    """`register` registers the classes, and adds a property of the last class to each `owner` under that name; `unregister` undoes this."""
    register_classes, unregister_classes = bpy.utils.register_classes_factory(classes)

    def register() -> None:
        register_classes()
        setattr(owner, name, bpy.props.PointerProperty(type=classes[-1], name=label))

    def unregister() -> None:
        delattr(owner, name)
        unregister_classes()

    return register, unregister

"""Registering modules in order, as `bpy.utils.register_classes_factory` does it for classes."""

from collections.abc import Callable, Sequence
from types import ModuleType


def registering(modules: Sequence[ModuleType]) -> tuple[Callable[[], None], Callable[[], None]]:
    """`register` calls that of each module, `unregister` that of each in reverse."""

    def register() -> None:
        for module in modules:
            module.register()

    def unregister() -> None:
        for module in reversed(modules):
            module.unregister()

    return register, unregister

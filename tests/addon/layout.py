"""A stand-in for Blender's layout: lists what panels draw, and raises where Blender would."""

from types import SimpleNamespace
from typing import Any

import bpy


class Layout:
    """A layout that lists all drawn items in order, also those in rows, columns and boxes."""

    def __init__(self, drawn: list | None = None, parent: "Layout | None" = None) -> None:
        self.drawn: list[SimpleNamespace] = [] if drawn is None else drawn
        self.active = parent.active if parent else True
        self.use_property_split = self.use_property_decorate = False
        self.alignment = self.emboss = self.operator_context = ""

    def _inside(self, **_: Any) -> "Layout":
        return Layout(self.drawn, self)

    row = column = box = split = _inside

    def panel(self, idname: str, default_closed: bool = False) -> "tuple[Layout, Layout]":
        """(header, body). No panel is closed."""
        return self._inside(), self._inside()

    def prop(self, owner: bpy.types.bpy_struct, name: str, **_: Any) -> None:
        assert name in owner.bl_rna.properties, name
        self.drawn.append(SimpleNamespace(kind="prop", owner=owner, name=name, active=self.active))

    def label(self, text: str = "", **_: Any) -> None:
        self.drawn.append(SimpleNamespace(kind="label", text=text))

    def operator(self, name: str, text: str = "", **_: Any) -> SimpleNamespace:
        self.drawn.append(SimpleNamespace(kind="operator", operator=name, text=text, options=SimpleNamespace()))
        return self.drawn[-1].options

    def separator(self) -> None:
        pass

    def template_list(self, kind: str, _: str, owner: Any, items: str, *rest: Any, rows: int) -> None:
        self.drawn.append(SimpleNamespace(kind="list", items=[*getattr(owner, items)]))

    def template_node_view(self, tree: bpy.types.NodeTree, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> None:
        self.drawn.append(SimpleNamespace(kind="node", node=node, socket=socket))

    @property
    def names(self) -> list[str]:
        """The names of drawn properties."""
        return [one.name for one in self.drawn if one.kind == "prop"]

    @property
    def texts(self) -> list[str]:
        """The texts of drawn labels and operators."""
        return [one.text for one in self.drawn if one.kind in ("label", "operator")]


def context(scene: bpy.types.Scene, engine: str = "RL_GUIDED", **more: Any) -> SimpleNamespace:
    """A context with the attributes that panels read."""
    common = {"preferences": SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)), "region": SimpleNamespace(width=400)}
    return SimpleNamespace(scene=scene, engine=engine, window_manager=bpy.context.window_manager, **common | more)


def drawn(panel: type, where: SimpleNamespace) -> Layout:
    """The layout that a registered panel draws. The panel's `poll` must accept the context."""
    assert panel.poll(where)
    layout = Layout()
    panel.draw(SimpleNamespace(layout=layout, **{name: value for name, value in vars(panel).items() if not name.startswith("_")}), where)
    return layout

"""The shape of the Q network, below its settings."""

import bpy

from blender_rl_guiding.settings import DQN

_MOST = 6  # numbers in a row that fit into a panel of the usual width


def draw_network(layout: bpy.types.UILayout, settings: DQN, context: bpy.types.Context) -> None:
    """What each network reads and what its layers yield, last the patches; below, how many parameters there are, and the table's size."""
    own = settings.encoder.layers_of_its_own()
    encoder = [f"encoder {' → '.join(map(str, own))}"] if own else []
    box = layout.box().column(align=True)
    for text in (*encoder, " → ".join(abridged(settings.widths())), numbers(settings)):
        row = box.row()
        row.alignment = "CENTER"
        row.label(text=text, translate=False)


def abridged(widths: tuple[int, ...]) -> list[str]:
    """The widths as text; hidden layers, which are all of one width, as one where they are too many."""
    first, *hidden, last = map(str, widths)
    if len(widths) > _MOST:
        hidden = [f"{len(hidden)} × {hidden[0]}"]
    return [first, *hidden, last]


def numbers(settings: DQN) -> str:
    """One line: how many parameters are trained, and the size of the table that the network is laid out in."""
    return f"{_short(settings.trained())} parameters, table {settings.cells}³"


def _short(count: int) -> str:
    """50,123 as "50 k"."""
    for unit, size in (("M", 1e6), ("k", 1e3)):
        if count >= size:
            return f"{count / size:.3g} {unit}"
    return str(count)

"""The shape of the Q network, below its settings."""

import bpy

from blender_rl_guiding.settings import DQN

_MOST = 6  # numbers in a row that fit into a panel of the usual width


def draw_network(layout: bpy.types.UILayout, settings: DQN, context: bpy.types.Context) -> None:
    """The widths of each network's input, layers and output (the patches). Below them, the number of parameters and the table's size."""
    own = settings.encoder.layers_of_its_own()
    encoder = [f"encoder {' → '.join(map(str, own))}"] if own else []
    box = layout.box().column(align=True)
    for text in (*encoder, " → ".join(abridged(settings.widths())), numbers(settings)):
        row = box.row()
        row.alignment = "CENTER"
        row.label(text=text, translate=False)


def abridged(widths: tuple[int, ...]) -> list[str]:
    """The widths as text. All hidden layers have one width; if there are too many, they are written as "6 × 96"."""
    first, *hidden, last = map(str, widths)
    if len(widths) > _MOST:
        hidden = [f"{len(hidden)} × {hidden[0]}"]
    return [first, *hidden, last]


def numbers(settings: DQN) -> str:
    """One line: the number of trained parameters, and the size of the table of the network's values."""
    return f"{_short(settings.trained())} parameters, table {settings.cells}³"


def _short(count: int) -> str:
    """50,123 as "50 k"."""
    for unit, size in (("M", 1e6), ("k", 1e3)):
        if count >= size:
            return f"{count / size:.3g} {unit}"
    return str(count)

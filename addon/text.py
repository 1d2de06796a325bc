"""Sentences in panels, which have no line breaks of their own."""

import textwrap

import bpy

_LETTER = 8  # pixels that a letter takes, about, with what stands beside the text shared out
_LEAST = 16  # letters in a line


def draw_text(layout: bpy.types.UILayout, text: str, context: bpy.types.Context) -> None:
    """Draw a text in as many lines as the editor's width asks for."""
    letters = int(context.region.width / (_LETTER * context.preferences.system.ui_scale))
    for line in textwrap.wrap(text, max(letters, _LEAST)):
        layout.label(text=line, translate=False)

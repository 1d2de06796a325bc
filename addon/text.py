"""Draws text of any length in several lines, because Blender's labels have only one line."""

import textwrap

import bpy

_LETTER = 6.5  # pixels of a letter, about
_MARGIN = 60  # pixels of the editor's width without text
_LEAST = 16  # letters in a line


def draw_text(layout: bpy.types.UILayout, text: str, context: bpy.types.Context, icon: str = "NONE") -> None:
    """Draw a text in lines that fit the editor, the first behind the icon."""
    letters = int((context.region.width / context.preferences.system.ui_scale - _MARGIN) / _LETTER)
    for number, line in enumerate(textwrap.wrap(text, max(letters, _LEAST))):
        layout.label(text=line, translate=False, icon="BLANK1" if number and icon != "NONE" else icon)

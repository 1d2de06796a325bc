"""Sentences in panels, which have no line breaks of their own."""

import textwrap

import bpy

_LETTER = 6.5  # pixels that a letter takes, about
_MARGIN = 60  # pixels of the editor that a panel's text does not have
_LEAST = 16  # letters in a line


def draw_text(layout: bpy.types.UILayout, text: str, context: bpy.types.Context, icon: str = "NONE") -> None:
    """Draw a text in as many lines as the editor's width asks for, the first of them behind an icon if there is one."""
    letters = int((context.region.width / context.preferences.system.ui_scale - _MARGIN) / _LETTER)
    for number, line in enumerate(textwrap.wrap(text, max(letters, _LEAST))):
        layout.label(text=line, translate=False, icon="BLANK1" if number and icon != "NONE" else icon)

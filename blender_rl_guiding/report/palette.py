"""The colours of methods, the same in the page and in figures for papers; the first is the baseline's, grey."""

LIGHT = ("#7a808a", "#2b6cb0", "#d9730d", "#1a7f4b", "#a13ea8", "#b7312c", "#0e8fa8", "#8a7a00", "#d6568f", "#7b4a2b")
DARK = ("#969ca5", "#79b4ee", "#f0a35a", "#5fc98f", "#d793dd", "#f08a84", "#5cc8dc", "#d2c15a", "#f49ac0", "#c9a07c")

"""Build all nine scenes, without previews: python scenes/build/all.py."""

import importlib

from common import NAMES, save

for name in NAMES:
    importlib.import_module(name).build()
    save()

"""The page of all settings: `python -m blender_rl_guiding.doors.settings_page > docs/settings.md`."""

from collections.abc import Iterator
from pathlib import Path

from ..comparison import Comparison
from ..schema import Entry, Pixel, Settings, entries
from ..settings import PRESETS, Machine, Render

_HEAD = """# Settings

Made by `python -m blender_rl_guiding.doors.settings_page > docs/settings.md` from `settings.py`, `guide_settings.py` and `comparison.py`.
The first column is what the panels in Blender show, the second what JSON and the command line call it (`--dqn.learning-rate 1e-3`).
The command line has flags for the settings of a render and of the machine, and for some of a comparison: `rlg compare --help`."""


def page() -> str:
    """Markdown: a table for each panel and each variant, and the presets."""
    tables = (table for config in (Render, Machine, Comparison) for table in _tables(config, "", config.__name__))
    return "\n".join([_HEAD, *tables, *_presets()]) + "\n"


def _tables(config: type[Settings], scope: str, title: str) -> Iterator[str]:
    """The table of a class, then the tables of the variants in its menus."""
    yield f"\n## {title}\n\n{config.__doc__}"
    if members := list(entries(config)):
        yield "\n| setting | name | panel | default | limits | |\n|---|---|---|---|---|---|"
        yield from (_row(entry, scope) for entry in members)
    for entry in members:
        for kind, variant in entry.variants.items():
            yield from _tables(variant, f"{kind}.", f"{entry.label}: {variant.label} (`{kind}`)")


def _row(entry: Entry, scope: str) -> str:
    cells = entry.label, f"`{scope}{entry.name}`", entry.panel, _default(entry), _limits(entry), entry.doc + _condition(entry)
    return f"| {' | '.join(cells)} |"


def _default(entry: Entry) -> str:
    """Empty for a file and a pixel: by default there is none."""
    if entry.type in (Path, Pixel):
        return ""
    if entry.of:
        return ", ".join(f"`{name}`" for name, _ in entry.default)
    return f"`{entry.default.kind if entry.variants else entry.default}`"


def _limits(entry: Entry) -> str:
    if entry.variants or entry.choices:
        return ", ".join(f"`{name}`" for name in (*entry.variants, *entry.choices))
    low, high = ("" if limit is None else f"{limit:,}" if entry.type is int else f"{limit:g}" for limit in entry.limits)
    return f"{low} to {high}" if low and high else low and f"at least {low}"


def _condition(entry: Entry) -> str:
    return f" Only with `{entry.when[0]}` `{entry.when[1]}`." if entry.when else ""


def _presets() -> Iterator[str]:
    yield "\n## Presets\n\n| preset | name | |\n|---|---|---|"
    yield from (f"| {preset.label} | `{name}` | {preset.doc} |" for name, preset in PRESETS.items())


if __name__ == "__main__":
    print(page(), end="")

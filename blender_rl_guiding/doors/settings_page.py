"""The page of all settings: `python -m blender_rl_guiding.doors.settings_page > docs/settings.md`."""

from collections.abc import Iterator

from ..schema import Entry, Settings, entries
from ..settings import PRESETS, Render

_HEAD = """# Settings

Made by `python -m blender_rl_guiding.doors.settings_page > docs/settings.md` from `settings.py`. The first column is what the panels in
Blender show, the second what JSON and the command line call it (`--dqn.learning-rate 1e-3`)."""


def page() -> str:
    """Markdown: a table for each panel and each variant, and the presets."""
    return "\n".join([_HEAD, *_tables(Render, "", "Render"), *_presets()]) + "\n"


def _tables(config: type[Settings], scope: str, title: str) -> Iterator[str]:
    """The tables of a class, then those of the variants that its menus offer."""
    yield f"\n## {title}\n\n{config.__doc__}"
    if members := list(entries(config)):
        yield "\n| setting | name | panel | default | limits | |\n|---|---|---|---|---|---|"
        yield from (_row(entry, scope) for entry in members)
    for entry in members:
        for kind, variant in entry.variants.items():
            yield from _tables(variant, f"{kind}.", f"{entry.label}: {variant.label} (`{kind}`)")


def _row(entry: Entry, scope: str) -> str:
    default = entry.default.kind if entry.variants else entry.default
    cells = entry.label, f"`{scope}{entry.name}`", entry.panel, f"`{default}`", _limits(entry), entry.doc + _condition(entry)
    return f"| {' | '.join(cells)} |"


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

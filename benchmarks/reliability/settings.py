"""Damaged settings: as plain data, as files (presets of the add-on are such files), as flat changes, and as command lines."""

import json
import random
from pathlib import Path
from typing import get_args

from blender_rl_guiding.flat import flags, override
from blender_rl_guiding.schema import from_dict, to_dict
from blender_rl_guiding.settings import PRESETS, Guide, Machine, Render, method

from . import mutations
from .commands import called, outcome_of
from .guard import Guard
from .ledger import FoundError

_NAMES = [*PRESETS, *(guide.kind for guide in get_args(Guide))]
_COMMANDS = ("render", "inspect", "compare", "sweep", "export", "report", "metrics")
_MISSING = "there-is-none.npz"  # the scene: nothing is rendered, but settings are read before it


class Fuzz:
    """See `trying.Trial`."""

    def __init__(self, guard: Guard) -> None:
        self._texts = [text for text in mutations.TEXTS if text not in mutations.RAW]
        self._flags = [name.replace("_", "-") for config in (Render, Machine) for name, _ in flags(config)]
        self._typed = [text for text in self._texts if len(text) < 1000 and text.isprintable()]  # errors quote them in one line
        self._words = (*self._typed, *map(str, mutations.NUMBERS), *guard.ways_out, "1", "2", "0.5", *_NAMES)

    def attempt(self, rng: random.Random, folder: Path) -> tuple[str, str]:
        way = rng.choice((self._data, self._data, self._file, self._changes, self._changes, self._line))
        return way(rng, folder)

    def _data(self, rng: random.Random, folder: Path) -> tuple[str, str]:
        config, values = rng.choice(((Render, to_dict(method(rng.choice(_NAMES)))), (Machine, to_dict(Machine()))))
        made = mutations.damaged(values, rng, self._texts)
        (folder / "values.txt").write_text(ascii(made))
        settings = from_dict(config, made)
        if from_dict(config, json.loads(json.dumps(to_dict(settings)))) != settings:
            raise FoundError("difference: they do not survive being written")
        return "accepted", ""

    def _file(self, rng: random.Random, folder: Path) -> tuple[str, str]:
        text = mutations.text(mutations.damaged(to_dict(method(rng.choice(_NAMES))), rng), rng)
        data = text.encode("utf-8", "surrogatepass")
        (folder / "preset.json").write_bytes(mutations.damaged_bytes(data, rng) if rng.random() < 0.2 else data)
        return self._call(folder, "render", folder / _MISSING, "--settings", folder / "preset.json", "--out", folder / "out")

    def _changes(self, rng: random.Random, folder: Path) -> tuple[str, str]:
        names = [name for name, _ in flags(Render)]
        changes = {
            rng.choice((*names, *self._typed)) if rng.random() < 0.2 else rng.choice(names): mutations.extreme(
                rng.choice((1, 1.0, "")), rng, self._typed
            )
            for _ in range(rng.choice((1, 1, 2, 4)))
        }
        (folder / "changes.txt").write_text(ascii(changes))
        override(method(rng.choice(_NAMES)), changes)
        return "accepted", ""

    def _line(self, rng: random.Random, folder: Path) -> tuple[str, str]:
        line: list[object] = [rng.choice(_COMMANDS), folder / _MISSING]
        for _ in range(rng.choice((1, 2, 4))):
            flag = rng.choice(
                (*self._flags, "methods", "seeds", "jobs", "reference-spp", "probe", "frames", "resolution", "preset", "pixel")
            )
            line += [f"--{flag}", rng.choice(self._words)] if rng.random() < 0.8 else [f"--{flag}={rng.choice(self._words)}"]
        if rng.random() < 0.3:
            line[rng.randrange(len(line))] = rng.choice(self._words)
        (folder / "line.txt").write_text(ascii(line))
        return self._call(folder, *line, "--out", folder / "out")

    def _call(self, folder: Path, *line: object) -> tuple[str, str]:
        result, said = outcome_of(*called(*(str(word).replace("\x00", "") for word in line)))  # no command line can contain a NUL
        if (folder / "out").exists():
            raise FoundError("leftover: a command that was refused has made its folder")
        return ("accepted", "") if _MISSING in said and "cannot read" in said else (result, said)

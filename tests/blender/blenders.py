"""The Blenders that the add-on supports. Each gives (command that runs a script in this Blender, environment variables)."""

import os
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
EXECUTABLE = Path(os.environ.get("BLENDER", ROOT / ".." / "shared" / "tools" / "blender")).resolve()
OLDEST = "4.5.15"  # bpy module of the oldest Blender that the manifest allows


def uv() -> str:
    """The uv that ./build.sh uses."""
    return shutil.which("uv") or str(ROOT / ".uv" / "bin" / "uv")


def module() -> tuple[list[str], dict[str, str]]:
    """This environment's bpy, without the installed package: the add-on must bring its own."""
    return [sys.executable, "-S"], {"PYTHONPATH": sysconfig.get_path("purelib"), "RENDERER": sys.executable}


def executable() -> tuple[list[str], dict[str, str]]:
    """A whole Blender with its own Python."""
    if not EXECUTABLE.is_file():
        pytest.skip(f"no Blender at {EXECUTABLE}; the variable BLENDER names one")
    return [str(EXECUTABLE), "--background", "--python-exit-code", "1", "--python"], {"RENDERER": sys.executable}


def oldest() -> tuple[list[str], dict[str, str]]:
    """The bpy module of Blender 4.5 LTS, in the user's cache. It needs Python 3.11."""
    caches = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = caches / "blender_rl_guiding" / f"bpy-{OLDEST}"
    python = folder / "bin" / "python"
    if not (folder / "ready").exists():
        found = next(_pythons("3.11"), None)
        if not found:
            pytest.skip("no Python 3.11 on PATH or under pyenv for Blender 4.5")
        for command in (["venv", "--clear", "--python", found, str(folder)], ["pip", "install", "--python", str(python), f"bpy=={OLDEST}"]):
            done = subprocess.run([uv(), *command], capture_output=True, text=True, check=False)
            if done.returncode:
                pytest.skip(f"no bpy {OLDEST}: {done.stderr.strip().splitlines()[-1]}")
        (folder / "ready").touch()
    return [str(python)], {"RENDERER": sys.executable}


def _pythons(version: str) -> Iterator[str]:
    pyenv = Path(os.environ.get("PYENV_ROOT") or Path.home() / ".pyenv")
    for candidate in (f"python{version}", *map(str, pyenv.glob(f"versions/{version}.*/bin/python"))):
        try:
            # A pyenv shim of that name may exist and still refuse to run.
            subprocess.run([candidate, "--version"], capture_output=True, check=True)
        except (OSError, subprocess.CalledProcessError):
            continue
        yield candidate

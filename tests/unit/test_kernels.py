"""Every change in the sources of kernels changes the folder of their cache. Kernels can check their indices."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from blender_rl_guiding.kernels import source_key


@pytest.fixture
def package(tmp_path: Path) -> Path:
    (tmp_path / "scene").mkdir()
    (tmp_path / "tracer.py").write_text("from .kernels import kernel, part")
    (tmp_path / "scene" / "description.py").write_text("CAMERA = 1")
    (tmp_path / "tables.npz").write_bytes(b"numbers")
    (tmp_path / "cli.py").write_text("pass")
    return tmp_path


@pytest.mark.parametrize("name", ["tracer.py", "scene/description.py", "tables.npz"])
def test_the_key_changes_with_code_constants_and_tables(package: Path, name: str):
    before = source_key(package)
    with (package / name).open("a") as file:
        file.write("# changed")
    assert source_key(package) != before


def test_the_key_does_not_change_with_the_rest(package: Path):
    before = source_key(package)
    (package / "cli.py").write_text("print()")
    assert source_key(package) == before


_READ = """
import numpy as np
from blender_rl_guiding import kernels
from blender_rl_guiding.kernels import kernel, part
@part
def read(array, i):
    return array[i]
@kernel
def first(array, rows, i):
    rows[i, 0] = read(array, i)
for index in (0, 3, 4, -1, 2**40):
    try:
        first(np.zeros(4), np.zeros((4, 1)), index)
        print("inside")
    except IndexError:
        print("outside")
print(kernels._FOLDER.name)
"""


def test_indices_are_checked_where_numba_is_told_to(tmp_path: Path):
    """Indices below 0 are checked, too, although Numba counts them from the end. Checked kernels have their own cache."""
    script = tmp_path / "read.py"
    script.write_text(_READ)
    changed = {"NUMBA_BOUNDSCHECK": "1", "XDG_CACHE_HOME": str(tmp_path)}
    child = subprocess.run([sys.executable, script], env=os.environ | changed, capture_output=True, text=True, check=True)
    *found, folder = child.stdout.split()
    assert found == ["inside", "inside", "outside", "outside", "outside"]
    assert folder.endswith("-checked")

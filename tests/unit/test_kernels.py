"""The cache of kernels is another one as soon as anything that goes into them is."""

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

"""Packs the add-on and its wheel of blender_rl_guiding as a Blender extension: `python -m scripts.extension UV FOLDER`."""

import hashlib
import importlib.util
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

from blender_rl_guiding import __version__
from blender_rl_guiding.errors import InputError, atomic

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = "blender_rl_guiding"
SOURCE_ONLY = {"blender_manifest.toml", "headless.py"}  # the first is filled in, the second runs from the source tree


def pack(uv: str, folder: Path) -> Path:
    """Write rl_guided-<version>.zip into `folder`, valid by Blender's own rules. Equal sources give equal bytes.

    InputError where it cannot be written; CalledProcessError, with its reason on stderr, where uv or Blender's validator refuses.
    """
    archive = folder / f"rl_guided-{__version__}.zip"
    with tempfile.TemporaryDirectory() as work, atomic(archive) as part:
        wheel = _wheel(uv, Path(work))
        files = _files() | {"LICENSE": (ROOT / "LICENSE").read_bytes(), f"wheels/{wheel.name}": wheel.read_bytes()}
        manifest = (ROOT / "addon" / "blender_manifest.toml").read_text(encoding="utf-8")
        files["blender_manifest.toml"] = manifest.replace("@VERSION@", __version__).replace("@WHEEL@", wheel.name).encode()
        _zip(files, part)
        _validate(part)
    return archive


def _files() -> dict[str, bytes]:
    """The add-on's own files by their names in the zip."""
    sources = {path.relative_to(ROOT / "addon").as_posix(): path for path in (ROOT / "addon").rglob("*") if path.is_file()}
    return {name: path.read_bytes() for name, path in sources.items() if name not in SOURCE_ONLY and "__pycache__" not in name}


def _wheel(uv: str, work: Path) -> Path:
    """The package as a wheel; its version ends in a hash of the sources.

    Blender unpacks a wheel only of a version that it lacks: without the hash, a zip between two releases would leave the old code in place.
    """
    source = work / "source"
    shutil.copytree(ROOT / PACKAGE, source / PACKAGE, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "LICENSE", source)
    digest = hashlib.sha256()
    for path in sorted(path for path in source.rglob("*") if path.is_file()):
        digest.update(f"{path.relative_to(source)}\n".encode() + path.read_bytes())
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    version = f'version = "{__version__}'
    if f'\n{version}"\n' not in project:
        raise InputError(f"pyproject.toml does not have the package's version {__version__}")
    (source / "pyproject.toml").write_text(project.replace(f'{version}"', f'{version}+c{digest.hexdigest()[:8]}"'), encoding="utf-8")
    command = [uv, "build", "--wheel", "--quiet", "--python", sys.executable, "--out-dir", str(work), str(source)]
    subprocess.run(command, check=True)
    (wheel,) = work.glob("*.whl")
    return wheel


def _zip(files: dict[str, bytes], path: Path) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        for name in sorted(files):
            entry = zipfile.ZipInfo(name)  # dated 1980, for equal bytes
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, files[name], zipfile.ZIP_DEFLATED, 9)


def _validate(archive: Path) -> None:
    """Check the zip by Blender's validator: the bpy module brings it as a script."""
    spec = importlib.util.find_spec("bpy")
    assert spec
    assert spec.origin
    (scripts,) = Path(spec.origin).parent.glob("*/scripts")
    tags = scripts / "modules" / "_bpy_internal" / "extensions" / "tags.py"
    validator = scripts / "addons_core" / "bl_pkg" / "cli" / "blender_ext.py"
    subprocess.run([sys.executable, str(validator), "validate", "--valid-tags", str(tags), str(archive)], check=True, stdout=sys.stderr)


if __name__ == "__main__":
    try:
        print(pack(sys.argv[1], Path(sys.argv[2])))
    except (InputError, subprocess.CalledProcessError) as error:
        sys.exit(f"extension: {error}")

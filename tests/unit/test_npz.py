"""Hostile files of arrays: each is refused in one line, before it takes much memory or time."""

import io
import resource
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from blender_rl_guiding import npz
from blender_rl_guiding.errors import InputError
from blender_rl_guiding.npz import opened

SHAPE = (1000, 1000)  # of float32: 4 MB


def member(shape: tuple = SHAPE, dtype: str = "<f4", content: bytes | None = None) -> bytes:
    """The bytes of an array in a file; zeros if no content is given."""
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": dtype, "fortran_order": False, "shape": shape})
    return header.getvalue() + (content if content is not None else bytes(4 * SHAPE[0] * SHAPE[1]))


def pack(path: Path, packing: int = zipfile.ZIP_DEFLATED, **members: bytes) -> bytearray:
    with zipfile.ZipFile(path, "w", packing) as file:
        for name, content in members.items():
            file.writestr(f"{name}.npy", content)
    return bytearray(path.read_bytes())


def claimed(data: bytearray, size: int) -> bytearray:
    """The same file, but with another unpacked size of the first member in its directory."""
    at = data.index(b"PK\x01\x02") + 24
    data[at : at + 4] = size.to_bytes(4, "little")
    return data


def read(path: Path) -> np.ndarray:
    with opened(path, "a file of arrays") as file:
        return file.array("x", [np.float32], (None, None))


def refusal(path: Path) -> str:
    with pytest.raises(InputError) as info:
        read(path)
    text = str(info.value)
    assert str(path) in text
    assert "\n" not in text
    return text


def overlapping(path: Path) -> None:
    """Write a file in which two members have the same bytes."""
    data = pack(path, x=member(), y=member())
    second = data.rindex(b"PK\x01\x02")
    data[second + 42 : second + 46] = bytes(4)
    path.write_bytes(data)


def encrypted(path: Path) -> None:
    data = pack(path, x=member())
    for mark, at in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        data[data.index(mark) + at] |= 1
    path.write_bytes(data)


def too_many(path: Path) -> None:
    """Write a file with a directory of 20 MB, by names of the greatest length."""
    with zipfile.ZipFile(path, "w") as file:
        for k in range(320):
            file.writestr(f"{k:05}" * 12_500, b"")


HARMS = {
    "claims little and inflates much": lambda path: path.write_bytes(claimed(pack(path, x=member()), 1000)),
    "claims much and has little": lambda path: path.write_bytes(claimed(pack(path, x=member()), 2**31)),
    "an array of terabytes": lambda path: pack(path, x=member((10**6, 10**6), content=b"")),
    "more numbers than integers have": lambda path: pack(path, x=member((2**62, 2**62), content=b"")),
    "rows of nothing without end": lambda path: pack(path, x=member((2**63, 0), content=b"")),
    "a negative length": lambda path: pack(path, x=member((-1, 4), content=b"")),
    "packed by LZMA": lambda path: pack(path, zipfile.ZIP_LZMA, x=member()),
    "packed by bzip2": lambda path: pack(path, zipfile.ZIP_BZIP2, x=member()),
    "encrypted": encrypted,
    "nested beyond the parser": lambda path: pack(path, x=b"\x93NUMPY\x01\x00\x28\x23" + b"(" * 9000),
    "a header of megabytes": lambda path: pack(path, x=b"\x93NUMPY\x02\x00\x00\x00\x80\x00" + b" " * (1 << 23)),
    "big-endian": lambda path: pack(path, x=member(dtype=">f4")),
    "records": lambda path: pack(path, x=member(dtype="|V4")),
}


@pytest.mark.parametrize("harm", HARMS)
def test_harmful_files_are_refused_at_once(tmp_path, harm):
    path = tmp_path / "x.npz"
    HARMS[harm](path)
    before = peak()
    refusal(path)
    assert peak() - before < 200e6


def peak() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def test_a_list_of_members_is_not_taken_in_whatever_its_length(tmp_path):
    too_many(tmp_path / "x.npz")
    assert "a list of members of" in refusal(tmp_path / "x.npz")


def test_members_that_overlap_are_refused_or_read_once(tmp_path):
    overlapping(tmp_path / "x.npz")
    try:
        assert not read(tmp_path / "x.npz").any()
    except InputError as error:
        assert "\n" not in str(error)  # noqa: PT017  # newer versions of zipfile refuse it


def test_of_two_members_of_a_name_one_is_read_whole(tmp_path):
    first, second = (member(content=np.full(SHAPE, value, np.float32).tobytes()) for value in (1.0, 2.0))
    with zipfile.ZipFile(tmp_path / "x.npz", "w") as file:
        file.writestr("x.npy", first)
        with pytest.warns(UserWarning, match="Duplicate"):
            file.writestr("x.npy", second)
    assert (read(tmp_path / "x.npz") == 2).all()


def test_what_inflates_beyond_the_free_memory_is_refused_by_its_size(tmp_path, monkeypatch):
    monkeypatch.setattr(npz, "available", lambda: 3_000_000)
    pack(tmp_path / "x.npz", x=member())
    assert (tmp_path / "x.npz").stat().st_size < 10_000
    assert refusal(tmp_path / "x.npz").endswith("takes 4 MB of memory, but only 3 MB are free")


def test_text_needs_the_memory_that_it_is_parsed_into(tmp_path, monkeypatch):
    text = "[" + "[]," * 100_000 + "[]]"
    np.savez(tmp_path / "x.npz", x=np.array(text))
    with opened(tmp_path / "x.npz", "a file") as file:
        assert file.text("x") == text
    monkeypatch.setattr(npz, "available", lambda: 20_000_000)
    with pytest.raises(InputError, match=r"1.2 MB of text, which is too much"), opened(tmp_path / "x.npz", "a file") as file:
        file.text("x")


def test_no_memory_is_told_in_a_line(tmp_path, monkeypatch):
    pack(tmp_path / "x.npz", x=member())

    def none(*arguments):
        raise MemoryError

    monkeypatch.setattr(np, "empty", none)
    assert refusal(tmp_path / "x.npz").endswith("takes more memory than there is")


def test_arrays_by_columns_become_arrays_by_rows(tmp_path):
    """Kernels are compiled for arrays by rows, and Embree reads them without a copy."""
    there = np.asfortranarray(np.arange(12, dtype=np.float32).reshape(3, 4))
    np.savez(tmp_path / "x.npz", x=there)
    found = read(tmp_path / "x.npz")
    assert found.flags.c_contiguous
    assert (found == there).all()

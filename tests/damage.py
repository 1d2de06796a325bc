"""Ways in which files get damaged: bits that flip, ends that are lost, other files in their place."""

from collections.abc import Iterator

import numpy as np


def damaged(whole: bytes, flips: int, cuts: int, seed: int = 0) -> Iterator[bytes]:
    """The bytes with one bit flipped, `flips` times, every second one near the beginning; cut short, `cuts` times; and none or others."""
    rng = np.random.default_rng(seed)
    for k in range(flips):
        bit = int(rng.integers(8 * min(len(whole), 1024 if k % 2 else len(whole))))
        yield whole[: bit // 8] + bytes([whole[bit // 8] ^ 1 << bit % 8]) + whole[bit // 8 + 1 :]
    for end in rng.integers(len(whole), size=cuts):
        yield whole[:end]
    yield from (b"", b"\0" * len(whole), b"[]", b"null", whole + b"\0", whole[::-1])

"""A program with a lifeline ends when its stdin ends, and says why. This holds for all kinds of stdin."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.patience import PATIENCE

ADDON = Path(__file__).resolve().parents[2] / "addon"
HELD = f"import sys, time; sys.path.insert(0, {str(ADDON)!r}); from lifeline import hold; hold(%s); time.sleep(10000)"


def held(redirection: str, heard: str = "") -> subprocess.CompletedProcess[bytes]:
    """Start a program that would sleep for hours, with redirections as in a shell. Returns the ended process."""
    command = ["sh", "-c", f'exec "$0" -c "$1" {redirection}', sys.executable, HELD % heard]
    return subprocess.run(command, stdin=subprocess.PIPE, capture_output=True, timeout=PATIENCE, check=False)


@pytest.mark.parametrize("redirection", ["", "< /dev/null"])
def test_it_says_why_it_ends(redirection: str):
    done = held(redirection)
    assert (done.returncode, done.stderr) == (1, b"its stdin ended: who started it is gone\n")


@pytest.mark.parametrize("redirection", ["<&-", "2> /dev/full", "2>&-"])
def test_it_ends_where_it_cannot_say_so(redirection: str):
    assert held(redirection).returncode == 1


def test_what_is_no_text_is_heard(tmp_path: Path):
    (tmp_path / "lines").write_bytes(b"12\n\xff\n")
    assert held(f"< {tmp_path / 'lines'}", "lambda line: print(line, flush=True)").stdout == b"b'12\\n'\nb'\\xff\\n'\n"

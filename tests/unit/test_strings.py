"""Text from others: it cannot control a terminal, and a path made from it cannot lead out of its folder."""

import unicodedata
from pathlib import Path

import pytest

from blender_rl_guiding.errors import InputError, atomic
from blender_rl_guiding.experiments.progress import terminal
from blender_rl_guiding.notices import tell
from blender_rl_guiding.strings import LONGEST, fault_of_name, fault_of_old_name, fit, printable, say

BAD = [
    "", ".", "..", " ", "a.", " a", "a ", ".a", "a/b", "../a", "/a", "a\\b", "a:b", "a*", "a?", 'a"', "a<b", "a>b", "a|b",
    "a\0", "a\nb", "a\tb", "\x1b[31m", "\x7f", "\x9b1m", "\u202ea", "\u2028", "\ud800", "a" * (LONGEST + 1), "é" * LONGEST,
]  # fmt: skip
GOOD = ["a", "a b", "a.b", "_", "-a", "=1+1", "[red]", "{{body}}", "$x^2$", "é" * (LONGEST // 2), "シーン", "a'b", "a&b", "a" * LONGEST]


@pytest.mark.parametrize("name", BAD, ids=ascii)
def test_what_cannot_be_the_name_of_a_file(name: str):
    assert fault_of_name(name)
    assert not fault_of_name(fit(name))


LEADING_OUT = {
    "", ".", "..", "a/b", "../a", "/a", "a\\b", "é" * LONGEST,
    "a\0", "a\nb", "a\tb", "\x1b[31m", "\x7f", "\x9b1m", "\u202ea", "\u2028", "\ud800",
}  # fmt: skip


@pytest.mark.parametrize("name", [*BAD, *GOOD, "kitchen: night", "scene.", ".hidden", "a" * 255, "a" * 256], ids=ascii)
def test_of_names_from_before_only_those_are_refused_that_lead_out_or_cannot_be_shown(name: str):
    assert bool(fault_of_old_name(name)) == (name in LEADING_OUT or len(name) > 255)


def test_what_is_written_goes_through_no_link(tmp_path: Path):
    """Other users can guess temporary names, and know final names. They could make links of these names."""
    (tmp_path / "kept").write_text("kept")
    with atomic(tmp_path / "a.txt") as temporary:
        temporary.touch()
    (tmp_path / "a.txt").unlink()
    for path in (tmp_path / "a.txt", temporary):
        path.symlink_to("kept")
    with atomic(tmp_path / "a.txt") as part:
        part.write_text("new")
    assert (tmp_path / "kept").read_text() == "kept"
    assert (tmp_path / "a.txt").read_text() == "new"


@pytest.mark.parametrize("name", GOOD, ids=ascii)
def test_what_can(name: str):
    assert not fault_of_name(name)
    assert fit(name) == name


def test_what_is_printed_is_one_line_that_a_terminal_cannot_but_show(capsys: pytest.CaptureFixture[str]):
    everything = "".join(map(chr, [*range(0x3000), *range(0xD700, 0xE100)]))
    shown = printable(everything)
    assert not [letter for letter in shown if unicodedata.category(letter) in ("Cc", "Cs", "Zl", "Zp")]
    assert printable("a é × \N{NO-BREAK SPACE}シ") == "a é × \N{NO-BREAK SPACE}シ"
    assert printable("\x1b[2J\n\u202e\ud800") == r"\x1b[2J\n\u202e\ud800"
    assert str(InputError("\x1b[2J")) == r"\x1b[2J"
    say("\x1b[2J\n")
    with terminal() as progress, progress("\x1b[red]:smile:", 1):
        tell("[red]\x1b:smile:\n")
    said = capsys.readouterr()
    assert said.out == "\\x1b[2J\\n\n"
    assert said.err == "[red]\\x1b:smile:\\n\n"

"""Text from strangers: the rule for names of files, and the characters that are safe on a terminal.

Standard library only: Blender's own Python (3.11 or newer) imports this.
"""

import re
from typing import IO, Annotated

# Characters that control a terminal, reverse the order of letters or end a line, and halves of characters (surrogates).
_UNSEEN = re.compile("[\x00-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
_UNFIT = re.compile(rf'{_UNSEEN.pattern}|[/\\:*?"<>|]|^$')  # not allowed in names of files on at least one system
LONGEST = 150  # maximal bytes of a name: file systems allow 255, and names of figures and temporary files append to it
LONGEST_EVER = 255  # maximal bytes of a name in file systems


def printable(text: str) -> str:
    """The text in one line, with escapes for characters that are unsafe on a terminal."""
    return _UNSEEN.sub(lambda found: ascii(found[0])[1:-1], text)


def one_line(error: BaseException) -> str:
    """The text of an error in one line; the name of its class where it has no text."""
    return " ".join(str(error).split()) or type(error).__name__


def say(text: object, file: IO[str] | None = None) -> None:
    """Print a line, on stdout if nothing else is named."""
    print(printable(str(text)), file=file, flush=True)


def fault_of_name(name: str) -> str:
    """The reason why a file or folder cannot have this name; empty if it can."""
    if _UNFIT.search(name) or name.strip(" .") != name:
        return "cannot be the name of a file or folder"
    if len(name.encode()) > LONGEST:
        return f"is longer than the {LONGEST} bytes that a file's name may have"
    return ""


def fit(name: str) -> str:
    """The name, changed as little as needed for a valid file name."""
    kept = _UNFIT.sub("_", name).strip(" .").encode()[:LONGEST]
    return kept.decode(errors="ignore").strip(" .") or "_"


def fault_of_old_name(name: str) -> str:
    """The reason why no existing file, even from an earlier version, can have this name. Empty if one can: it then is safe to show, and is
    no path.
    """
    if _UNSEEN.search(name) or name in ("", ".", "..") or "/" in name or "\\" in name or len(name.encode()) > LONGEST_EVER:
        return "cannot be the name of a file or folder"
    return ""


Name = Annotated[str, fault_of_name]  # for `typed.read`: the name of a file that will be written
OldName = Annotated[str, fault_of_old_name]  # the name of a file that was written

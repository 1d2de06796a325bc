"""Text of strangers: the rule for names of files, and the characters that a terminal may get.

Standard library only: Blender's own Python (3.11 or newer) imports this.
"""

import re
from typing import IO, Annotated

# Characters that a terminal obeys, that reverse the order of letters, that end a line, and halves of characters.
_UNSEEN = re.compile("[\x00-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
_UNFIT = re.compile(rf'{_UNSEEN.pattern}|[/\\:*?"<>|]|^$')  # in the name of a file, on one system or another
LONGEST = 150  # bytes of a name: file systems take 255, and the names of figures and temporary files are longer
LONGEST_EVER = 255  # bytes of a name that a file system takes


def printable(text: str) -> str:
    """The text in one line, with escapes for characters that a terminal would not simply show."""
    return _UNSEEN.sub(lambda found: ascii(found[0])[1:-1], text)


def one_line(error: BaseException) -> str:
    """The text of an error in one line; the name of its class where it has no text."""
    return " ".join(str(error).split()) or type(error).__name__


def say(text: object, file: IO[str] | None = None) -> None:
    """Print a line, on stdout if nothing else is named."""
    print(printable(str(text)), file=file, flush=True)


def fault_of_name(name: str) -> str:
    """Why a file or folder should not be called so; empty if it can be."""
    if _UNFIT.search(name) or name.strip(" .") != name:
        return "cannot be the name of a file or folder"
    if len(name.encode()) > LONGEST:
        return f"is longer than the {LONGEST} bytes that a file's name may have"
    return ""


def fit(name: str) -> str:
    """The nearest name that a file can have."""
    kept = _UNFIT.sub("_", name).strip(" .").encode()[:LONGEST]
    return kept.decode(errors="ignore").strip(" .") or "_"


def fault_of_old_name(name: str) -> str:
    """Why no existing file, even of an earlier version, can have this name; empty if one can: it is safe to show, and leads nowhere."""
    if _UNSEEN.search(name) or name in ("", ".", "..") or "/" in name or "\\" in name or len(name.encode()) > LONGEST_EVER:
        return "cannot be the name of a file or folder"
    return ""


Name = Annotated[str, fault_of_name]  # for `typed.read`: of a file that will be written
OldName = Annotated[str, fault_of_old_name]  # of a file that was

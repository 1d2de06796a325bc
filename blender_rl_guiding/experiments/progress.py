"""What long work shows: how far its steps are. Lines that stay are told by `notices.tell`."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from types import TracebackType
from typing import Protocol, Self

from rich.console import Console
from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bars

from ..notices import heard_by
from ..strings import printable


class Progress(Protocol):
    """Shows how far long work is."""

    def bar(self, description: str, total: float) -> AbstractContextManager[Callable[..., None]]:
        """A bar for the length of the block. It yields a function of the number done so far, and of a new `total` or `description`."""
        ...


class Terminal:
    """Bars with an estimate, and the lines of `notices`, on stderr: stdout holds results alone. Use as a context manager."""

    def __init__(self) -> None:
        self.console = Console(stderr=True, highlight=False)
        columns = (
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TaskProgressColumn(),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
        )
        self._bars = Bars(*columns, console=self.console, transient=True)
        self._notices = ExitStack()

    def __enter__(self) -> Self:
        self._notices.enter_context(heard_by(self._note))
        if self.console.is_interactive:  # elsewhere rich would only add an empty line at the end
            self._bars.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self.console.is_interactive:
            self._bars.stop()
        self._notices.close()

    def _note(self, text: str) -> None:
        """Print a line that stays; one line, too, where it goes into a file."""
        self.console.print(printable(text), markup=False, emoji=False, soft_wrap=True)

    @contextmanager
    def bar(self, description: str, total: float) -> Iterator[Callable[..., None]]:
        """See `Progress`."""
        task = self._bars.add_task(printable(description), total=total)

        def advance(done: float, description: str | None = None, total: float | None = None) -> None:
            self._bars.update(task, completed=done, total=total, description=description and printable(description))

        try:
            yield advance
        finally:
            self._bars.remove_task(task)

"""Progress of long work. Lines that stay on the screen go through `notices.tell`."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

from rich.console import Console
from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bars

from ..notices import heard_by
from ..strings import printable

# Shows a bar for the length of a block, from its description and total. Yields a function of the number done so far, and of a new
# `total` or `description`.
Progress = Callable[[str, float], AbstractContextManager[Callable[..., None]]]


@contextmanager
def terminal() -> Iterator[Progress]:
    """Bars with an estimate, and the lines of `notices`, on stderr, because stdout has only results."""
    console = Console(stderr=True, highlight=False)
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )

    def note(text: str) -> None:
        console.print(printable(text), markup=False, emoji=False, soft_wrap=True)  # exactly one line, also in a file

    @contextmanager
    def bar(description: str, total: float) -> Iterator[Callable[..., None]]:
        task = bars.add_task(printable(description), total=total)

        def advance(done: float, description: str | None = None, total: float | None = None) -> None:
            said = None if description is None else printable(description)
            bars.update(task, completed=done, total=total, description=said)

        try:
            yield advance
        finally:
            bars.remove_task(task)

    # Outside of a terminal, rich would only add an empty line at the end.
    with heard_by(note), Bars(*columns, console=console, transient=True, disable=not console.is_interactive) as bars:
        yield bar

"""berteam list: what can be chosen, each with its first line of explanation."""

from __future__ import annotations

from berteam_cli.catalogue import about, choices, groups
from berteam_cli.errors import InputError
from berteam_cli.terminal import console


def show(group: str | None) -> None:
    """Prints the choices of ``group``, or of all groups.

    Raises:
        InputError: there is no such group.
    """
    if group is not None and group not in groups():
        raise InputError.choice("group", group, groups())
    for name in [group] if group else groups():
        console().print(f"[bold]{name}[/bold]", highlight=False)
        for option in choices(name):
            line = f"  {name}={option:<18} {about(name, option)}"
            console().print(line, markup=False, highlight=False, soft_wrap=True)

"""Replays recorded games of the original: ``python -m mctf.check FILE ...``.

Of an npz file each recorded state is put into the kernel, one step is played with the recorded actions, and the
result is compared with the next recorded state; the fixed policies must choose the recorded actions. Then every
episode is played from its start with the recorded actions alone, and must come to its recorded end on the recorded
way. Of a csv file every game is played by its policies and must end as recorded.

Exit status: 0 all as recorded, 1 something differs, 2 a file cannot be read.

Every changed number is found, but for those that no recorded step depends on: the action of a tagged vehicle whose
policy draws or is unknown, as it drives home by itself; -1 for 16, as both stop; an angle a whole turn off within its
range (180 and -180 deg); and settings that decided nothing: a radius that no distance was near, a time limit later in
the last step or of games that all ended before, a score that nobody came near to. Arrays of other names are not read.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

from mctf.comparing import FLIP_M, FLIP_SHARE, TOLERANCE, Episode, Mismatch, Report, Steps, check
from mctf.recording import OF_TEAMS, TraceError
from mctf.scripted import NAMES
from mctf.tournament import OUTCOMES, Outcomes, check_table

SHOWN = 5
"""Mismatches of steps printed for each file; episodes and games that differ are printed all."""


def main(paths: list[str]) -> int:
    """Checks files, prints what was found and returns the exit status."""
    if not paths or any(path.startswith("-") for path in paths):
        print("Give the files with recorded games: python -m mctf.check FILE ...")
        return 0 if {"-h", "--help"} & set(paths) else 2
    status = 0
    for path in paths:
        try:
            same, lines = _checked(Path(path))
        except TraceError as error:
            print(f"{path}: {error}")
            status = 2
            continue
        print(f"{path}: {'all as recorded' if same else 'differs'}")
        for line in lines:
            print(f"  {line}")
        status = max(status, 0 if same else 1)
    return status


def _checked(path: Path) -> tuple[bool, list[str]]:
    if path.suffix.lower() == ".csv":
        outcomes = check_table(path)
        return bool(outcomes.same.all()), list(_of_games(outcomes))
    report = check(path)
    return report.as_recorded, [*_of_steps(report.steps), *_of_episodes(report)]


def _of_steps(steps: Steps) -> Iterator[str]:
    wrong = {name: count for name, count in steps.counts.items() if count}
    discrete = [name for name in steps.worst if name not in TOLERANCE]
    yield f"each step from its recorded state: {steps.steps} steps, {steps.choices} actions of fixed policies; " + (
        "numbers that differ: " + ", ".join(f"{name} {count}" for name, count in wrong.items())
        if wrong
        else f"{len(discrete)} discrete fields equal"
    )
    yield "largest difference: " + ", ".join(f"{name} {steps.worst[name]:.2g}" for name in TOLERANCE)
    for found in sorted(steps.first, key=lambda mismatch: mismatch.row)[:SHOWN]:
        yield f"row {found.row}{_described(found)}"


def _of_episodes(report: Report) -> Iterator[str]:
    episodes = report.episodes
    ended = sum(episode.as_recorded for episode in episodes)
    yield f"whole episodes from their start: {ended} of {len(episodes)} replayed to their end as recorded"
    for label, some in (
        ("without keep-out contact", [episode for episode in episodes if not episode.contacts]),
        ("with keep-out contact", [episode for episode in episodes if episode.contacts]),
    ):
        if some:
            differing, played = (sum(getattr(one, name) for one in some) for name in ("differing", "agent_steps"))
            yield (
                f"{len(some)} {label}: positions within {max(one.worst_m for one in some):.2g} m, "
                f"{differing} of {played} agent-steps differ ({differing / played:.2%})"
            )
    for number, episode in enumerate(episodes):
        if episode.first is not None:
            yield _of_episode(number, episode, episode.first)
    if report.differing_share > FLIP_SHARE:
        share = f"{report.differing_share:.2%}, allowed {FLIP_SHARE:.0%}"
        yield f"too many agent-steps differ with keep-out contact: {share}"


def _of_episode(number: int, episode: Episode, found: Mismatch) -> str:
    verdict = "differs within what is allowed"
    if not episode.as_recorded:
        cause = (
            "with no keep-out contact before"
            if episode.early
            else f"by up to {episode.worst_m:.2g} m, allowed {FLIP_M} m"
        )
        verdict = f"fails {cause}"
    recorded, computed = episode.captures
    outcome = "" if recorded == computed else f"; captures at its end: recorded {recorded}, computed {computed}"
    return (
        f"episode {number} {verdict}: {episode.differing} agent-steps, the first in step "
        f"{found.row - episode.first_row} (row {found.row}){_described(found)}{outcome}"
    )


def _described(found: Mismatch) -> str:
    names = ("agent" if found.field not in OF_TEAMS else "team", "number", "number")
    where = "".join(f", {name} {i}" for name, i in zip(names, found.where, strict=False))
    return f"{where}, field {found.field}: recorded {found.recorded:.12g}, computed {found.computed:.12g}"


def _of_games(outcomes: Outcomes) -> Iterator[str]:
    table = outcomes.table
    yield f"{outcomes.same.sum()} of {len(outcomes.same)} games end with the same {', '.join(OUTCOMES)}"
    for game in (~outcomes.same).nonzero()[0]:
        names = ", ".join(NAMES[policy] for policy in table.policies[game])
        wrong = "; ".join(
            f"{name} recorded {recorded}, computed {computed}"
            for name, recorded, computed in zip(OUTCOMES, table.recorded[game], outcomes.computed[game], strict=True)
            if recorded != computed
        )
        yield f"line {table.lines[game]}, {names}: {wrong}"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

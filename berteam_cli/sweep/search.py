"""A sweep whose values Optuna chooses: it asks, the jobs answer with their expected Elo.

Trial n is job n. The trials lie in the sweep's folder, so a search that was cut short goes on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from berteam_cli.errors import InputError
from berteam_cli.sweep.folder import TABLE, Sweep, with_job
from berteam_cli.sweep.plan import installed, spelt

TRIALS = "optuna.log"
BOUNDS = ("low", "high", "log", "step")
ENDED = ("done", "failed", "refused")


def check_search(path: Path, plan: Mapping[str, Any]) -> dict[str, Any]:
    """Returns what the file of `berteam optuna` asks for, its numbers as numbers.

    Raises:
        InputError: a value is missing or wrong, or Optuna is not installed.
    """
    if not installed("optuna"):
        raise InputError(
            "berteam optuna needs the package optuna, which is not installed: pip install 'berteam-cli[optuna]'."
        )
    asked = plan.get("search")
    if not isinstance(asked, dict) or not asked:
        raise InputError(f"{path}: search must give keys a list of choices or {{low: ..., high: ...}}.")
    numbers = {"trials": plan.get("trials", 20), "at_once": plan.get("at_once", 1), "seed": plan.get("seed", 0)}
    for key, value in numbers.items():
        least = 0 if key == "seed" else 1
        if type(value) is not int or value < least:
            raise InputError(f"{path}: {key} must be a whole number >= {least}, but is {value!r}.")
    ranges = {key: check_range(path, str(key), value) for key, value in asked.items()}
    return {"ranges": ranges, "overrides": plan["overrides"], **numbers}


def check_range(path: Path, key: str, asked: Any) -> Any:
    """Returns the values that a key may take: a list, or the arguments of one of Optuna's distributions.

    Raises:
        InputError: it is neither.
    """
    if isinstance(asked, list) and asked:
        return asked
    if not isinstance(asked, dict) or not {"low", "high"} <= asked.keys() or not asked.keys() <= set(BOUNDS):
        raise InputError(
            f"{path}: search.{key} must be a list of choices, or low and high with log or step, but is {asked!r}."
        )
    bounds = {name: number(path, f"{key}.{name}", value) for name, value in asked.items() if name != "log"}
    known = {**bounds, "log": asked.get("log", False)}
    try:
        distribution(known)
    except ValueError as error:
        raise InputError(f"{path}: search.{key} is no range: {str(error).rstrip('.')}.") from error
    return known


def number(path: Path, key: str, value: Any) -> int | float:
    """Returns ``value`` as a number: YAML takes 1e-5 for text.

    Raises:
        InputError: it is none.
    """
    try:
        if isinstance(value, bool):
            raise ValueError
        return value if isinstance(value, int) else float(value)
    except (ValueError, TypeError):
        raise InputError(f"{path}: search.{key} must be a number, but is {value!r}.") from None


def distribution(asked: Any) -> Any:
    """Returns Optuna's distribution over the values that a key may take: whole numbers where both bounds are.

    Raises:
        ValueError: there are no such values.
    """
    from optuna.distributions import (  # noqa: PLC0415 (an extra)
        CategoricalDistribution,
        FloatDistribution,
        IntDistribution,
    )

    if isinstance(asked, list):
        return CategoricalDistribution([spelt(choice) for choice in asked])
    if isinstance(asked["low"], int) and isinstance(asked["high"], int):
        return IntDistribution(**asked)
    return FloatDistribution(**asked)


def ends(ranges: Mapping[str, Any]) -> list[str]:
    """Returns words that sweep over every choice and both ends of every range, so that they can be checked."""
    return [
        f"{key}={','.join(spelt(x) for x in (values if isinstance(values, list) else (values['low'], values['high'])))}"
        for key, values in ranges.items()
    ]


def words_of(search: Mapping[str, Any]) -> list[str]:
    """Returns the words of a search as a sweep's folder holds it, none of what is no search.

    Raises:
        InputError: its ranges are none.
    """
    try:
        return [*map(str, search.get("overrides", [])), *ends(search.get("ranges", {}))]
    except (TypeError, KeyError, AttributeError) as error:
        raise InputError(f"sweep.json holds no search that can go on: {type(error).__name__} {error}.") from error


def among(value: Any, asked: Any) -> bool:
    """Returns whether a trial's ``value`` is one of what is ``asked``, however it came into the file of trials."""
    if isinstance(asked, list):
        return value in [spelt(choice) for choice in asked]
    return isinstance(value, int | float) and asked["low"] <= value <= asked["high"]


def search(sweep: Sweep, launch: Callable[[Sequence[int]], bool]) -> None:
    """Asks Optuna for values, runs their jobs and tells what came of them, until all trials are done.

    Args:
        sweep: with a search; its jobs are the trials so far.
        launch: runs jobs by their numbers; returns whether others may follow.
    """
    import optuna  # noqa: PLC0415 (an extra)
    from optuna.storages import JournalStorage  # noqa: PLC0415
    from optuna.storages.journal import JournalFileBackend  # noqa: PLC0415
    from optuna.trial import TrialState  # noqa: PLC0415

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    folder, asked = sweep.folder, sweep.search
    space = {key: distribution(values) for key, values in asked["ranges"].items()}
    storage = JournalStorage(JournalFileBackend(str(folder / TRIALS)))
    study = optuna.create_study(study_name="berteam", storage=storage, direction="maximize", load_if_exists=True)
    while True:
        trials = study.get_trials(deepcopy=False)
        under_way = [trial for trial in trials if trial.state == TrialState.RUNNING]
        if not under_way:
            due = min(asked["at_once"], asked["trials"] - len(trials))
            if due <= 0:
                break
            # From the number of trials, so that a search that goes on draws what an unbroken one draws.
            study.sampler = optuna.samplers.TPESampler(seed=asked["seed"] + len(trials), constant_liar=True)
            for _ in range(due):
                study.ask(space)
            continue
        for trial in under_way:
            params, ranges = trial.params, asked["ranges"]
            if params.keys() == space.keys() and all(among(params[key], ranges[key]) for key in ranges):
                words = [f"{key}={value}" for key, value in trial.params.items()]
                with_job(folder, sweep.command, trial.number, [*asked["overrides"], *words])
                sweep.jobs[trial.number] = [*asked["overrides"], *words]
            else:  # killed while it was asked
                study.tell(trial.number, state=TrialState.FAIL)
        numbers = [trial.number for trial in under_way if trial.number in sweep.jobs]
        if not launch([job for job in numbers if sweep.status(job)[0] != "done"]):
            return
        if any(sweep.status(job)[0] not in ENDED for job in numbers):  # its process died: the search goes on with it
            return
        elos = pd.read_csv(folder / TABLE, index_col="job").expected_elo
        for job in numbers:
            if math.isfinite(elos[job]):
                study.tell(job, float(elos[job]))
            else:
                study.tell(job, state=TrialState.FAIL)
    report(study, folder)


def report(study: Any, folder: Path) -> None:
    """Prints the best trial."""
    done = [trial for trial in study.get_trials(deepcopy=False) if trial.value is not None]
    if done:
        best = max(done, key=lambda trial: trial.value)
        words = " ".join(f"{key}={value}" for key, value in best.params.items())
        print(f"Best of {len(done)} trials: job {best.number}, expected Elo {best.value:.1f}, {words}")
        print(f"Its run: {folder / str(best.number)}")

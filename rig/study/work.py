"""Distribution of a study's tasks over processes, or over a cluster, without changing its results."""

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from rig.study.study_report import Settings

Item = TypeVar("Item")
Result = TypeVar("Result")


def run_parallel(
    task: Callable[[np.random.Generator, Item], Result], items: Sequence[Item], settings: Settings
) -> list[Result]:
    """Return `task(rng, item)` for every item, in order.

    Every item has its own random stream, spawned from the seed by its index in `items`, so that results do not depend
    on the number of processes. The surrounding `joblib.parallel_config` chooses joblib's back end.
    """
    from joblib import Parallel, delayed

    seeds = np.random.SeedSequence(settings.seed).spawn(len(items))
    results = Parallel(n_jobs=settings.jobs, return_as="generator")(
        delayed(_run)(task, seed, item) for seed, item in zip(seeds, items, strict=True)
    )
    return list(settings.progress(results, len(items)))


def _run(task: Callable[[np.random.Generator, Item], Result], seed: np.random.SeedSequence, item: Item) -> Result:
    return task(np.random.default_rng(seed), item)

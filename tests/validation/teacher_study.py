#!/usr/bin/env python3
"""How many random starts the scripted policy folds, of each fold: python teacher_study.py [--starts N] [--folds towel,...]"""
import argparse
import time

import numpy

from flash_sim.folds import FOLDS
from flash_sim.tasks import FoldSettings, FoldTask, FoldTeacher


def study(fold, starts, randomization, seed, together=20):
    """Which starts were folded, and the actions that they took."""
    folded, actions = [], []
    for first in range(0, starts, together):
        task = FoldTask(min(together, starts - first), FoldSettings(fold, randomization=randomization, seed=seed + first))
        teacher, done = FoldTeacher(task), numpy.zeros(task.n_envs, bool)
        for step in range(task.time_limit):
            success = task.step(teacher.act(task))[2]
            actions += [step + 1] * int((success & ~done).sum())
            done |= success
            if done.all():
                break
        folded += done.tolist()
    return folded, actions


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folds", default=",".join(FOLDS))
    parser.add_argument("--starts", type=int, default=100)
    parser.add_argument("--randomization", default="published")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    print("| fold | starts | folded | actions of the fastest, median, slowest | seconds |\n|---|---|---|---|---|")
    for fold in options.folds.split(","):
        begin = time.monotonic()
        folded, actions = study(fold, options.starts, options.randomization, options.seed)
        spread = ", ".join(str(int(numpy.quantile(actions, share))) for share in (0, 0.5, 1)) if actions else "none"
        print(f"| {fold} | {len(folded)} | {sum(folded)} | {spread} | {time.monotonic() - begin:.0f} |", flush=True)


if __name__ == "__main__":
    main()

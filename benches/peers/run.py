#!/usr/bin/env python3
"""Measures `runner exec` against a NumPy Q-learning loop over Gymnasium, in one go.

    benches/peers/run.py [--rounds 5] [--python PATH] [--runner PATH] [--core N] [--json FILE]

Both play the same task with the same settings and the same number of episodes per seed, one after
the other, for several rounds, each on one and the same core. The peer plays one seed for about
five seconds; `runner` plays as many seeds as take about three. A round gives one ratio of steps
per second; the table shows medians, and the smallest and largest ratio.

Two ratios are shown. `training` divides the rates of the training loops as both report them
(wall time). `process` is harder on `runner` and deaf to other load on the machine: the peer's
loop against *all* of `runner exec`, from start to exit, with loading, auditing, writing every
result file and its progress thread, in CPU time.

Without --python a virtual environment is made under target/ from requirements.txt; without
--runner the release build of this tree is measured.
"""

import argparse
import json
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent

# task: episodes per seed, which take the peer some five seconds; seeds for runner's three.
TASKS = {
    "cartpole": (6000, 100),
    "cartpole_scripted": (6000, 100),
    "frozen_lake": (8000, 200),
    "frozen_lake_shaped": (8000, 200),
}


def target():
    return Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))


def make_python(name="peers-venv", requirements="requirements.txt"):
    """A virtual environment with the pinned packages."""
    venv = target() / name
    python = venv / "bin" / "python"
    if not python.exists():
        subprocess.run([sys.executable, "-m", "venv", str(venv)], check=True)
        install = [python, "-m", "pip", "install", "-q", "-r", HERE / requirements]
        subprocess.run([str(c) for c in install], check=True)
    return python


def make_runner():
    subprocess.run(["cargo", "build", "--release", "--quiet"], cwd=ROOT, check=True)
    return target() / "release" / "runner"


def peer(python, task):
    """The NumPy loop: steps, steps/s of wall time, steps/s of CPU time."""
    episodes, _ = TASKS[task]
    command = [python, HERE / "numpy_q_learning.py", task, "--episodes", episodes]
    done = subprocess.run([str(c) for c in command], check=True, stdout=subprocess.PIPE)
    result = json.loads(done.stdout)
    return result["steps"], result["steps_per_second"], result["steps"] / result["cpu_seconds"]


def runner(program, task):
    """The same for `runner exec`."""
    episodes, seeds = TASKS[task]
    with tempfile.TemporaryDirectory() as out:
        command = [program, "exec", HERE / f"{task}.rhai", "--jobs", 1, "--fresh", "--quiet"]
        command += ["--out", out, "--episodes", episodes, "--seeds", seeds]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([str(c) for c in command], check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        # One entry per unit: steps, and seconds of training.
        units = json.loads((Path(out) / "timing.json").read_text()).values()
    steps, seconds = (sum(unit[i] for unit in units) for i in (0, 1))
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return steps, steps / seconds, steps / cpu


def measure(python, program, task, rounds):
    """Alternates; returns a row of the table."""
    rows = []
    for _ in range(rounds):
        steps, wall, cpu = peer(python, task)
        own_steps, own_wall, own_cpu = runner(program, task)
        rows.append((wall, own_wall, own_wall / wall, own_cpu / cpu, steps, own_steps))
        print(f"  {task}: x{own_wall / wall:.0f} training, x{own_cpu / cpu:.0f} process",
              file=sys.stderr)
    median = [statistics.median(column) for column in zip(*rows)]
    ratios = [row[2] for row in rows]
    return {
        "task": task,
        "numpy_steps": median[4],
        "numpy_steps_per_second": median[0],
        "runner_steps": median[5],
        "runner_steps_per_second": median[1],
        "training_ratio": median[2],
        "training_ratio_range": [min(ratios), max(ratios)],
        "process_ratio": median[3],
    }


def arguments(description, rounds):
    """A parser of what every comparison can be told."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--rounds", type=int, default=rounds)
    parser.add_argument("--python", help="a Python that has gymnasium and numpy")
    parser.add_argument("--runner", help="a runner binary")
    parser.add_argument("--core", type=int, default=0, help="the core to run on")
    parser.add_argument("--json", help="also write the numbers here")
    return parser


def settle(core):
    """One core and one thread for both sides."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {core})
    for library in ("OMP", "OPENBLAS", "MKL"):
        os.environ[f"{library}_NUM_THREADS"] = "1"


def main():
    parser = arguments(__doc__.splitlines()[0], rounds=5)
    parser.add_argument("--task", choices=TASKS, action="append", help="only this (repeatable)")
    args = parser.parse_args()
    python = args.python or make_python()
    program = args.runner or make_runner()
    settle(args.core)
    with tempfile.TemporaryDirectory() as held:
        # A build that ends meanwhile must not swap the binary between two rounds.
        program = shutil.copy2(program, Path(held) / "runner")
        tasks = args.task or TASKS
        results = [measure(python, program, task, args.rounds) for task in tasks]
    print("| task | NumPy, steps/s | runner, steps/s | training | (range) | process |")
    print("|---|--:|--:|--:|---|--:|")
    for r in results:
        low, high = r["training_ratio_range"]
        print(
            f"| {r['task']} | {r['numpy_steps_per_second'] / 1e3:.1f} k"
            f" | {r['runner_steps_per_second'] / 1e6:.1f} M | x{r['training_ratio']:.0f}"
            f" | x{low:.0f} to x{high:.0f} | x{r['process_ratio']:.0f} |"
        )
    if args.json:
        Path(args.json).write_text(json.dumps(results, indent=2) + "\n")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Compares learning curves of `runner`'s DQN with those of Stable-Baselines3's.

    benches/peers/dqn_curves.py [--seeds 20] [--peer-seeds 10] [--steps 50000] [--episodes 1500]
                                [--theirs CSV] [--ours DIR] [--jobs N] [--python PATH]
                                [--runner PATH] [--json FILE]

CartPole-v1 with equal hyper-parameters (SETTINGS). Both are put on a common grid of environment
steps; the value of a seed at a point is the mean return of the last 20 episodes that ended up to
there, exploration included. Per point the table has the mean over seeds of either side with its
95 % interval (Student's t), and whether the intervals overlap. In the end the mean over the whole
grid, one number a seed, is compared by Welch's interval of the difference. The curves agree if the
intervals overlap at every point and Welch's holds 0; otherwise the exit code is 1.

--theirs takes a file that `sb3_dqn.py curves` wrote before, which saves a minute or two per seed, and
--ours a folder of results of the script that `--print-script` shows.

Both play at random until `learning_starts`, update the target before the gradient step of the same
step, draw minibatches with replacement and start from PyTorch's weights; random streams differ, and
with them the first states of the episodes.
"""

import argparse
import csv
import json
import math
import shutil
import statistics
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

from run import HERE, make_python, make_runner

# By Stable-Baselines3's names; epsilon falls linearly over its first steps.
SETTINGS = {
    "net": [64, 64],
    "learning_rate": 0.00025,
    "buffer": 50_000,
    "learning_starts": 1000,
    "batch": 64,
    "gamma": 0.99,
    "target_update_interval": 250,
    "max_grad_norm": 10.0,
    "epsilon": (1.0, 0.04),
    "epsilon_steps": 8000,
}
WINDOW = 20
POINTS = 20

SCRIPT = """experiment(#{{
    name: "dqn",
    env: "CartPole-v1",
    agent: dqn(#{{
        net_arch: {net},
        learning_rate: {learning_rate},
        buffer_size: {buffer},
        learning_starts: {learning_starts},
        batch_size: {batch},
        gamma: {gamma},
        train_freq: 1,
        gradient_steps: 1,
        target_update_interval: {target_update_interval},
        max_grad_norm: {max_grad_norm},
        loss: "huber",
        replace: true,
        epsilon: linear({epsilon[0]}, {epsilon[1]}, {epsilon_steps}, #{{ steps: true }}),
    }}),
    episodes: {episodes},
    seeds: {seeds},
}})
"""


def read(path):
    """Per seed the episodes as (steps up to their end, return)."""
    seeds = defaultdict(list)
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            seeds[int(row["seed"])].append((int(row["steps"]), float(row["return"])))
    return seeds


def train_theirs(python, args, path):
    """Stable-Baselines3's episodes."""
    command = [python, HERE / "sb3_dqn.py", "curves", "--out", path]
    command += ["--seeds", args.peer_seeds, "--steps", args.steps]
    for name, value in SETTINGS.items():
        if name == "net":
            value = ",".join(map(str, value))
        values = value if isinstance(value, tuple) else [value]
        command += ["--" + name.replace("_", "-"), *values]
    subprocess.run([str(c) for c in command], check=True)


def train_ours(program, args, out):
    path = Path(out) / "curves.rhai"
    path.write_text(SCRIPT.format(**SETTINGS, episodes=args.episodes, seeds=args.seeds))
    results = Path(out) / "results"
    command = [program, "exec", path, "--jobs", args.jobs, "--fresh", "--quiet", "--out", results]
    subprocess.run([str(c) for c in command], check=True)
    return results


def cumulated(path):
    """The same from `episodes.csv`, whose steps are those of one episode."""
    seeds = {}
    for seed, episodes in read(path).items():
        total = 0
        seeds[seed] = [(total := total + steps, ret) for steps, ret in episodes]
    return seeds


def curve(episodes, grid):
    """Mean return of the last episodes at every point of the grid."""
    return [
        statistics.fmean([ret for steps, ret in episodes if steps <= point][-WINDOW:])
        for point in grid
    ]


def curves(seeds, grid, who):
    for seed, episodes in seeds.items():
        # The last episode may reach beyond the end of training, by as much as it is long.
        if episodes[-1][0] < grid[-1] - 500:
            sys.exit(
                f"{who}: seed {seed} played {episodes[-1][0]} steps, but the curves go to"
                f" {grid[-1]}: train more --episodes, or fewer --steps"
            )
    return [curve(episodes, grid) for _, episodes in sorted(seeds.items())]


def student(freedom):
    """97.5 % quantile of Student's t (Abramowitz & Stegun 26.7.5; to 0.001 from 5 on)."""
    z, v = statistics.NormalDist().inv_cdf(0.975), freedom
    terms = [
        (z**3 + z) / 4,
        (5 * z**5 + 16 * z**3 + 3 * z) / 96,
        (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384,
        (79 * z**9 + 776 * z**7 + 1482 * z**5 - 1920 * z**3 - 945 * z) / 92160,
    ]
    return z + sum(term / v**k for k, term in enumerate(terms, 1))


def interval(values):
    """Mean, and Student's 95 % interval."""
    mean = statistics.fmean(values)
    half = student(len(values) - 1) * statistics.stdev(values) / math.sqrt(len(values))
    return mean, mean - half, mean + half


def welch(ours, theirs):
    """Difference of the means, and its 95 % interval."""
    a, b = (statistics.variance(x) / len(x) for x in (ours, theirs))
    freedom = (a + b) ** 2 / (a**2 / (len(ours) - 1) + b**2 / (len(theirs) - 1))
    difference = statistics.fmean(ours) - statistics.fmean(theirs)
    half = student(freedom) * math.sqrt(a + b)
    return difference, difference - half, difference + half


def report(ours, theirs, grid):
    """Prints the table and the verdict; true if the curves agree."""
    print("| steps | runner | 95 % | Stable-Baselines3 | 95 % | overlap |")
    print("|--:|--:|---|--:|---|---|")
    rows = []
    for point, own, peer in zip(grid, zip(*ours), zip(*theirs)):
        (m, low, high), (m2, low2, high2) = interval(own), interval(peer)
        overlap = low <= high2 and low2 <= high
        rows.append({"steps": point, "runner": (m, low, high), "sb3": (m2, low2, high2),
                     "overlap": overlap})
        print(
            f"| {point} | {m:.0f} | {low:.0f} to {high:.0f} | {m2:.0f} | {low2:.0f} to {high2:.0f}"
            f" | {'yes' if overlap else 'no'} |"
        )
    own, peer = ([statistics.fmean(c) for c in side] for side in (ours, theirs))
    difference, low, high = welch(own, peer)
    met = sum(row["overlap"] for row in rows)
    agree = met == len(rows) and low <= 0 <= high
    print(
        f"\n{len(ours)} seeds of runner, {len(theirs)} of Stable-Baselines3: the intervals overlap"
        f" at {met} of {len(rows)} points.\nMean over the grid: {statistics.fmean(own):.1f} and"
        f" {statistics.fmean(peer):.1f}, difference {difference:+.1f}, 95 % {low:+.1f} to"
        f" {high:+.1f}.\nThe curves {'agree' if agree else 'do NOT agree'}."
    )
    return agree, {"points": rows, "difference": (difference, low, high), "agree": agree}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--python", help="a Python that has gymnasium, torch, stable_baselines3")
    parser.add_argument("--runner", help="a runner binary")
    parser.add_argument("--seeds", type=int, default=20, help="of runner")
    parser.add_argument("--peer-seeds", type=int, default=10, help="of Stable-Baselines3")
    parser.add_argument("--steps", type=int, default=50_000, help="of the environment, per seed")
    parser.add_argument("--episodes", type=int, default=1500, help="of runner, enough for --steps")
    parser.add_argument("--jobs", type=int, default=1, help="of runner")
    parser.add_argument("--theirs", help="a CSV of sb3_dqn.py, instead of training")
    parser.add_argument("--ours", help="a results folder of runner, instead of training")
    parser.add_argument("--json", help="also write the numbers here")
    parser.add_argument("--print-script", action="store_true", help="show runner's script and stop")
    args = parser.parse_args()
    if args.print_script:
        print(SCRIPT.format(**SETTINGS, episodes=args.episodes, seeds=args.seeds), end="")
        return 0
    grid = [args.steps * k // POINTS for k in range(1, POINTS + 1)]
    with tempfile.TemporaryDirectory() as folder:
        results = args.ours
        if not results:
            program = shutil.copy2(args.runner or make_runner(), Path(folder) / "runner")
            results = train_ours(program, args, folder)
        own = curves(cumulated(Path(results) / "episodes.csv"), grid, "runner")
        theirs = args.theirs
        if not theirs:
            theirs = Path(folder) / "sb3.csv"
            python = args.python or make_python("peers-dqn-venv", "requirements-dqn.txt")
            train_theirs(python, args, theirs)
        peer = curves(read(theirs), grid, "Stable-Baselines3")
    if min(len(own), len(peer)) < 5:
        sys.exit("at least 5 seeds on either side, or the intervals say nothing")
    agree, result = report(own, peer, grid)
    if args.json:
        Path(args.json).write_text(json.dumps(result | {"settings": SETTINGS}, indent=2) + "\n")
    return 0 if agree else 1


if __name__ == "__main__":
    sys.exit(main())

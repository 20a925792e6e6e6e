#!/usr/bin/env python3
"""Measures every tabular control algorithm against the NumPy loop of the same algorithm.

    benches/peers/control.py [--rounds 3] [--python PATH] [--runner PATH] [--core N]
                             [--agent NAME ..] [--json FILE]

On FrozenLake 8x8 (200 steps an episode) and Taxi, both sides with the same parameters, one after
the other, on one and the same core. NumPy plays for about three seconds; `runner` plays as many
episodes per seed as NumPy did, over as many seeds as take it about a second. A round gives one
ratio of steps per second of the training loops; the table shows medians, and the smallest and
largest ratio.
"""

import json
import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from run import HERE, arguments, make_python, make_runner, settle

ENVIRONMENTS = {
    "frozen_lake": ('env("FrozenLake-v1", #{ map_name: "8x8" })', 200),
    "taxi": ('"Taxi-v4"', 200),
}

# agent: the parameters of numpy_control.py, and how many seeds to play.
COMMON = "gamma: 0.99"
RATE = f"alpha: 0.1, {COMMON}"
GREEDY = f"{RATE}, epsilon: 0.1"
AGENTS = {
    "q_learning": GREEDY,
    "sarsa": GREEDY,
    "expected_sarsa": GREEDY,
    "double_q_learning": GREEDY,
    "n_step_sarsa": f"{GREEDY}, n: 4",
    "sarsa_lambda": f"{GREEDY}, lambda: 0.9",
    "q_lambda": f"{GREEDY}, lambda: 0.9",
    "dyna_q": f"{GREEDY}, planning_steps: 5",
    "soft_q_learning": f"{RATE}, temperature: 0.1",
    "monte_carlo": f"{COMMON}, epsilon: 0.1",
    "off_policy_monte_carlo": f"{COMMON}, epsilon: 0.1",
}
SEEDS = 100


def peer(python, task, agent):
    """The NumPy loop: episodes, steps/s."""
    command = [python, HERE / "numpy_control.py", task, agent]
    done = subprocess.run([str(c) for c in command], check=True, stdout=subprocess.PIPE)
    result = json.loads(done.stdout)
    return result["episodes"], result["steps_per_second"]


def runner(program, task, agent, episodes):
    """The same for `runner exec`: steps/s."""
    env, max_steps = ENVIRONMENTS[task]
    script = f"""experiment(#{{
    env: {env},
    agent: {agent}(#{{ {AGENTS[agent]} }}),
    max_steps: {max_steps},
    episodes: {episodes},
    seeds: {SEEDS},
}})
"""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "control.rhai"
        path.write_text(script)
        out = Path(folder) / "out"
        command = [program, "exec", path, "--jobs", 1, "--fresh", "--quiet", "--out", out]
        subprocess.run([str(c) for c in command], check=True)
        # One entry per unit: steps, and seconds of training.
        units = json.loads((out / "timing.json").read_text()).values()
    steps, seconds = (sum(unit[i] for unit in units) for i in (0, 1))
    return steps / seconds


def main():
    parser = arguments(__doc__.splitlines()[0], rounds=3)
    parser.add_argument("--agent", choices=AGENTS, action="append", help="only this (repeatable)")
    args = parser.parse_args()
    python = args.python or make_python()
    program = args.runner or make_runner()
    settle(args.core)
    print("| agent | task | NumPy, steps/s | runner, steps/s | ratio | (range) |")
    print("|---|---|--:|--:|--:|---|")
    results = []
    with tempfile.TemporaryDirectory() as held:
        # A build that ends meanwhile must not swap the binary between two rounds.
        program = shutil.copy2(program, Path(held) / "runner")
        for agent in args.agent or AGENTS:
            for task in ENVIRONMENTS:
                rounds = []
                for _ in range(args.rounds):
                    episodes, theirs = peer(python, task, agent)
                    ours = runner(program, task, agent, episodes)
                    rounds.append((theirs, ours, ours / theirs))
                theirs, ours, ratio = (statistics.median(column) for column in zip(*rounds))
                low, high = (f(row[2] for row in rounds) for f in (min, max))
                print(
                    f"| `{agent}` | {task} | {theirs / 1e3:.1f} k | {ours / 1e6:.1f} M"
                    f" | x{ratio:.0f} | x{low:.0f} to x{high:.0f} |",
                    flush=True,
                )
                results.append({"agent": agent, "task": task, "numpy": theirs, "runner": ours,
                                "ratio": ratio, "range": [low, high]})
    if args.json:
        Path(args.json).write_text(json.dumps(results, indent=2) + "\n")


if __name__ == "__main__":
    sys.exit(main())

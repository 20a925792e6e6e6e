#!/usr/bin/env python3
"""Steps per second of every environment: runner against Gymnasium and EnvPool, in one run.

    benches/peers/steps.py [--rounds 3] [--seconds 1] [--python PATH] [--core N] [--id ID] [--json FILE]

One core, random actions drawn beforehand, resets included. Gymnasium steps one instance as
`gymnasium.make` returns it. EnvPool steps a batch on one thread, the fastest of 1, 16, 64 and 256
instances. runner steps one instance, and 1024 in turn. Each round measures all of them one after
the other; the table shows medians over the rounds.

Without --python a virtual environment is made under target/ from requirements.txt.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

from run import make_python

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent

# Gymnasium's id: EnvPool's, if it has one.
IDS = {
    "FrozenLake-v1": "FrozenLake-v1",
    "FrozenLake8x8-v1": "FrozenLake8x8-v1",
    "Taxi-v4": "Taxi-v3",
    "CliffWalking-v1": "CliffWalking-v1",
    "CliffWalkingSlippery-v1": "CliffWalkingSlippery-v1",
    "Blackjack-v1": "Blackjack-v1",
    "CartPole-v1": "CartPole-v1",
    "MountainCar-v0": "MountainCar-v0",
    "MountainCarContinuous-v0": "MountainCarContinuous-v0",
    "Acrobot-v1": "Acrobot-v1",
    "Pendulum-v1": "Pendulum-v1",
    "LunarLander-v3": "LunarLander-v3",
    "LunarLanderContinuous-v3": "LunarLanderContinuous-v3",
}


def gymnasium_rate(id, seconds):
    import gymnasium

    env = gymnasium.make(id)
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(4096)]
    env.reset(seed=0)
    done, start = 0, time.perf_counter()
    while True:
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()
        done += len(actions)
        took = time.perf_counter() - start
        if took >= seconds:
            return done / took


def gymnasium_vector_rate(seconds):
    import gymnasium
    import numpy as np

    lanes = 1024
    env = gymnasium.make_vec("CartPole-v1", num_envs=lanes, vectorization_mode="vector_entry_point")
    actions = np.random.default_rng(0).integers(0, 2, (64, lanes))
    env.reset(seed=0)
    done, start = 0, time.perf_counter()
    while True:
        for row in actions:
            env.step(row)
        done += actions.size
        took = time.perf_counter() - start
        if took >= seconds:
            return done / took


def envpool_rate(id, seconds):
    import envpool
    import numpy as np

    best = 0.0
    for lanes in (1, 16, 64, 256):
        env = envpool.make(id, env_type="gymnasium", num_envs=lanes, num_threads=1, seed=0)
        space = env.action_space
        space.seed(0)
        rows = [np.array([space.sample() for _ in range(lanes)]) for _ in range(64)]
        env.reset()
        done, start = 0, time.perf_counter()
        while True:
            # Finished instances are reset by the pool itself.
            for row in rows:
                env.step(row)
            done += len(rows) * lanes
            took = time.perf_counter() - start
            if took >= seconds / 2:
                break
        best = max(best, done / took)
    return best


def measure_peer(args):
    """Runs in the peers' Python: prints one rate."""
    kind, id, seconds = args
    if kind == "gymnasium":
        rate = gymnasium_rate(id, float(seconds))
    elif kind == "vector":
        rate = gymnasium_vector_rate(float(seconds))
    else:
        rate = envpool_rate(id, float(seconds))
    print(json.dumps(rate))


def peer(python, *what):
    command = [str(python), str(Path(__file__).resolve()), "--peer", *map(str, what)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if done.returncode != 0:
        print(f"{what[0]} cannot play {what[1]}: {done.stderr.strip().splitlines()[-1]}", file=sys.stderr)
        return None
    return json.loads(done.stdout.splitlines()[-1])


def bench():
    """The benchmark's executable."""
    command = ["cargo", "bench", "--bench", "env_steps", "--no-run", "--message-format=json"]
    built = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True)
    for line in built.stdout.splitlines():
        message = json.loads(line)
        if message.get("target", {}).get("name") == "env_steps" and message.get("executable"):
            return message["executable"]
    raise SystemExit("cargo built no env_steps")


def ours(program, id, seconds):
    command = [program, "--id", id, "--seconds", str(seconds)]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    return {r["lanes"]: r["steps_per_second"] for r in map(json.loads, done.stdout.splitlines())}


def si(x):
    if x is None:
        return ""
    return f"{x / 1e6:.1f} M" if x >= 1e6 else f"{x / 1e3:.1f} k"


def ratio(a, b):
    return "" if a is None or b is None else f"×{a / b:.0f}" if a >= 10 * b else f"×{a / b:.1f}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=1.0)
    parser.add_argument("--python")
    parser.add_argument("--core", type=int, default=0)
    parser.add_argument("--id", choices=IDS, action="append")
    parser.add_argument("--json")
    parser.add_argument("--peer", nargs="+", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.peer:
        kind, *rest = args.peer
        return measure_peer([kind, rest[0], rest[1]])
    python, program = args.python or make_python(), bench()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {args.core})
    rates = {}
    for round in range(args.rounds):
        for id in args.id or IDS:
            row = rates.setdefault(id, {"gymnasium": [], "envpool": [], "one": [], "lanes": [], "vector": []})
            row["gymnasium"].append(peer(python, "gymnasium", id, args.seconds))
            own = ours(program, id, args.seconds)
            row["one"].append(own[1])
            row["lanes"].append(own[1024])
            row["envpool"].append(peer(python, "envpool", IDS[id], args.seconds))
            if id == "CartPole-v1":
                row["vector"].append(peer(python, "vector", id, args.seconds))
        print(f"round {round + 1} of {args.rounds}", file=sys.stderr)
    medians = {
        id: {k: statistics.median(v) if v and None not in v else None for k, v in row.items()}
        for id, row in rates.items()
    }
    print("| environment | Gymnasium | EnvPool | runner | of Gymnasium | of EnvPool | 1024 in turn |")
    print("|---|--:|--:|--:|--:|--:|--:|")
    for id, m in medians.items():
        cells = [id, si(m["gymnasium"]), si(m["envpool"]), si(m["one"])]
        cells += [ratio(m["one"], m["gymnasium"]), ratio(m["one"], m["envpool"]), si(m["lanes"])]
        print("| " + " | ".join(cells) + " |")
    vector = medians.get("CartPole-v1", {}).get("vector")
    if vector:
        lanes = medians["CartPole-v1"]["lanes"]
        print(f"\nGymnasium's vector class of CartPole, 1024 lanes: {si(vector)}; runner's 1024 in turn: {ratio(lanes, vector)}")
    if args.json:
        Path(args.json).write_text(json.dumps(rates, indent=1))


if __name__ == "__main__":
    main()

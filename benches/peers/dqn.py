#!/usr/bin/env python3
"""Measures DQN of `runner exec` against PyTorch and Stable-Baselines3, in one go.

    benches/peers/dqn.py [--rounds 3] [--net 24,24 ..] [--clock wall|cpu] [--peak GFLOPS]
                         [--python PATH] [--runner PATH] [--core N] [--json FILE]

CartPole-v1, minibatches of 64 drawn with replacement from a buffer of 2000, one gradient step per
environment step, Adam, a target copied every 500 steps, a constant epsilon of 0.1: the same on all
sides, which play one after the other on one and the same core with one thread. PyTorch comes in
three kinds (torch_dqn.py says which); Stable-Baselines3 clips gradients and has Huber's loss, as it
always does (sb3_dqn.py). The first table has microseconds per environment step, everything
included; the second those of a gradient step alone, which peers time in a loop of their own and
`runner` as a third of what `gradient_steps: 4` adds to a step. Medians over the rounds; a ratio
is the median of the rounds' ratios.

--clock cpu takes CPU time instead of wall time, for a machine with other work on it. It is harder
on `runner`, whose start, result files and progress thread it counts too.

The work of a gradient step, in floating-point operations, for layers of n_0, .., n_L units and B
transitions, with M = sum of n_i n_(i+1):

    forward, online    2 B M
    forward, target    2 B M
    backward, weights  2 B M
    backward, inputs   2 B (M - n_0 n_1)     the observation needs no gradient

Biases, activations, the loss and Adam are left out. --peak GFLOPS is what the machine can do on one
core in float32; the second table then says which share of it is reached.
"""

import json
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from run import HERE, arguments, make_python, make_runner, settle

BATCH = 64
BUFFER = 2000
OBSERVATIONS, ACTIONS = 4, 2

# net: steps of a peer, episodes of runner.
NETS = {"24,24": (4000, 800), "64,64": (3000, 500), "256,256": (2000, 100)}
PEERS = {
    "PyTorch eager": ["torch_dqn.py", "--variant", "eager"],
    "PyTorch flat": ["torch_dqn.py", "--variant", "flat"],
    "PyTorch compiled": ["torch_dqn.py", "--variant", "compiled"],
    "SB3": ["sb3_dqn.py", "speed"],
}


def flops(net):
    """Floating-point operations of a gradient step."""
    units = [OBSERVATIONS, *map(int, net.split(",")), ACTIONS]
    weights = sum(a * b for a, b in zip(units, units[1:]))
    return 2 * BATCH * (4 * weights - units[0] * units[1])


def peer(python, name, net, clock):
    """Microseconds per step, and per gradient step; nothing if it cannot run here."""
    program, *options = PEERS[name]
    steps, _ = NETS[net]
    command = [python, HERE / program, *options, "--net", net, "--batch", BATCH]
    command += ["--buffer", BUFFER, "--steps", steps]
    pipe = subprocess.PIPE
    done = subprocess.run([str(c) for c in command], stdout=pipe, stderr=pipe, text=True)
    if done.returncode != 0:
        why = done.stderr.strip().splitlines()[-1:]
        print(f"  {name} did not run: {' '.join(why)}", file=sys.stderr)
        return None
    result = json.loads(done.stdout.splitlines()[-1])
    prefix = "cpu_" if clock == "cpu" else ""
    return tuple(result[f"{prefix}microseconds_per_{what}"] for what in ("step", "gradient_step"))


def play(program, net, gradient_steps, clock):
    """Microseconds per step of `runner exec`."""
    _, episodes = NETS[net]
    script = f"""experiment(#{{
    env: "CartPole-v1",
    agent: dqn(#{{
        net_arch: [{net}],
        learning_rate: 0.001,
        gamma: 0.99,
        batch_size: {BATCH},
        buffer_size: {BUFFER},
        replace: true,
        train_freq: 1,
        gradient_steps: {gradient_steps},
        target_update_interval: 500,
        max_grad_norm: "none",
        loss: "mse",
        epsilon: 0.1,
    }}),
    episodes: {max(episodes // gradient_steps, 1)},
    seeds: 1,
}})
"""
    with tempfile.TemporaryDirectory() as folder:
        path, out = Path(folder) / "dqn.rhai", Path(folder) / "out"
        path.write_text(script)
        command = [program, "exec", path, "--jobs", 1, "--fresh", "--quiet", "--out", out]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([str(c) for c in command], check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        # One entry per unit: steps, and seconds of training.
        units = json.loads((out / "timing.json").read_text()).values()
    steps, seconds = (sum(unit[i] for unit in units) for i in (0, 1))
    if clock == "cpu":
        seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return seconds / steps * 1e6


def ours(program, net, clock):
    """Microseconds per step, and per gradient step."""
    one, four = (play(program, net, n, clock) for n in (1, 4))
    return one, (four - one) / 3


def measure(python, program, net, args):
    """Alternates; returns the rounds' (per step, per gradient step) of everyone."""
    rounds = {name: [] for name in [*PEERS, "runner"]}
    for _ in range(args.rounds):
        for name in PEERS:
            if (found := peer(python, name, net, args.clock)) is not None:
                rounds[name].append(found)
        if program:
            rounds["runner"].append(ours(program, net, args.clock))
        line = ", ".join(f"{name} {rows[-1][0]:.1f}" for name, rows in rounds.items() if rows)
        print(f"  {net}: {line}", file=sys.stderr)
    return rounds


def median(rows, which):
    return statistics.median(row[which] for row in rows) if rows else None


def row(net, rounds, which):
    """A line of a table: medians, and how many times as long the peers take."""
    cells = [net.replace(",", "/")]
    for rows in rounds.values():
        cells.append(f"{median(rows, which):.1f}" if rows else "")
    own = [r[which] for r in rounds["runner"]]
    for name in PEERS:
        ratios = [theirs[which] / mine for theirs, mine in zip(rounds[name], own)]
        cells.append(f"×{statistics.median(ratios):.1f}" if ratios else "")
    return cells


def table(head, rows):
    print("| " + " | ".join(head) + " |")
    print("|---|" + "--:|" * (len(head) - 1))
    for cells in rows:
        print("| " + " | ".join(cells) + " |")


def work(net, rounds, peak):
    """Operations of a gradient step, and how fast `runner` does them."""
    cells = [f"{flops(net):,}"]
    if (own := median(rounds["runner"], 1)) is None:
        return cells + [""] * (1 + bool(peak))
    rate = flops(net) / own / 1e3
    cells.append(f"{rate:.1f}")
    return cells + ([f"{rate / peak:.0%}"] if peak else [])


def main():
    parser = arguments(__doc__.splitlines()[0], rounds=3)
    parser.add_argument("--net", choices=NETS, action="append", help="only this (repeatable)")
    parser.add_argument("--clock", choices=["wall", "cpu"], default="wall")
    parser.add_argument("--peak", type=float, help="GFLOP/s of one core, float32")
    parser.add_argument("--peers-only", action="store_true", help="leave runner out")
    args = parser.parse_args()
    python = args.python or make_python("peers-dqn-venv", "requirements-dqn.txt")
    program = None if args.peers_only else args.runner or make_runner()
    settle(args.core)
    with tempfile.TemporaryDirectory() as held:
        if program:
            # A build that ends meanwhile must not swap the binary between two rounds.
            program = shutil.copy2(program, Path(held) / "runner")
        results = {net: measure(python, program, net, args) for net in args.net or NETS}
    names = [*PEERS, "runner"]
    ratios = [f"of {name}" for name in PEERS]
    print(f"Microseconds per environment step ({args.clock} time):\n")
    table(["net", *names, *ratios], [row(net, r, 0) for net, r in results.items()])
    print("\nMicroseconds per gradient step, its floating-point operations, and runner's GFLOP/s:\n")
    head = ["net", *names, *ratios, "operations", "GFLOP/s"] + (["of peak"] if args.peak else [])
    table(head, [row(net, r, 1) + work(net, r, args.peak) for net, r in results.items()])
    if args.json:
        Path(args.json).write_text(json.dumps(results, indent=2) + "\n")


if __name__ == "__main__":
    main()

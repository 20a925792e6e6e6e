#!/usr/bin/env python3
"""DQN of Stable-Baselines3 on CartPole-v1: its speed, and its learning curves.

    benches/peers/sb3_dqn.py speed  [--net 24,24] [--batch 64] [--buffer 2000] [--steps N]
    benches/peers/sb3_dqn.py curves --out FILE [--seeds 6] [--steps 50000] [--net 64,64] ..

`speed` is the peer of `dqn.py`: one gradient step per environment step, a target copied every 500
steps, a constant epsilon of 0.1, on one thread. It times `learn` after a warm-up that fills the
buffer, and then `train` alone, which is a gradient step: sample, forward, target, backward, clip,
Adam. Prints one line of JSON. Everything else is as the library has it, its logger included, which
is silent (no format to write to).

`curves` is the peer of `dqn_curves.py`: trains seed after seed and writes every episode as
`seed,episode,steps,return`, where `steps` counts the environment's steps up to its end. Epsilon
falls linearly over the first `--epsilon-steps`. What the library has decided: a minibatch is drawn
with replacement; the loss is Huber's (`smooth_l1`), the mean over the batch; Adam with eps 1e-8;
the gradient is clipped to a norm of `--max-grad-norm`; a time limit does not end the bootstrapping;
the first `--learning-starts` actions are random whatever epsilon says; the target is copied when the
number of steps divides by the interval, before the gradient step of that step.
"""

import argparse
import csv
import json
import sys
import time

import gymnasium as gym
import torch
from stable_baselines3 import DQN
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.monitor import Monitor

from torch_dqn import timed

WARM_UP = 500


def widths(text):
    return [int(n) for n in text.split(",")]


def speed(args):
    env = Monitor(gym.make("CartPole-v1", disable_env_checker=True))
    model = DQN(
        "MlpPolicy",
        env,
        learning_rate=1e-3,
        buffer_size=args.buffer,
        learning_starts=args.batch,
        batch_size=args.batch,
        gamma=0.99,
        train_freq=1,
        gradient_steps=1,
        target_update_interval=500,
        exploration_initial_eps=0.1,
        exploration_final_eps=0.1,
        policy_kwargs={"net_arch": widths(args.net)},
        seed=args.seed,
        device="cpu",
    )
    model.set_logger(Logger(folder=None, output_formats=[]))
    model.learn(args.buffer + WARM_UP)
    steps = args.steps
    seconds, cpu = timed(lambda: model.learn(steps, reset_num_timesteps=False))
    gradient, gradient_cpu = timed(
        lambda: [model.train(gradient_steps=1, batch_size=args.batch) for _ in range(steps)]
    )
    result = {
        "net": args.net,
        "batch": args.batch,
        "steps": steps,
        "seconds": seconds,
        "cpu_seconds": cpu,
        "steps_per_second": steps / seconds,
        "microseconds_per_step": seconds / steps * 1e6,
        "cpu_microseconds_per_step": cpu / steps * 1e6,
        "microseconds_per_gradient_step": gradient / steps * 1e6,
        "cpu_microseconds_per_gradient_step": gradient_cpu / steps * 1e6,
    }
    print(json.dumps(result))


def curves(args):
    with open(args.out, "w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["seed", "episode", "steps", "return"])
        for seed in range(args.first_seed, args.first_seed + args.seeds):
            start = time.perf_counter()
            env = Monitor(gym.make("CartPole-v1"))
            model = DQN(
                "MlpPolicy",
                env,
                learning_rate=args.learning_rate,
                buffer_size=args.buffer,
                learning_starts=args.learning_starts,
                batch_size=args.batch,
                gamma=args.gamma,
                train_freq=1,
                gradient_steps=1,
                target_update_interval=args.target_update_interval,
                exploration_fraction=args.epsilon_steps / args.steps,
                exploration_initial_eps=args.epsilon[0],
                exploration_final_eps=args.epsilon[1],
                max_grad_norm=args.max_grad_norm,
                policy_kwargs={"net_arch": widths(args.net)},
                seed=seed,
                device="cpu",
            )
            model.learn(args.steps)
            total, returns = 0, env.get_episode_rewards()
            for episode, (length, ret) in enumerate(zip(env.get_episode_lengths(), returns), 1):
                total += length
                rows.writerow([seed, episode, total, f"{ret:g}"])
            file.flush()
            last = sum(returns[-20:]) / len(returns[-20:])
            took = time.perf_counter() - start
            print(f"  seed {seed}: last 20 episodes {last:.0f}, {took:.0f} s", file=sys.stderr)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(required=True)
    one = commands.add_parser("speed")
    one.set_defaults(run=speed)
    one.add_argument("--net", default="24,24")
    one.add_argument("--buffer", type=int, default=2000)
    one.add_argument("--steps", type=int, default=5000)
    one.add_argument("--seed", type=int, default=0)
    many = commands.add_parser("curves")
    many.set_defaults(run=curves)
    many.add_argument("--out", required=True)
    many.add_argument("--seeds", type=int, default=6)
    many.add_argument("--first-seed", type=int, default=0)
    many.add_argument("--steps", type=int, default=50_000)
    many.add_argument("--net", default="64,64")
    many.add_argument("--buffer", type=int, default=50_000)
    many.add_argument("--learning-rate", type=float, default=2.5e-4)
    many.add_argument("--learning-starts", type=int, default=1000)
    many.add_argument("--gamma", type=float, default=0.99)
    many.add_argument("--target-update-interval", type=int, default=250)
    many.add_argument("--epsilon", type=float, nargs=2, default=[1.0, 0.04])
    many.add_argument("--epsilon-steps", type=int, default=8000)
    many.add_argument("--max-grad-norm", type=float, default=10.0)
    for command in (one, many):
        command.add_argument("--batch", type=int, default=64)
    args = parser.parse_args()
    torch.set_num_threads(1)
    args.run(args)


if __name__ == "__main__":
    main()

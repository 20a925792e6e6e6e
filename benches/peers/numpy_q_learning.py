"""Tabular Q-learning as a course's notebook writes it: Gymnasium steps, NumPy holds the table.

The peer that `runner` is measured against. Plain code, one process, no trick for or against it:
`linspace` and `digitize` for the bins, a NumPy array for Q, epsilon-greedy from one generator.
Prints one line of JSON: what was played, and steps per second of the training loop alone
(imports and the making of the environment are not counted).
"""

import argparse
import json
import time

import gymnasium as gym
import numpy as np

ALPHA = 0.1
GAMMA = 0.99
EPSILON = 0.1


def cartpole():
    """CartPole-v1 with 12 x 12 x 24 x 24 bins, as in cartpole.rhai."""
    low, high = (-2.4, -3.0, -0.5, -2.0), (2.4, 3.0, 0.5, 2.0)
    shape = (12, 12, 24, 24)
    edges = [np.linspace(lo, hi, n + 1) for lo, hi, n in zip(low, high, shape)]

    def discretise(observation):
        return tuple(
            min(max(int(np.digitize(x, e)) - 1, 0), n - 1)
            for x, e, n in zip(observation, edges, shape)
        )

    return gym.make("CartPole-v1"), shape, discretise, None, None


def cartpole_scripted():
    """The same with a potential and a reward of its own, as in cartpole_scripted.rhai."""
    env, shape, discretise, *_ = cartpole()

    def potential(observation):
        _, _, theta, theta_dot = observation
        return -20.0 * abs(theta) - 2.0 * abs(theta_dot + 4.0 * theta)

    def paid(reward, observation, terminated):
        if terminated:
            return -1.0
        return reward - 0.5 if abs(observation[0]) > 1.2 else reward

    return env, shape, discretise, potential, paid


def frozen_lake():
    """FrozenLake-v1 8x8 with 200 steps an episode, as in frozen_lake.rhai."""
    env = gym.make("FrozenLake-v1", map_name="8x8", max_episode_steps=200)
    return env, (env.observation_space.n,), lambda observation: observation, None, None


def frozen_lake_shaped():
    """The same with a distance potential, as in frozen_lake_shaped.rhai."""
    env, shape, discretise, *_ = frozen_lake()

    def potential(observation):
        row, col = divmod(observation, 8)
        return 1.0 - 0.05 * (abs(row - 7) + abs(col - 7))

    return env, shape, discretise, potential, None


def train(env, shape, discretise, potential, paid, episodes, seed):
    """Plays `episodes` episodes; returns the number of steps."""
    rng = np.random.default_rng(seed)
    n_actions = int(env.action_space.n)
    q = np.zeros(shape + (n_actions,))
    steps = 0
    observation, _ = env.reset(seed=seed)
    for _ in range(episodes):
        state = discretise(observation)
        phi = potential(observation) if potential else 0.0
        done = False
        while not done:
            if rng.random() < EPSILON:
                action = int(rng.integers(n_actions))
            else:
                action = int(np.argmax(q[state]))
            observation, reward, terminated, truncated, _ = env.step(action)
            next_state = discretise(observation)
            if paid:
                reward = paid(reward, observation, terminated)
            if potential:
                phi_next = 0.0 if terminated else potential(observation)
                reward += GAMMA * phi_next - phi
                phi = phi_next
            target = reward if terminated else reward + GAMMA * np.max(q[next_state])
            q[state][action] += ALPHA * (target - q[state][action])
            state = next_state
            done = terminated or truncated
            steps += 1
        observation, _ = env.reset()
    return steps


TASKS = {f.__name__: f for f in (cartpole, cartpole_scripted, frozen_lake, frozen_lake_shaped)}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("task", choices=TASKS)
    parser.add_argument("--episodes", type=int, required=True)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    task = TASKS[args.task]()
    start, cpu_start = time.perf_counter(), time.process_time()
    steps = train(*task, args.episodes, args.seed)
    seconds, cpu_seconds = time.perf_counter() - start, time.process_time() - cpu_start
    print(
        json.dumps(
            {
                "task": args.task,
                "episodes": args.episodes,
                "steps": steps,
                "seconds": seconds,
                "cpu_seconds": cpu_seconds,
                "steps_per_second": steps / seconds,
                "gymnasium": gym.__version__,
                "numpy": np.__version__,
            }
        )
    )


if __name__ == "__main__":
    main()

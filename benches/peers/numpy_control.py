"""Tabular control algorithms as a course's notebook writes them: Gymnasium steps, NumPy tables.

The peers of `control.py`. One plain loop per algorithm, in the update order of Sutton & Barto,
with no trick for or against it; NumPy's whole-array operations where a notebook would use them
(traces decay and update in one line each). Prints one line of JSON: what was played, and steps
per second of the training loop alone.
"""

import argparse
import json
import time

import gymnasium as gym
import numpy as np

ALPHA = 0.1
GAMMA = 0.99
EPSILON = 0.1
LAMBDA = 0.9
N = 4
PLANNING_STEPS = 5
TEMPERATURE = 0.1

ENVIRONMENTS = {
    "frozen_lake": lambda: gym.make("FrozenLake-v1", map_name="8x8", max_episode_steps=200),
    "taxi": lambda: gym.make("Taxi-v4"),
}


class Learner:
    """A table, and epsilon-greedy choice from it."""

    def __init__(self, n_states, n_actions, rng):
        self.q = np.zeros((n_states, n_actions))
        self.n_actions = n_actions
        self.rng = rng

    def begin(self, state):
        return self.choose(state)

    def choose(self, state):
        if self.rng.random() < EPSILON:
            return int(self.rng.integers(self.n_actions))
        return int(np.argmax(self.q[state]))

    def probabilities(self, state):
        p = np.full(self.n_actions, EPSILON / self.n_actions)
        p[np.argmax(self.q[state])] += 1 - EPSILON
        return p

    def end_episode(self):
        pass


class QLearning(Learner):
    def step(self, s, a, r, s2, terminated):
        target = r if terminated else r + GAMMA * np.max(self.q[s2])
        self.q[s, a] += ALPHA * (target - self.q[s, a])
        return self.choose(s2)


class Sarsa(Learner):
    def step(self, s, a, r, s2, terminated):
        a2 = self.choose(s2)
        target = r if terminated else r + GAMMA * self.q[s2, a2]
        self.q[s, a] += ALPHA * (target - self.q[s, a])
        return a2


class ExpectedSarsa(Learner):
    def step(self, s, a, r, s2, terminated):
        expected = 0.0 if terminated else np.dot(self.probabilities(s2), self.q[s2])
        self.q[s, a] += ALPHA * (r + GAMMA * expected - self.q[s, a])
        return self.choose(s2)


class DoubleQLearning(Learner):
    def __init__(self, n_states, n_actions, rng):
        super().__init__(n_states, n_actions, rng)
        self.q1 = np.zeros((n_states, n_actions))
        self.q2 = np.zeros((n_states, n_actions))

    def choose(self, state):
        if self.rng.random() < EPSILON:
            return int(self.rng.integers(self.n_actions))
        return int(np.argmax(self.q1[state] + self.q2[state]))

    def step(self, s, a, r, s2, terminated):
        first, second = (self.q1, self.q2) if self.rng.random() < 0.5 else (self.q2, self.q1)
        target = r if terminated else r + GAMMA * second[s2, np.argmax(first[s2])]
        first[s, a] += ALPHA * (target - first[s, a])
        return self.choose(s2)


class NStepSarsa(Learner):
    def begin(self, state):
        self.states, self.actions, self.rewards = [state], [self.choose(state)], []
        return self.actions[0]

    def update(self, tau, bootstrap):
        rewards = self.rewards[tau:tau + N]
        target = sum(GAMMA**i * r for i, r in enumerate(rewards))
        if bootstrap:
            target += GAMMA**N * self.q[self.states[tau + N], self.actions[tau + N]]
        s, a = self.states[tau], self.actions[tau]
        self.q[s, a] += ALPHA * (target - self.q[s, a])

    def step(self, s, a, r, s2, terminated):
        self.rewards.append(r)
        a2 = self.choose(s2)
        self.states.append(s2)
        self.actions.append(a2)
        tau = len(self.rewards) - N
        if tau >= 0:
            self.update(tau, not terminated)
        return a2

    def end_episode(self):
        for tau in range(max(len(self.rewards) - N + 1, 0), len(self.rewards)):
            self.update(tau, False)


class SarsaLambda(Learner):
    def begin(self, state):
        self.e = np.zeros_like(self.q)
        return self.choose(state)

    def step(self, s, a, r, s2, terminated):
        a2 = self.choose(s2)
        target = r if terminated else r + GAMMA * self.q[s2, a2]
        delta = target - self.q[s, a]
        self.e[s, a] += 1
        self.q += ALPHA * delta * self.e
        self.e *= GAMMA * LAMBDA
        return a2


class QLambda(SarsaLambda):
    def step(self, s, a, r, s2, terminated):
        a2 = self.choose(s2)
        greedy = int(np.argmax(self.q[s2]))
        if self.q[s2, a2] == self.q[s2, greedy]:
            greedy = a2
        target = r if terminated else r + GAMMA * self.q[s2, greedy]
        delta = target - self.q[s, a]
        self.e[s, a] += 1
        self.q += ALPHA * delta * self.e
        if a2 == greedy:
            self.e *= GAMMA * LAMBDA
        else:
            self.e[:] = 0
        return a2


class DynaQ(QLearning):
    def __init__(self, n_states, n_actions, rng):
        super().__init__(n_states, n_actions, rng)
        self.model = {}
        self.seen = []

    def step(self, s, a, r, s2, terminated):
        target = r if terminated else r + GAMMA * np.max(self.q[s2])
        self.q[s, a] += ALPHA * (target - self.q[s, a])
        if (s, a) not in self.model:
            self.seen.append((s, a))
        self.model[s, a] = r, s2, terminated
        for _ in range(PLANNING_STEPS):
            ps, pa = self.seen[int(self.rng.integers(len(self.seen)))]
            pr, ps2, pt = self.model[ps, pa]
            target = pr if pt else pr + GAMMA * np.max(self.q[ps2])
            self.q[ps, pa] += ALPHA * (target - self.q[ps, pa])
        return self.choose(s2)


class SoftQLearning(Learner):
    def choose(self, state):
        z = self.q[state] / TEMPERATURE
        p = np.exp(z - np.max(z))
        p /= p.sum()
        return int(self.rng.choice(self.n_actions, p=p))

    def step(self, s, a, r, s2, terminated):
        z = self.q[s2] / TEMPERATURE
        top = np.max(z)
        soft = TEMPERATURE * (top + np.log(np.sum(np.exp(z - top))))
        target = r if terminated else r + GAMMA * soft
        self.q[s, a] += ALPHA * (target - self.q[s, a])
        return self.choose(s2)


class MonteCarlo(Learner):
    """On-policy, first-visit, sample averages."""

    def __init__(self, n_states, n_actions, rng):
        super().__init__(n_states, n_actions, rng)
        self.visits = np.zeros((n_states, n_actions))

    def begin(self, state):
        self.episode = []
        return self.choose(state)

    def step(self, s, a, r, s2, terminated):
        self.episode.append((s, a, r))
        return self.choose(s2)

    def end_episode(self):
        first = {}
        for t, (s, a, _) in enumerate(self.episode):
            first.setdefault((s, a), t)
        g = 0.0
        for t in range(len(self.episode) - 1, -1, -1):
            s, a, r = self.episode[t]
            g = r + GAMMA * g
            if first[s, a] == t:
                self.visits[s, a] += 1
                self.q[s, a] += (g - self.q[s, a]) / self.visits[s, a]


class OffPolicyMonteCarlo(MonteCarlo):
    """Weighted importance sampling; behaves epsilon-greedily, learns the greedy policy."""

    def end_episode(self):
        g, w = 0.0, 1.0
        for s, a, r in reversed(self.episode):
            g = r + GAMMA * g
            behaviour = self.probabilities(s)[a]
            self.visits[s, a] += w
            self.q[s, a] += w / self.visits[s, a] * (g - self.q[s, a])
            if a != int(np.argmax(self.q[s])):
                break
            w /= behaviour


ALGORITHMS = {
    "q_learning": QLearning,
    "sarsa": Sarsa,
    "expected_sarsa": ExpectedSarsa,
    "double_q_learning": DoubleQLearning,
    "n_step_sarsa": NStepSarsa,
    "sarsa_lambda": SarsaLambda,
    "q_lambda": QLambda,
    "dyna_q": DynaQ,
    "soft_q_learning": SoftQLearning,
    "monte_carlo": MonteCarlo,
    "off_policy_monte_carlo": OffPolicyMonteCarlo,
}


def train(env, algorithm, seconds, seed):
    """Plays for `seconds`; returns episodes and steps."""
    rng = np.random.default_rng(seed)
    learner = ALGORITHMS[algorithm](int(env.observation_space.n), int(env.action_space.n), rng)
    episodes = steps = 0
    state, _ = env.reset(seed=seed)
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        action = learner.begin(state)
        done = False
        while not done:
            next_state, reward, terminated, truncated, _ = env.step(action)
            action = learner.step(state, action, reward, next_state, terminated)
            state = next_state
            done = terminated or truncated
            steps += 1
        learner.end_episode()
        state, _ = env.reset()
        episodes += 1
    return episodes, steps


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("environment", choices=ENVIRONMENTS)
    parser.add_argument("algorithm", choices=ALGORITHMS)
    parser.add_argument("--seconds", type=float, default=3.0)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    env = ENVIRONMENTS[args.environment]()
    start = time.perf_counter()
    episodes, steps = train(env, args.algorithm, args.seconds, args.seed)
    seconds = time.perf_counter() - start
    print(json.dumps({"episodes": episodes, "steps": steps, "steps_per_second": steps / seconds}))


if __name__ == "__main__":
    main()

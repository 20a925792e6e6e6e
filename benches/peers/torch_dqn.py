#!/usr/bin/env python3
"""A lean DQN in PyTorch on CartPole-v1, on one thread: the peer of `dqn.py`.

    benches/peers/torch_dqn.py [--variant eager|flat|compiled] [--net 24,24] [--batch 64]
                               [--buffer 2000] [--steps 5000] [--gradient-only]

One gradient step per environment step: a minibatch drawn with replacement, the target network's
forward, the online one's, the mean squared error, backward, Adam (learning rate 0.001); a target
copied every 500 steps, a constant epsilon of 0.1, no clipping, gamma 0.99. The buffer is a block of
tensors, written through NumPy views. After a warm-up that fills the buffer, whole steps are timed,
then gradient steps alone (with --gradient-only just these, on a buffer of random transitions).
Prints one line of JSON.

What a step costs, tried out at 24/24 (microseconds of CPU time per gradient step, the least of five
repeats, torch 2.15; on a busy machine this script shows a tenth more, `compiled` half more):

- `eager`, an `nn.Sequential` with autograd and `Adam(fused=True)`, what a careful user writes: 400.
  In a loop of its own, Adam takes 44 fused, 121 with `foreach=True` and 137 tensor by tensor;
  gathering a minibatch takes 8 with `index_select` and 12 by indexing.
- `F.linear` on the parameters in place of modules: 340. A greedy action takes 16 so, and 28 with
  modules; `no_grad` and `inference_mode` are alike.
- `flat`, parameters and gradients as views of one tensor each, so that Adam, the clearing of
  gradients and the target's copy are one call: 295, the fastest found without a compiler.
- `torch.compile` of the loss, or of the loss and of Adam: 411 and 458, no better than eager, since
  autograd stays and guards are added.
- `compiled`, one graph of everything in a gradient step, with `torch.func.grad` in autograd's place
  and Adam written out: 75. It takes a C++ compiler, about a minute of compilation, and an
  optimiser written by hand.
"""

import argparse
import json
import random
import time

import gymnasium as gym
import torch
import torch.nn.functional as F
from torch import nn

LEARNING_RATE = 1e-3
BETAS = 0.9, 0.999
ADAM_EPSILON = 1e-8
GAMMA = 0.99
EXPLORATION = 0.1
TARGET_UPDATE_INTERVAL = 500
OBSERVATIONS, ACTIONS = 4, 2
WARM_UP = 500


class Buffer:
    """Transitions in preallocated tensors, written through NumPy views of the same memory."""

    def __init__(self, capacity):
        self.capacity, self.size, self.position = capacity, 0, 0
        self.tensors = (
            torch.zeros(capacity, OBSERVATIONS),
            torch.zeros(capacity, 1, dtype=torch.int64),
            torch.zeros(capacity),
            torch.zeros(capacity, OBSERVATIONS),
            torch.zeros(capacity),
        )
        self.views = [tensor.numpy() for tensor in self.tensors]

    def push(self, *transition):
        for view, value in zip(self.views, transition):
            view[self.position] = value
        self.position = (self.position + 1) % self.capacity
        self.size = min(self.size + 1, self.capacity)

    def randomise(self):
        states, actions, rewards, next_states, discounts = self.tensors
        states.normal_()
        next_states.normal_()
        actions.random_(ACTIONS)
        rewards.fill_(1.0)
        discounts.fill_(GAMMA)
        self.size = self.capacity


def network(widths):
    layers, before = [], OBSERVATIONS
    for width in widths:
        layers += [nn.Linear(before, width), nn.ReLU()]
        before = width
    return nn.Sequential(*layers, nn.Linear(before, ACTIONS))


def linear(x, parameters):
    """The network of `parameters`: weight, bias, weight, bias, .."""
    for layer in range(0, len(parameters) - 2, 2):
        x = F.linear(x, parameters[layer], parameters[layer + 1]).relu()
    return F.linear(x, parameters[-2], parameters[-1])


class Eager:
    """Modules, autograd, fused Adam."""

    def __init__(self, widths, buffer, batch):
        self.buffer, self.batch = buffer, batch
        self.online, self.target = network(widths), network(widths)
        self.optimiser = torch.optim.Adam(
            self.online.parameters(), lr=LEARNING_RATE, betas=BETAS, eps=ADAM_EPSILON, fused=True
        )
        self.copy()

    def copy(self):
        self.target.load_state_dict(self.online.state_dict())

    def greedy(self, observation):
        with torch.inference_mode():
            return self.online(torch.from_numpy(observation)).argmax().item()

    def learn(self):
        index = torch.randint(self.buffer.size, (self.batch,))
        s, a, r, s2, discount = (t.index_select(0, index) for t in self.buffer.tensors)
        with torch.no_grad():
            y = torch.addcmul(r, discount, self.target(s2).amax(1))
        loss = F.mse_loss(self.online(s).gather(1, a).squeeze(1), y)
        self.optimiser.zero_grad()
        loss.backward()
        self.optimiser.step()


def flatten(parameters):
    """All of them in one vector, and the slices that have their shapes."""
    vector = torch.cat([p.detach().reshape(-1) for p in parameters])
    return vector, slices(vector, parameters)


def slices(vector, parameters):
    parts = vector.split([p.numel() for p in parameters])
    return [part.view(p.shape) for part, p in zip(parts, parameters)]


class Flat(Eager):
    """The same with all parameters in one tensor, and all gradients."""

    def __init__(self, widths, buffer, batch):
        self.buffer, self.batch = buffer, batch
        shapes = list(network(widths).parameters())
        vector, weights = flatten(shapes)
        self.vector, self.weights = nn.Parameter(vector), [w.requires_grad_() for w in weights]
        self.vector.grad = torch.zeros_like(vector)
        for weight, gradient in zip(self.weights, slices(self.vector.grad, shapes)):
            weight.grad = gradient
        self.target_vector, self.target_weights = flatten(shapes)
        self.optimiser = torch.optim.Adam(
            [self.vector], lr=LEARNING_RATE, betas=BETAS, eps=ADAM_EPSILON, fused=True
        )
        self.optimiser.zero_grad = self.vector.grad.zero_

    def online(self, x):
        return linear(x, self.weights)

    def target(self, x):
        return linear(x, self.target_weights)

    def copy(self):
        self.target_vector.copy_(self.vector.detach())


class Compiled:
    """One compiled function for a gradient step."""

    def __init__(self, widths, buffer, batch):
        self.buffer, self.batch = buffer, batch
        shapes = list(network(widths).parameters())
        self.vector, self.weights = flatten(shapes)
        self.target_vector, _ = flatten(shapes)
        self.moments = [torch.zeros_like(self.vector) for _ in range(2)]
        self.steps = torch.zeros((), dtype=torch.float64)

        def loss(vector, s, a, y):
            return F.mse_loss(linear(s, slices(vector, shapes)).gather(1, a).squeeze(1), y)

        def step(index, tensors, vector, target, first, second, steps):
            s, a, r, s2, discount = (tensor[index] for tensor in tensors)
            y = r + discount * linear(s2, slices(target, shapes)).amax(1)
            gradient = torch.func.grad(loss)(vector, s, a, y)
            steps.add_(1)
            first.mul_(BETAS[0]).add_(gradient, alpha=1 - BETAS[0])
            second.mul_(BETAS[1]).addcmul_(gradient, gradient, value=1 - BETAS[1])
            rate = (LEARNING_RATE / (1 - BETAS[0] ** steps)).float()
            root = torch.sqrt(1 - BETAS[1] ** steps).float()
            vector.sub_(rate * first / (second.sqrt() / root + ADAM_EPSILON))

        self.step = torch.compile(step, fullgraph=True, dynamic=False)

    def copy(self):
        self.target_vector.copy_(self.vector)

    def greedy(self, observation):
        with torch.inference_mode():
            return linear(torch.from_numpy(observation), self.weights).argmax().item()

    def learn(self):
        index = torch.randint(self.buffer.size, (self.batch,))
        with torch.no_grad():
            self.step(
                index, self.buffer.tensors, self.vector, self.target_vector, *self.moments, self.steps
            )


VARIANTS = {"eager": Eager, "flat": Flat, "compiled": Compiled}


class Loop:
    """Acts, stores, learns."""

    def __init__(self, learner, seed):
        self.env = gym.make("CartPole-v1", disable_env_checker=True)
        self.learner, self.steps, self.episodes = learner, 0, 0
        self.observation, _ = self.env.reset(seed=seed)

    def play(self, steps):
        learner, buffer, env, observation = self.learner, self.learner.buffer, self.env, self.observation
        for _ in range(steps):
            if random.random() < EXPLORATION:
                action = int(random.random() * ACTIONS)
            else:
                action = learner.greedy(observation)
            after, reward, terminated, truncated, _ = env.step(action)
            buffer.push(observation, action, reward, after, 0.0 if terminated else GAMMA)
            observation = after
            if terminated or truncated:
                observation, _ = env.reset()
                self.episodes += 1
            if buffer.size >= learner.batch:
                learner.learn()
            self.steps += 1
            if self.steps % TARGET_UPDATE_INTERVAL == 0:
                learner.copy()
        self.observation = observation


def timed(work):
    """Seconds of wall time and of CPU time."""
    start, cpu = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - start, time.process_time() - cpu


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--variant", choices=VARIANTS, default="eager")
    parser.add_argument("--net", default="24,24")
    parser.add_argument("--batch", type=int, default=64)
    parser.add_argument("--buffer", type=int, default=2000)
    parser.add_argument("--steps", type=int, default=5000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--gradient-only", action="store_true")
    args = parser.parse_args()
    torch.set_num_threads(1)
    torch.manual_seed(args.seed)
    random.seed(args.seed)
    buffer = Buffer(args.buffer)
    learner = VARIANTS[args.variant]([int(n) for n in args.net.split(",")], buffer, args.batch)
    result = {"variant": args.variant, "net": args.net, "batch": args.batch}
    if args.gradient_only:
        buffer.randomise()
        timed(lambda: [learner.learn() for _ in range(WARM_UP)])
    else:
        loop = Loop(learner, args.seed)
        loop.play(args.buffer + WARM_UP)
        before = loop.episodes
        seconds, cpu = timed(lambda: loop.play(args.steps))
        result |= {
            "steps": args.steps,
            "episodes": loop.episodes - before,
            "seconds": seconds,
            "cpu_seconds": cpu,
            "steps_per_second": args.steps / seconds,
            "microseconds_per_step": seconds / args.steps * 1e6,
            "cpu_microseconds_per_step": cpu / args.steps * 1e6,
        }
    seconds, cpu = timed(lambda: [learner.learn() for _ in range(args.steps)])
    result["microseconds_per_gradient_step"] = seconds / args.steps * 1e6
    result["cpu_microseconds_per_gradient_step"] = cpu / args.steps * 1e6
    print(json.dumps(result))


if __name__ == "__main__":
    main()

"""Writes pytorch.json, ground truth of the networks' tests (made with PyTorch 2.15.0, on a CPU).

    pip install torch==2.15.0 numpy && python generate.py

Two networks over four numbers, everything once in float64 and once in float32: `plain`, an MLP
4-24-24-2, and `dueling`, a torso 4-16 and heads of 3 advantages and one value, Q = V + A - mean(A)
(Wang et al. 2016). Both have ReLU after the hidden layers. What is recorded is described in the
file itself under `layout`.

The inputs come from a seed of NumPy's and are multiples of 1/256, so that both precisions start
from the same numbers. Floats are printed with the fewest digits that read back as the same bits in
their precision.
"""

import json
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F

BATCH, OBSERVATIONS = 8, 4
GAMMA = 0.875  # exact in both precisions
MAX_NORM = 0.5
LEARNING_RATE, BETAS, EPSILON = 1e-3, (0.9, 0.999), 1e-8
STEPS = (1, 2, 5)

LAYOUT = {
    "networks": "plain: Linear 0, ReLU, Linear 2, ReLU, Linear 4; dueling: Linear 0, ReLU, then"
    " advantage and value, Q = value + advantage - mean(advantage)",
    "weight": "[out, in], row-major, y = W x + b",
    "bias": "[out]",
    "observations, next_observations": "[batch, observation]",
    "actions": "[batch], from 0",
    "rewards": "[batch]",
    "discounts": f"[batch], gamma = {GAMMA}, or 0 where the step terminated",
    "q": "[batch, action], the online network's at observations",
    "next_q, next_q_target": "[batch, action], the online and the target network's at"
    " next_observations",
    "targets": "dqn: r + discount max_a next_q_target; double_dqn: r + discount"
    " next_q_target[argmax_a next_q]",
    "mse, huber": "the losses, mse: mean over the batch of (q[a] - target)^2; huber: mean of smooth_l1_loss with"
    " beta 1; both with the targets of dqn",
    "gradients": "of the loss, by parameter",
    "norm": "Euclidean, over all gradients together",
    "clipped": f"of huber: the gradients after clip_grad_norm_(max_norm={MAX_NORM}), which multiplies by"
    " min(1, max_norm / (norm + 1e-6))",
    "adam": f"of mse: the parameters after so many steps of Adam (learning rate {LEARNING_RATE}, betas"
    f" {BETAS[0]} and {BETAS[1]}, eps {EPSILON}), without clipping, the same minibatch and targets"
    " in each",
}


def short(array):
    """Numbers that are the same in both precisions, and in few digits."""
    return (np.round(array * 256) / 256).tolist()


def shapes(kind):
    """Parameters by name, in order."""
    if kind == "plain":
        layers = {"0": (24, 4), "2": (24, 24), "4": (2, 24)}
    else:
        layers = {"0": (16, 4), "advantage": (3, 16), "value": (1, 16)}
    return {
        f"{name}.{part}": shape
        for name, (out, in_) in layers.items()
        for part, shape in (("weight", (out, in_)), ("bias", (out,)))
    }


def draw(rng, kind):
    """Parameters as PyTorch draws them, uniform within 1 / sqrt(inputs)."""
    bound = None
    parameters = {}
    for name, shape in shapes(kind).items():
        bound = 1 / np.sqrt(shape[1]) if name.endswith("weight") else bound
        parameters[name] = short(rng.uniform(-bound, bound, shape))
    return parameters


def q_values(kind, p, x):
    linear = lambda name, x: F.linear(x, p[f"{name}.weight"], p[f"{name}.bias"])
    x = linear("0", x).relu()
    if kind == "plain":
        return linear("4", linear("2", x).relu())
    advantage = linear("advantage", x)
    return linear("value", x) + advantage - advantage.mean(1, keepdim=True)


def listed(tensor):
    """Nested lists, of float32 in as few digits as its bits need."""
    array = tensor.detach().numpy()
    if array.dtype == np.float64:
        return array.tolist()
    numbers = [float(str(x)) for x in array.reshape(-1)]
    assert all(np.float32(x) == y for x, y in zip(numbers, array.reshape(-1)))
    return np.array(numbers).reshape(array.shape).tolist()


def all_listed(tensors):
    return {name: listed(tensor) for name, tensor in tensors.items()}


def learn(kind, online, minibatch, targets, loss_of):
    """A loss, its gradients, and what they are clipped to or where Adam goes with them."""
    observations, actions = minibatch
    p = {name: tensor.clone().requires_grad_() for name, tensor in online.items()}
    parameters = list(p.values())

    def loss():
        chosen = q_values(kind, p, observations).gather(1, actions.unsqueeze(1)).squeeze(1)
        return loss_of(chosen, targets)

    value = loss()
    value.backward()
    gradients = all_listed({name: t.grad for name, t in p.items()})
    norm = torch.nn.utils.clip_grad_norm_(parameters, MAX_NORM)
    assert norm > MAX_NORM, "clipping must clip"
    result = {"loss": listed(value), "gradients": gradients, "norm": listed(norm)}
    if loss_of is F.smooth_l1_loss:
        return result | {"clipped": all_listed({name: t.grad for name, t in p.items()})}
    adam = torch.optim.Adam(parameters, lr=LEARNING_RATE, betas=BETAS, eps=EPSILON, foreach=False)
    after = {}
    for step in range(1, max(STEPS) + 1):
        adam.zero_grad()
        loss().backward()
        adam.step()
        if step in STEPS:
            after[str(step)] = all_listed(p)
    return result | {"adam": after}


def record(kind, dtype, given):
    """Everything computed in one precision."""
    read = lambda array: torch.tensor(array, dtype=dtype)
    online = {name: read(a) for name, a in given["online"].items()}
    target = {name: read(a) for name, a in given["target"].items()}
    observations, after = read(given["observations"]), read(given["next_observations"])
    rewards, discounts = read(given["rewards"]), read(given["discounts"])
    actions = torch.tensor(given["actions"])
    q = q_values(kind, online, observations)
    next_q, next_q_target = q_values(kind, online, after), q_values(kind, target, after)
    greedy = next_q.argmax(1, keepdim=True)
    dqn = rewards + discounts * next_q_target.amax(1)
    double = rewards + discounts * next_q_target.gather(1, greedy).squeeze(1)
    assert not torch.equal(dqn, double), "the two kinds of target must differ"
    # Huber's two branches must both be met.
    errors = (q.gather(1, actions.unsqueeze(1)).squeeze(1) - dqn).abs()
    assert (errors < 0.9).any() and (errors > 1.1).any()
    minibatch = observations, actions
    return {
        "q": listed(q),
        "next_q": listed(next_q),
        "next_q_target": listed(next_q_target),
        "targets": {"dqn": listed(dqn), "double_dqn": listed(double)},
        "mse": learn(kind, online, minibatch, dqn, F.mse_loss),
        "huber": learn(kind, online, minibatch, dqn, F.smooth_l1_loss),
    }


def given(rng, kind):
    """What a network is asked, the same in both precisions."""
    actions = 2 if kind == "plain" else 3
    discounts = [GAMMA] * BATCH
    discounts[2] = discounts[5] = 0.0
    return {
        "online": draw(rng, kind),
        "target": draw(rng, kind),
        "observations": short(rng.normal(0, 1, (BATCH, OBSERVATIONS))),
        "next_observations": short(rng.normal(0, 1, (BATCH, OBSERVATIONS))),
        "actions": rng.integers(0, actions, BATCH).tolist(),
        "rewards": short(rng.normal(0, 2, BATCH)),
        "discounts": discounts,
    }


def main():
    torch.set_num_threads(1)
    rng = np.random.default_rng(8)
    out = {"made_with": f"PyTorch {torch.__version__.split('+')[0]}", "layout": LAYOUT}
    for kind in ("plain", "dueling"):
        inputs = given(rng, kind)
        out[kind] = inputs | {
            "float64": record(kind, torch.float64, inputs),
            "float32": record(kind, torch.float32, inputs),
        }
    path = Path(__file__).with_name("pytorch.json")
    path.write_text(json.dumps(out, separators=(",", ":")) + "\n")


if __name__ == "__main__":
    main()

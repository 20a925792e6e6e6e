#!/usr/bin/env python3
"""Checks the files that `runner` writes with the libraries that others read them with.

    tests/interop/check.py --runner PATH [--keep DIR]

`.ci/interop` runs this in a virtual environment that has the libraries. It trains the networks of
dqn.rhai for a few episodes, and then

- loads every `model.safetensors` and `best.safetensors` with the safetensors library, and expects
  float32 tensors of the names and shapes that belong to the network, and metadata;
- exports each with `runner export`, and expects the ONNX checker to accept it, and ONNX Runtime to
  give the Q values that the weights give in float64 in NumPy, within 1e-5 of the largest, for
  minibatches of 1 and 7;
- reads the TensorBoard events of every variant and seed with TensorBoard's own EventAccumulator, and
  expects the tags and finite numbers.

Prints what it found; exit code 1, with every fault, if anything is wrong.
"""

import argparse
import math
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
from safetensors import safe_open
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

HERE = Path(__file__).resolve().parent
SCRIPT = HERE / "dqn.rhai"

# variant: observations, actions, hidden layers, whether it has two heads. As in dqn.rhai.
NETWORKS = {
    "plain": (4, 2, [24, 24], False),
    "shallow": (4, 2, [7], False),
    "double": (4, 2, [16, 32, 8], False),
    "dueling": (4, 2, [24, 24], True),
    "three_actions": (2, 3, [24, 24], True),
}
SEEDS = 2
BATCHES = (1, 7)
TOLERANCE = 1e-5
TAGS = ("rollout/ep_rew_mean", "train/loss")


class Faults(list):
    """What was wrong; checking goes on, so that one run shows everything."""

    def expect(self, right, fault):
        if not right:
            print(f"FAULT {fault}")
            self.append(fault)
        return right


def layers(network):
    """Names of the layers with their (outputs, inputs), in order; the heads last."""
    inputs, actions, hidden, dueling = NETWORKS[network]
    found = {}
    for index, width in enumerate(hidden):
        found[f"q_net.{2 * index}"] = (width, inputs)
        inputs = width
    if dueling:
        return found | {"advantage": (actions, inputs), "value": (1, inputs)}
    return found | {f"q_net.{2 * len(hidden)}": (actions, inputs)}


def shapes(network):
    """The same for tensors."""
    found = {}
    for name, (out, inputs) in layers(network).items():
        found[f"{name}.weight"] = (out, inputs)
        found[f"{name}.bias"] = (out,)
    return found


def load(path):
    """Tensors and metadata, by the safetensors library."""
    with safe_open(path, framework="numpy") as file:
        return {name: file.get_tensor(name) for name in file.keys()}, file.metadata()


def network_of(tensors):
    """The variants that a file's tensors fit."""
    found = {name: tensor.shape for name, tensor in tensors.items()}
    return [network for network in NETWORKS if shapes(network) == found]


def q_values(tensors, network, x):
    """In float64, straight from the definition."""

    def linear(name, x):
        weight, bias = (tensors[f"{name}.{part}"].astype(np.float64) for part in ("weight", "bias"))
        return x @ weight.T + bias

    names, dueling = list(layers(network)), NETWORKS[network][3]
    for name in names[: -2 if dueling else -1]:
        x = np.maximum(linear(name, x), 0.0)
    if not dueling:
        return linear(names[-1], x)
    advantage = linear("advantage", x)
    return linear("value", x) + advantage - advantage.mean(axis=1, keepdims=True)


def dimensions(value):
    """A tensor's shape in an ONNX graph; None where any size will do."""
    return [
        d.dim_value if d.HasField("dim_value") else None for d in value.type.tensor_type.shape.dim
    ]


def check_onnx(path, tensors, network, faults):
    """An exported model; returns the largest relative error of its Q values."""
    inputs, actions, *_ = NETWORKS[network]
    model = onnx.load(path)
    onnx.checker.check_model(model, full_check=True)
    signature = [
        [(v.name, dimensions(v)) for v in side] for side in (model.graph.input, model.graph.output)
    ]
    expected = [[("observation", [None, inputs])], [("q_values", [None, actions])]]
    faults.expect(signature == expected, f"{path}: signature {signature}, not {expected}")
    session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
    rng, worst = np.random.default_rng(0), 0.0
    for batch in BATCHES:
        x = rng.normal(0, 1, (batch, inputs)).astype(np.float32)
        (q,) = session.run(["q_values"], {"observation": x})
        exact = q_values(tensors, network, x.astype(np.float64))
        if faults.expect(q.shape == exact.shape, f"{path}: Q values of shape {q.shape}"):
            worst = max(worst, float(np.abs(q - exact).max() / np.abs(exact).max()))
    faults.expect(worst <= TOLERANCE, f"{path}: Q values are off by {worst:.1e} of the largest")
    return worst


def check_model(runner, path, out, faults):
    """A model file and its export; returns the variants it can be of."""
    tensors, metadata = load(path)
    fitting = network_of(tensors)
    found = {name: list(tensor.shape) for name, tensor in tensors.items()}
    if not faults.expect(fitting, f"{path}: tensors of no network here: {found}"):
        return []
    for name, tensor in tensors.items():
        faults.expect(tensor.dtype == np.float32, f"{path}: {name} is {tensor.dtype}")
        faults.expect(np.isfinite(tensor).all(), f"{path}: {name} is not finite")
    faults.expect(metadata, f"{path}: no metadata")
    exported = out / f"{path.parent.name}-{path.stem}.onnx"
    subprocess.run([str(runner), "export", str(path), "--onnx", str(exported)], check=True)
    worst = check_onnx(str(exported), tensors, fitting[0], faults)
    print(f"{path.name} of {' or '.join(fitting)}: {len(tensors)} tensors, ONNX within {worst:.1e}")
    return fitting


def check_events(folder, faults):
    """The events of one variant and seed."""
    if not faults.expect(folder.is_dir(), f"{folder}: no events"):
        return
    events = EventAccumulator(str(folder), size_guidance={"scalars": 0})
    events.Reload()
    tags = events.Tags()["scalars"]
    counts = []
    for tag in TAGS:
        if not faults.expect(tag in tags, f"{folder}: no {tag} among {tags}"):
            continue
        scalars = events.Scalars(tag)
        steps = [s.step for s in scalars]
        faults.expect(steps == sorted(set(steps)), f"{folder}: steps of {tag} do not increase")
        finite = all(math.isfinite(s.value) for s in scalars)
        faults.expect(finite, f"{folder}: {tag} is not finite")
        counts.append(f"{len(scalars)} {tag}")
    print(f"events of {folder.parent.name}, {folder.name}: {', '.join(counts)}")


def check(runner, folder):
    """Trains, and checks everything that was written; returns the faults."""
    faults, out, exports = Faults(), folder / "results", folder / "onnx"
    exports.mkdir()
    command = [runner, "exec", SCRIPT, "--out", out, "--tensorboard", "--fresh", "--quiet"]
    subprocess.run([str(c) for c in command], check=True)
    for kind in ("model.safetensors", "best.safetensors"):
        paths = sorted(out.glob(f"units/*/*/{kind}"))
        expected = len(NETWORKS) * SEEDS
        faults.expect(len(paths) == expected, f"{len(paths)} files {kind}, not {expected}")
        met = {n for path in paths for n in check_model(runner, path, exports, faults)}
        faults.expect(met == set(NETWORKS), f"{kind}: only of {sorted(met)}")
    for network in NETWORKS:
        for seed in range(SEEDS):
            check_events(out / "tensorboard" / network / f"seed-{seed}", faults)
    return faults


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runner", required=True, help="the program to check")
    parser.add_argument("--keep", help="an empty folder to leave the files in")
    args = parser.parse_args()
    runner = Path(args.runner).resolve()
    with tempfile.TemporaryDirectory() as held:
        folder = Path(args.keep or held)
        folder.mkdir(parents=True, exist_ok=True)
        faults = check(runner, folder)
    print(f"{len(faults)} faults" if faults else "everything can be read by others")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())

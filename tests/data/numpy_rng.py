"""Writes numpy_rng.json, the vectors of the tests of `mdp::numpy` (made with NumPy 2.4.6).

Doubles are their big-endian IEEE 754 bits in hexadecimal; integers beyond 2^53 are decimal text.
Every list starts from a fresh generator of its seed.
"""

import json
import struct

import numpy as np

SEEDS = [0, 1, 2, 3, 42, 123, 12345, 2**31, 2**32 - 1, 2**32, 2**40 + 7, 2**64 - 1, 2**64]
SEEDS += [2**100 + 12345, 2**128 - 1, 2**130 + 99]
N = 6
INTEGERS = [  # low, high: both sides of every case distinction
    (0, 1), (0, 2), (0, 6), (0, 13), (-9999, 9999), (0, 3 * 2**30), (0, 2**32 - 1), (0, 2**32),
    (0, 2**32 + 1), (0, 2**40), (-(2**63), 3 * 2**62 - 2**63), (-(2**63), 2**63 - 1),
]
OPS = ["i13", "d", "i13", "i13", "u", "i20k", "i1", "i64", "c4", "d", "c3", "c3", "i64", "p", "i13"]


def generator(seed):
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed)))


def bits(x):
    return struct.pack(">d", float(x)).hex()


def play(rng, op):
    match op:
        case "i13": return int(rng.integers(0, 13))
        case "i20k": return int(rng.integers(-9999, 9999))
        case "i1": return int(rng.integers(0, 1))
        case "i64": return str(rng.integers(0, 2**40))
        case "c4": return int(rng.choice(4))
        case "c3": return int(rng.choice([0, 1, 2]))
        case "p": return int(rng.choice(3, p=[0.5, 0.2, 0.3]))
        case "d": return bits(rng.random())
        case "u": return bits(rng.uniform(-1, 1))


def vectors(seed):
    sequence = np.random.SeedSequence(seed)
    fresh = np.random.PCG64(sequence).state["state"]
    rng = generator(seed)
    script = []
    for op in OPS:
        value = play(rng, op)
        state = rng.bit_generator.state
        half = int(state["uinteger"]) if state["has_uint32"] else None
        script.append({"op": op, "value": value, "uinteger": half})
    many = {"u64": (lambda r: str(r.bit_generator.random_raw())), "random": lambda r: bits(r.random())}
    for low, high in [(-0.05, 0.05), (-0.6, -0.4), (0, 400 / 30 / 2), (-1000, 1000), (0.3, 0.3)]:
        many[f"uniform {low!r} {high!r}"] = lambda r, lo=low, hi=high: bits(r.uniform(lo, hi))
    for low, high in INTEGERS:
        many[f"integers {low} {high}"] = lambda r, lo=low, hi=high: str(r.integers(lo, hi))
    p = [0.8, 0.2]
    many["choice_p"] = lambda r: int(r.choice(2, p=p))
    many["discrete6"] = lambda r: int(r.integers(6))
    out = {
        "seed": str(seed),
        "pool": [int(w) for w in sequence.pool],
        "generate_state": [int(w) for w in sequence.generate_state(8)],
        "state": str(fresh["state"]),
        "inc": str(fresh["inc"]),
        "script": script,
        "final_state": str(rng.bit_generator.state["state"]["state"]),
    }
    for name, draw in many.items():
        rng = generator(seed)
        out[name] = [draw(rng) for _ in range(N)]
    return out


def main():
    rows = ",\n".join(json.dumps(vectors(s), separators=(",", ":")) for s in SEEDS)
    with open("numpy_rng.json", "w") as f:
        f.write(f"[\n{rows}\n]\n")


main()

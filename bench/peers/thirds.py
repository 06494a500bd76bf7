#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How well can what `brainforest fit` makes of a folder of cells be told from cells that it never saw?
thirds.py CELLS [--slices REGEX] [--seeds 1,2] [--set NAME=VALUE] [--model-regex 'PATTERN=>TEXT'] [--held-back]

Cells whose slice has a name with a SHA-256 sum that begins with 0 to 4 are held back and left out. The others are dealt
into thirds by slices, four times; a model is fitted to two thirds, grows populations of as many neurons as are in the third,
and scikit-learn's forests tell the first of these from it, slices kept together and each grown neuron a slice of its own. Beside
them, traced cells that were fitted to, as many. Printed, as JSON: mean areas under the curve on structure and on all features, and
how far the nearest training cell is, in what it is for the cells of the third; then how often `brainforest judge` finds each of
its criteria met, and all of them.

--held-back judges the cells that are held back instead, by `brainforest judge`: for versions that are to be published, once.
Needs python3-sklearn.
"""
import argparse
import collections
import concurrent.futures
import hashlib
import json
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile

try:
    import numpy as np
    from sklearn.ensemble import RandomForestClassifier
    from sklearn.metrics import roc_auc_score
    from sklearn.model_selection import StratifiedGroupKFold
    import features
except ImportError as error:
    sys.exit(f"scikit-learn for Python cannot be loaded ({error}); install python3-sklearn")

root = pathlib.Path(__file__).resolve().parents[2]
arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
arguments.add_argument("cells", nargs="+", type=pathlib.Path, help="folders of SWC files")
arguments.add_argument("--slices", default="^[A-Za-z]+[0-9]+", help="what cells of one slice share of their name")
arguments.add_argument("--seeds", default="1,2")
arguments.add_argument("--deals", type=int, default=4)
arguments.add_argument("--repeats", type=int, default=2, help="cross-validations; 0: none")
arguments.add_argument("--populations", type=int, default=25, help="that are grown for a judgement")
arguments.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="a setting of the model, changed")
arguments.add_argument("--model-regex", action="append", default=[], metavar="PATTERN=>TEXT")
arguments.add_argument("--held-back", action="store_true")
arguments.add_argument("--brainforest", default=str(root / "build/release/brainforest"))
arguments.add_argument("--jobs", type=int, default=os.cpu_count())
options = arguments.parse_args()


def slice_of(name):
    found = re.search(options.slices, name)
    return found.group() if found else re.sub(r"(\.CNG)?\.swc$", "", name)


def is_held_back(path):
    return hashlib.sha256(slice_of(path.name).encode()).hexdigest()[0] in "01234"


def run(*words):
    done = subprocess.run([options.brainforest, *map(str, words)], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{' '.join(map(str, words[:2]))}: {done.stderr}")
    return done.stdout


def fit(cells, model):
    run("fit", *cells, "-o", model)
    text = model.read_text(encoding="utf-8")
    edits = [(rf"(?m)^(#define {re.escape(name)}) \S+", rf"\g<1> {value}")
             for name, value in (words.split("=") for words in options.set)]
    for pattern, to in edits + [words.split("=>") for words in options.model_regex]:
        text, found = re.subn(pattern, to, text)
        if not found:
            raise RuntimeError(f"the model has no {pattern}")
    model.write_text(text, encoding="utf-8")


def dealt(cells, deal):
    """Three lists of cells, slices kept together, about as long."""
    slices = collections.defaultdict(list)
    for cell in cells:
        slices[slice_of(cell.name)].append(cell)
    thirds = [[], [], []]
    names = sorted(slices)
    random.Random(deal).shuffle(names)
    for name in names:
        min(thirds, key=len).extend(slices[name])
    return thirds


def auc(values, y, slices):
    means = []
    for repeat in range(options.repeats):
        scores = []
        for train, test in StratifiedGroupKFold(5, shuffle=True, random_state=repeat).split(values, y, slices):
            if len(set(y[train])) < 2 or len(set(y[test])) < 2:
                continue
            forest = RandomForestClassifier(100, random_state=repeat).fit(values[train], y[train])
            scores.append(roc_auc_score(y[test], forest.predict_proba(values[test])[:, 1]))
        means.append(np.mean(scores))
    return float(np.mean(means))


def figures(path, seed, traced):
    names, group, everything, thickness = features.read(path)
    slices = np.array([f"{name} {i}" if g == "grown" else slice_of(os.path.basename(name))
                       for i, (name, g) in enumerate(zip(names, group))])
    chosen = {g: np.flatnonzero(group == g) for g in ("train", "held_out", "grown")}
    few = np.random.default_rng(seed).permutation(chosen["train"])[:len(chosen["held_out"])]
    out = {}
    for kind, columns in (("structure", ~thickness), ("diameters", thickness | True)) if options.repeats else ():
        values = features.completed(everything[:, columns])
        for name, against in [("grown", chosen["grown"])] + [("traced", few)] * traced:
            index = np.concatenate([against, chosen["held_out"]])
            y = np.repeat([0, 1], [len(against), len(chosen["held_out"])])
            out[f"{name} {kind}"] = auc(values[index], y, slices[index])
    return out


def third(deal, part):
    thirds = dealt(free, deal)
    held, train = thirds[part], sum(thirds[:part] + thirds[part + 1:], [])
    with tempfile.TemporaryDirectory() as folder:
        at = pathlib.Path(folder)
        fit(train, at / "m.lsys")
        found = []
        for seed in seeds:
            told = run("judge", "--model", at / "m.lsys", "--train", *train, "--held-out", *held, "--populations",
                       options.populations, "--repeats", 25, "--seed", seed, "--slices", options.slices, "--features",
                       at / f"{seed}.csv", "--json")
            told = json.loads(told)
            found.append(figures(at / f"{seed}.csv", seed, traced=seed == seeds[0]) |
                         {"nearest": told["copying"]["neighbour_ratio"]} |
                         {f"judged: {name}": auc["value"] for name, auc in told["auc"].items()} |
                         {f"met: {asked['name']}": float(asked["pass"]) for asked in told["criteria"]} |
                         {"met: all": float(told["pass"])})
        return found


def judged(model, seed):
    return json.loads(run("judge", "--model", model, "--train", *free, "--held-out", *held_back, "--populations",
                          options.populations, "--seed", seed, "--slices", options.slices, "--json"))


cells = sorted({path for folder in options.cells for path in folder.glob("**/*.swc")}, key=lambda path: path.name)
held_back, free = [c for c in cells if is_held_back(c)], [c for c in cells if not is_held_back(c)]
if len(free) < 12:
    sys.exit(f"{len(free)} cells are not held back; twelve are needed")
seeds = [int(seed) for seed in options.seeds.split(",")]
if options.held_back:
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        fit(free, pathlib.Path(folder) / "m.lsys")
        print(json.dumps(list(pool.map(lambda seed: judged(pathlib.Path(folder) / "m.lsys", seed), seeds)), indent=1))
    sys.exit()
jobs = [(deal, part) for deal in range(options.deals) for part in range(3)]
with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
    results = []
    for done, result in enumerate(pool.map(lambda job: third(*job), jobs), 1):
        results += result
        print(f"{done} of {len(jobs)} thirds", end="\r", file=sys.stderr, flush=True)
means = {}
for name in results[0]:
    of = [r[name] for r in results if name in r]
    means[name] = {"value": round(float(np.mean(of)), 4), "error": round(float(np.std(of, ddof=1) / len(jobs) ** .5), 4)}
print(json.dumps({"cells": len(free), "thirds": len(jobs), "seeds": len(seeds)} | means, indent=1))

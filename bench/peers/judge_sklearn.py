#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Features that `brainforest judge --features FILE` or `brainforest compare --csv FILE` wrote, judged by scikit-learn:
judge_sklearn.py FILE [GROUP GROUP] [--repeats 20] [--trees 100]

Prints, as JSON, the mean area under the curve (AUC) over repeated stratified 5-fold cross-validations of a random forest
and of a logistic regression, on structure (columns without "[diameters]") and on all columns. Groups are those of the
column "group"; by default grown against held_out and, of as many cells, train against held_out, or the two there are. Each
repeat takes another of the populations that were grown (grown, grown 2, ...).
Needs python3-sklearn.
"""
import argparse
import json
import re
import sys

try:
    import numpy as np
    from sklearn.ensemble import RandomForestClassifier
    from sklearn.linear_model import LogisticRegression
    from sklearn.metrics import roc_auc_score
    from sklearn.model_selection import StratifiedKFold
    import features
except ImportError as error:
    sys.exit(f"scikit-learn for Python cannot be loaded ({error}); install python3-sklearn")

arguments = argparse.ArgumentParser()
arguments.add_argument("file")
arguments.add_argument("groups", nargs="*")
arguments.add_argument("--repeats", type=int, default=20)
arguments.add_argument("--trees", type=int, default=100)
arguments.add_argument("--C", type=float, default=1 / 30)
options = arguments.parse_args()

_, group, values, diameters = features.read(options.file)


def completed(X):
    """… and nothing twice, in standard deviations."""
    X = np.unique(features.completed(X), axis=1)
    return (X - X.mean(axis=0)) / X.std(axis=0, ddof=1)


def auc(first, second, columns, make, draw):
    populations = [name for name in names if name == first or re.fullmatch(f"{re.escape(first)} [0-9]+", name)]
    everything = np.isin(group, list({*populations, second} | ({"train", "held_out", "grown"} & set(group))))
    X, g = completed(values[everything][:, columns]), group[everything]
    means = []
    for repeat in range(options.repeats):
        random = np.random.default_rng(repeat)
        a, b = np.flatnonzero(g == populations[repeat % len(populations)]), np.flatnonzero(g == second)
        a = random.permutation(a)[:draw or len(a)]
        index = np.concatenate([a, b])
        y = np.repeat([0, 1], [len(a), len(b)])
        folds = max(2, min(5, min(len(a), len(b)) // 2))
        scores = []
        for train, test in StratifiedKFold(folds, shuffle=True, random_state=repeat).split(index, y):
            model = make(repeat).fit(X[index[train]], y[train])
            scores.append(roc_auc_score(y[test], model.predict_proba(X[index[test]])[:, 1]))
        means.append(np.mean(scores))
    return {"value": round(float(np.mean(means)), 4), "sd_of_repeats": round(float(np.std(means)), 4)}


def forest(seed):
    return RandomForestClassifier(options.trees, random_state=seed)


def regression(_):
    return LogisticRegression(C=options.C, max_iter=5000)


names = list(dict.fromkeys(group))
if options.groups:
    pairs = [tuple(options.groups)]
elif {"train", "held_out", "grown"} <= set(names):
    pairs = [("grown", "held_out"), ("train", "held_out")]
else:
    pairs = [tuple(names[:2])]
compared = min(np.sum(group == "train"), np.sum(group == "grown")) if len(pairs) == 2 else None
out = {}
for first, second in pairs:
    out[f"{first} against {second}"] = {
        "structure": {"random_forest": auc(first, second, ~diameters, forest, compared),
                      "logistic": auc(first, second, ~diameters, regression, compared)},
        "diameters": {"random_forest": auc(first, second, diameters | True, forest, compared),
                      "logistic": auc(first, second, diameters | True, regression, compared)}}
print(json.dumps(out, indent=2))

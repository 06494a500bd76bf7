# SPDX-License-Identifier: Apache-2.0
"""Feature tables that `brainforest judge --features FILE` and `brainforest compare --csv FILE` write."""
import csv
import typing

import numpy as np


class Features(typing.NamedTuple):
    names: np.ndarray      # of the cells
    group: np.ndarray      # of the cells: train, held_out, grown, or what was compared
    values: np.ndarray     # cells × features; not a number where a feature is not defined
    diameters: np.ndarray  # features: whether they depend on diameters


def read(path):
    with open(path, newline="", encoding="utf-8-sig") as file:
        header, *rows = csv.reader(file)
    return Features(np.array([row[0] for row in rows]), np.array([row[1] for row in rows]),
                    np.array([[float(x) if x else np.nan for x in row[2:]] for row in rows]),
                    np.array(["[diameters]" in name for name in header[2:]]))


def completed(values):
    """Medians where nothing is defined, columns that say so, nothing constant."""
    missing = np.isnan(values)
    known = ~missing.all(axis=0)
    values, missing = values[:, known], missing[:, known]
    values = np.where(missing, np.nanmedian(values, axis=0), values)
    values = np.hstack([values, missing[:, missing.any(axis=0)].astype(float)])
    return values[:, values.std(axis=0) > 0]

#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Check a circuit against the published layout of SONATA with h5py, without our own reader.

sonata_layout.py CIRCUIT [NEURONS]. Exit status 77 (skipped) when h5py is missing, 1 with a sentence when a check fails.
The layout: SONATA developer guide, "Representing nodes"; Dai et al. 2020, PLoS Comput Biol 16:e1007696.
"""
import csv
import json
import math
import pathlib
import sys

try:
    import h5py
    import numpy
except ImportError:
    print("h5py is missing: apt install python3-h5py")
    sys.exit(77)

folder = pathlib.Path(sys.argv[1])


def require(good, sentence):
    if not good:
        sys.exit(f"{folder}: {sentence}")


config = json.loads((folder / "circuit_config.json").read_text())


def resolve(text):
    for name, value in config["manifest"].items():
        text = text.replace(name, value)
    return folder / text


(entry,) = config["networks"]["nodes"]
((population, description),) = entry["populations"].items()
require(description["type"] == "biophysical", "the population is not biophysical")
morphologies = resolve(description["morphologies_dir"])
require(morphologies == resolve(config["components"]["morphologies_dir"]), "two folders of morphologies")

with open(resolve(entry["node_types_file"]), newline="") as file:
    types = list(csv.DictReader(file, delimiter=" "))
for column in ("node_type_id", "population", "model_type", "model_template", "pop_name", "ei"):
    require(column in types[0], f"node_types.csv has no column {column}")
require({t["population"] for t in types} == {population}, "types of another population")
require({t["model_type"] for t in types} == {"biophysical"}, "model_type")
require({t["ei"] for t in types} <= {"e", "i"}, "ei is neither e nor i")

with h5py.File(resolve(entry["nodes_file"]), "r") as file:
    require(file.attrs["magic"] == 0x0A7A and file.attrs["magic"].dtype == numpy.uint32, "magic")
    require(file.attrs["version"].shape == (2,) and file.attrs["version"].dtype == numpy.uint32, "version")
    require(list(file["nodes"]) == [population], "the populations of the file")
    nodes = file["nodes"][population]
    count = len(nodes["node_type_id"])
    if len(sys.argv) > 2:
        require(count == int(sys.argv[2]), f"{count} neurons")
    require((nodes["node_id"][:] == numpy.arange(count)).all(), "node_id")
    require((nodes["node_group_id"][:] == 0).all(), "node_group_id")
    require((nodes["node_group_index"][:] == numpy.arange(count)).all(), "node_group_index")
    require(set(nodes["node_type_id"][:]) <= {int(t["node_type_id"]) for t in types}, "a type without a row")

    group = nodes["0"]
    for name in ("x", "y", "z", "rotation_angle_yaxis", *(f"orientation_{axis}" for axis in "wxyz")):
        require(group[name].shape == (count,), f"{name} is not one value a neuron")
        require(group[name].dtype == numpy.float32 and numpy.isfinite(group[name][:]).all(), f"{name} is not finite")
    w, x, y, z = (group[f"orientation_{axis}"][:].astype(float) for axis in "wxyz")
    require(abs(w * w + x * x + y * y + z * z - 1).max() < 1e-5, "an orientation is no unit quaternion")
    turned = 2 * numpy.arctan2(y, w) - group["rotation_angle_yaxis"][:]
    require(abs(numpy.remainder(turned + math.pi, 2 * math.pi) - math.pi).max() < 1e-5, "angle and quaternion differ")

    ours = config["brainforest"]
    distance = numpy.hypot(group["x"][:], group["z"][:])
    require(distance.max() <= ours["radius"] * (1 + 1e-6), "a soma outside the column")
    for name in ("morphology", "layer"):
        library = [text.decode() if isinstance(text, bytes) else text for text in group["@library"][name][:]]
        index = group[name][:]
        require(index.shape == (count,) and index.dtype == numpy.uint32 and index.max() < len(library), name)
        if name == "morphology":
            files = {path.stem for path in morphologies.glob("*.swc")}
            require(files == set(library), "the morphologies named are not the files that are there")
        else:
            limits = {layer["name"]: (layer["bottom"], layer["top"]) for layer in ours["layers"]}
            for soma, layer in zip(group["y"][:], index):
                bottom, top = limits[library[layer]]
                require(bottom <= soma <= top, f"a soma of {library[layer]} at {soma}")

for path in morphologies.glob("*.swc"):
    soma = next(line.split() for line in path.read_text().splitlines() if line and not line.startswith("#"))
    require(soma[1] == "1" and max(abs(float(value)) for value in soma[2:5]) < 2e-3, f"{path.name}: the soma is not at the origin")
print(f"{count} neurons of {len(library)} layers are laid out as published")

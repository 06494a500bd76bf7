# SPDX-License-Identifier: Apache-2.0
"""Loads exported cells in NEURON and holds them against what Brain Forest measured:

    neuron_cells.py MEASURED.csv HOC_FOLDER PYTHON_FOLDER

The CSV is that of `brainforest measure --csv` with the four metrics below; the folders hold a file of the same relative
name for each of its rows. Sections, length, lateral area and the soma's area must agree to 1e-5, as loaded (with segments
by d_lambda) and with one segment a section; neither a shape plot nor a run of the simulator may change or break a cell.
"""
import csv
import importlib.util
import math
import os
import re
import sys
import time

from neuron import h

h.load_file("stdlib.hoc")
metrics = ["number_of_sections", "total_length", "total_area", "soma_surface_area"]


def hoc_cell(path):
    name = re.search(r"^begintemplate (\w+)", open(path).read(), re.M)[1]
    if not h.name_declared(name) and not h.load_file(1, path):  # the same cell from another file is there already
        raise RuntimeError("NEURON cannot load it")
    return getattr(h, name)()


def python_cell(path):
    spec = importlib.util.spec_from_file_location("cell_of_a_file", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.Cell()


def area(sections):
    return sum(segment.area() for section in sections for segment in section)


def off(found, expected):
    return abs(found - expected) / max(abs(expected), 10.)  # a section without length gets one of 1e-6 um


def look(cell, expected):
    """What is wrong with a loaded cell: the largest relative difference, and sentences."""
    wrong = []
    all_sections = list(h.allsec())
    if len(all_sections) != len(list(cell.all)):
        wrong.append("%d sections in NEURON, %d in the list all" % (len(all_sections), len(list(cell.all))))
    soma = list(cell.somatic)
    names = {section.name() for section in soma}
    neurites = [section for section in cell.all if section.name() not in names]
    sections, length, lateral, soma_area = expected
    if len(neurites) != sections:
        wrong.append("%d sections, not %d" % (len(neurites), sections))
    differences = {"length": off(sum(section.L for section in neurites), length),
                   "area": off(area(neurites), lateral), "soma area": off(area(soma), soma_area)}
    points = {section: [section.x3d(0), section.y3d(0), section.z3d(0)] for section in neurites}
    h.define_shape()
    moved = [math.dist(p, [s.x3d(0), s.y3d(0), s.z3d(0)]) for s, p in points.items()]
    if moved and max(moved) > 1e-3:
        wrong.append("a shape plot moves a section by %g um" % max(moved))
    for section in cell.all:
        if section.n3d() < 2 or section.L < 9e-7:
            wrong.append("%s has %d points and a length of %g um" % (section.name(), section.n3d(), section.L))
    # It computes: a passive cell stays finite. Where no diameter was measured, one is given first.
    cell.fill_diameters(1)
    cell.geom_nseg(.1)
    for section in cell.all:
        section.insert("pas")
    h.finitialize(-60)
    for _ in range(3):
        h.fadvance()
    alone = {s.name() for s in cell.all if s.L < 1e-5 and s.parentseg() is None and not s.children()}  # lost single points
    if not all(math.isfinite(segment.v) for s in cell.all if s.name() not in alone for segment in s):
        wrong.append("the voltage is not a number after three steps")
    for section in cell.all:
        section.nseg = 1
    if min(expected[1:3]) > 0 and all(s.diam3d(i) != 1 for s in cell.all for i in range(s.n3d())):
        differences["area of one segment"] = off(area(neurites), lateral)
    wrong += ["%s is off by %.2g" % d for d in differences.items() if not d[1] <= 1e-5]
    return max(differences.values()), wrong


def main(measured, hoc_folder, python_folder):
    rows = list(csv.reader(open(measured)))
    columns = [next(i for i, name in enumerate(rows[0]) if name.split(" (")[0] == metric) for metric in metrics]
    paths = [row[0] for row in rows[1:]]
    root = os.path.commonpath([os.path.dirname(p) for p in paths])
    failed, worst, begin = 0, 0., time.monotonic()
    for row in rows[1:]:
        relative = os.path.splitext(os.path.relpath(row[0], root))[0]
        expected = [float(row[c] or 0) for c in columns]
        for load, path in ((hoc_cell, os.path.join(hoc_folder, relative + ".hoc")),
                           (python_cell, os.path.join(python_folder, relative + ".py"))):
            try:
                cell = load(path)
                difference, wrong = look(cell, expected)
                worst = max(worst, difference)
            except Exception as error:
                wrong = ["%s: %s" % (type(error).__name__, error)]
            cell = None
            failed += bool(wrong)
            for sentence in wrong:
                print("%s: %s" % (path, sentence))
            if len(list(h.allsec())):
                for section in list(h.allsec()):
                    h.delete_section(sec=section)
    print("%d cells, each as hoc and as Python: %d failed; largest difference %.2g; %.1f s" %
          (len(paths), failed, worst, time.monotonic() - begin))
    return failed > 0 or not paths


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:4]))

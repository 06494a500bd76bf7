#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Simulates a planted column with NEURON and writes what SONATA calls a compartment report, and its spikes:

    simulate_column.py CIRCUIT --out FOLDER [--ms 100] [--seed 1]

CIRCUIT is the folder that `brainforest plant` wrote. Each of its shapes becomes a cell of NEURON (`brainforest convert
--format neuron-python`), each of its neurons a cell of that class with Hodgkin and Huxley's channels (fewer in the dendrites),
synapses that noise drives, and connections to three neurons nearby whose delay grows with the distance. It is a toy: something
to play, not physiology. Rows go to the disk as they are computed. FOLDER then holds compartments.h5 and spikes.h5:

    brainforest activity FOLDER/compartments.h5 --circuit CIRCUIT --spikes FOLDER/spikes.h5 --out run.activity

Needs Debian's python3-neuron, python3-h5py and, on the PATH or in $BRAINFOREST, brainforest. Twenty neurons for 100 ms take some
minute. Units: ms, mV, µm.
"""
import argparse
import importlib.util
import json
import math
import os
import pathlib
import random
import subprocess
import sys
import tempfile

os.environ.pop("DISPLAY", None)  # NEURON opens windows where there is one
try:
    import h5py
    import numpy
    from neuron import h
except ImportError as missing:
    sys.exit("%s; Debian has it: apt-get install python3-neuron python3-h5py, and run this by /usr/bin/python3" % missing)

h.load_file("stdrun.hoc")
ROWS = 50  # of the report that are kept in memory


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("circuit", type=pathlib.Path, help="folder of a SONATA circuit with up to some 100 neurons")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder for compartments.h5 and spikes.h5")
    parser.add_argument("--ms", type=float, default=100., help="how long")
    parser.add_argument("--step", type=float, default=.1, help="ms between rows of the report")
    parser.add_argument("--dt", type=float, default=.025, help="ms of a step of the simulation")
    parser.add_argument("--rate", type=float, default=40., help="events a second at each noisy synapse")
    parser.add_argument("--seed", type=int, default=1)
    return parser.parse_args()


class Circuit:
    """What the simulation needs of it."""

    def __init__(self, folder):
        self.folder = folder
        config = json.loads((folder / "circuit_config.json").read_text())
        ((self.population, description),) = config["networks"]["nodes"][0]["populations"].items()
        self.morphologies = folder / description["morphologies_dir"].replace("$BASE_DIR/", "")
        with h5py.File(folder / "nodes.h5") as file:
            nodes = file["nodes"][self.population]
            self.ids = nodes["node_id"][:]
            group = nodes["0"]
            self.places = numpy.stack([group[axis][:] for axis in "xyz"], axis=1)
            names = group["@library/morphology"].asstr()[:]
            self.shapes = [names[i] for i in group["morphology"][:]]

    def classes(self, folder):
        """The class of cells of each shape, exported by Brain Forest."""
        program = os.environ.get("BRAINFOREST", "brainforest")
        try:
            subprocess.run([program, "convert", str(self.morphologies), "--format", "neuron-python", "--out", str(folder)],
                           check=True, stdout=subprocess.DEVNULL)
        except OSError as error:
            sys.exit("%s cannot be started (%s); put it on the PATH or its place into $BRAINFOREST" % (program, error.strerror))
        classes = {}
        for name in set(self.shapes):
            spec = importlib.util.spec_from_file_location("cell_of_a_shape", pathlib.Path(folder) / (name + ".py"))
            module = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(module)
            classes[name] = module.Cell
        return classes


def elements_of(cell):
    """Sections in SONATA's order with their number: the soma is 0, then axon, basal, apical and all others count from 1."""
    somatic = list(cell.somatic)
    named = [*cell.axonal, *cell.basal, *cell.apical]
    known = set(somatic) | set(named)
    others = [section for section in cell.all if section not in known]
    return somatic, [*named, *others]


def dress(cell):
    """Segments, then their channels."""
    for section in cell.all:
        section.Ra, section.cm = 150., 1.
    cell.geom_nseg(.3)
    full = {*cell.axonal, *cell.somatic}
    for section in cell.all:
        section.insert("hh")
        if section not in full:
            for segment in section:
                segment.hh.gnabar, segment.hh.gkbar = .04, .012  # a third of the squid's


class Network:
    def __init__(self, circuit, classes, options):
        self.cells = [classes[shape]() for shape in circuit.shapes]
        self.kept = []  # NEURON's objects live as long as Python knows them
        chance = random.Random(options.seed)
        for i, cell in enumerate(self.cells):
            dress(cell)
            self.drive(cell, chance, options)
            near = sorted(range(len(self.cells)), key=lambda j: math.dist(circuit.places[i], circuit.places[j]))[1:4]
            for j in near:
                self.connect(i, j, math.dist(circuit.places[i], circuit.places[j]), chance)

    def synapse(self, cell, chance):
        sections = [section for section in cell.all if section.L > 1.]
        section = chance.choices(sections, weights=[section.L for section in sections])[0]
        synapse = h.ExpSyn(section(chance.random()))
        synapse.tau, synapse.e = 2., 0.
        self.kept.append(synapse)
        return synapse

    def drive(self, cell, chance, options):
        """Noise: one synapse for 300 µm of dendrite, some 40 at most."""
        length = sum(section.L for section in cell.all)
        for _ in range(min(40, max(5, int(length / 300)))):
            source = h.NetStim()
            source.interval, source.number, source.start, source.noise = 1000. / options.rate, 1e9, chance.uniform(0, 20), 1.
            source.noiseFromRandom123(options.seed, len(self.kept), 0)
            connection = h.NetCon(source, self.synapse(cell, chance), 0., 0., .05)  # µS
            self.kept += [source, connection]

    def connect(self, i, j, distance, chance):
        soma = (list(self.cells[i].somatic) or self.cells[i].all)[0]
        connection = h.NetCon(soma(.5)._ref_v, self.synapse(self.cells[j], chance), 0., 1. + distance / 300., .05, sec=soma)
        self.kept.append(connection)

    def record_spikes(self):
        times, ids = h.Vector(), h.Vector()
        for i, cell in enumerate(self.cells):
            soma = (list(cell.somatic) or cell.all)[0]
            connection = h.NetCon(soma(.5)._ref_v, None, 0., 0., 0., sec=soma)
            connection.record(times, ids, i)
            self.kept.append(connection)
        return times, ids


class Report:
    """The mapping of all segments, and their values, written as they come."""

    def __init__(self, path, circuit, network, options, rows):
        elements, places, pointers, segments = [], [], [0], []
        for cell in network.cells:
            somatic, others = elements_of(cell)
            for i, section in enumerate(somatic):
                for segment in section:
                    elements.append(0), places.append((i + segment.x) / len(somatic)), segments.append(segment)
            for number, section in enumerate(others, 1):
                for segment in section:
                    elements.append(number), places.append(segment.x), segments.append(segment)
            pointers.append(len(elements))
        self.pointers = h.PtrVector(len(segments))
        for i, segment in enumerate(segments):
            self.pointers.pset(i, segment._ref_v)
        self.now, self.rows, self.written = h.Vector(len(segments)), [], 0
        self.file = h5py.File(path, "w")
        self.file.attrs["magic"], self.file.attrs["version"] = numpy.uint32(0x0A7A), numpy.array([0, 1], numpy.uint32)
        group = self.file.create_group("report/" + circuit.population)
        self.data = group.create_dataset("data", (rows, len(segments)), numpy.float32)
        self.data.attrs["units"] = "mV"
        mapping = group.create_group("mapping")
        mapping["node_ids"] = circuit.ids.astype(numpy.uint64)
        mapping["node_ids"].attrs["sorted"] = numpy.uint8(1)
        mapping["index_pointers"] = numpy.array(pointers, numpy.uint64)
        mapping["element_ids"] = numpy.array(elements, numpy.uint32)
        mapping["element_pos"] = numpy.array(places, numpy.float32)
        mapping["time"] = numpy.array([0., rows * options.step, options.step])
        mapping["time"].attrs["units"] = "ms"

    def row(self):
        self.pointers.gather(self.now)
        self.rows.append(self.now.as_numpy().astype(numpy.float32))
        if len(self.rows) == ROWS:
            self.flush()

    def flush(self):
        if self.rows:
            self.data[self.written:self.written + len(self.rows)] = self.rows
        self.written += len(self.rows)
        self.rows = []

    def close(self):
        self.flush()
        self.file.close()


def write_spikes(path, circuit, times, ids):
    times, ids = times.as_numpy(), ids.as_numpy().astype(int)
    order = numpy.lexsort((ids, times))
    with h5py.File(path, "w") as file:
        file.attrs["magic"], file.attrs["version"] = numpy.uint32(0x0A7A), numpy.array([0, 1], numpy.uint32)
        group = file.create_group("spikes/" + circuit.population)
        group.attrs.create("sorting", 2, dtype=h5py.enum_dtype({"none": 0, "by_id": 1, "by_time": 2}, basetype="u1"))
        group["timestamps"] = times[order]
        group["timestamps"].attrs["units"] = "ms"
        group["node_ids"] = circuit.ids[ids[order]].astype(numpy.uint64)


def main():
    options = arguments()
    if not all(0. < value < math.inf for value in (options.ms, options.step, options.dt, options.rate)):
        sys.exit("--ms, --step, --dt and --rate must be numbers above zero")
    if abs(options.step / options.dt - round(options.step / options.dt)) > 1e-6 * options.step / options.dt:
        sys.exit("--step must be a multiple of --dt, which is %g ms: rows lie at steps of the simulation" % options.dt)
    every, rows = round(options.step / options.dt), round(options.ms / options.step)
    if every < 1 or rows < 1:
        sys.exit("--step must be --dt or more, and --ms as long as a step")
    try:
        circuit = Circuit(options.circuit)
    except (OSError, KeyError, ValueError) as error:
        sys.exit("%s is no circuit that can be simulated (%s); name a folder that 'brainforest plant' made" %
                 (options.circuit, error))
    try:
        options.out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        sys.exit("%s cannot be made (%s); name another --out" % (options.out, error.strerror))
    with tempfile.TemporaryDirectory() as folder:
        network = Network(circuit, circuit.classes(folder), options)
    times, ids = network.record_spikes()
    part = options.out / "compartments.h5.part"
    report = Report(part, circuit, network, options, rows)
    h.celsius = 10.
    h.dt = options.dt
    h.finitialize(-65.)
    for row in range(rows):
        report.row()
        for _ in range(every):
            h.fadvance()
    report.close()
    part.rename(options.out / "compartments.h5")  # whole or not at all
    write_spikes(options.out / "spikes.h5", circuit, times, ids)
    print("%d neurons, %d compartments, %d rows of %g ms, %d spikes" %
          (len(network.cells), len(report.now), rows, options.step, len(times)))


if __name__ == "__main__":
    main()

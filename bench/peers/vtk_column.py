#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The column drawn with VTK, to be compared with our own: vtk_column.py FOLDER MODE.

FOLDER/column.json is what `brainforest bench peers` wrote: polylines of the distinct neurons, where they stand, colours,
size of the picture, cameras. Every camera is drawn once and timed; the pictures become FOLDER/MODE-0.png and so on, the
figures are printed as JSON. MODE:
  lines      polylines one pixel wide, as many as VTK draws fastest
  impostors  vtkOpenGLStickMapper: a box for every segment, in which the shader meets the cylinder ray by ray, true radii
  tubes      vtkTubeFilter with six sides, true radii
Somata are ray-met spheres (vtkOpenGLSphereMapper) in all of them. Colours, light and camera are ours; VTK has neither our
fog nor our rims, so `bench peers` compares without them. Needs python3-vtk9 and, without a display, xvfb.
"""
import json
import os
import resource
import sys
import time

try:
    import numpy as np
    import vtkmodules.vtkRenderingOpenGL2 as opengl
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints, vtkVersion
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkFiltersCore import vtkTubeFilter
    from vtkmodules.vtkIOImage import vtkPNGWriter
    from vtkmodules.vtkRenderingCore import (vtkActor, vtkLight, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow,
                                             vtkWindowToImageFilter)
except ImportError as error:
    sys.exit(f"VTK for Python cannot be loaded ({error}); install python3-vtk9, or name a Python that has it by --python")

PIECE = 1_000_000  # segments an actor holds: what a filter needs besides its result stays small


def matrices(q):
    """Rotations of unit quaternions x, y, z, w, one a row."""
    x, y, z, w = q.T
    rows = [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
            2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
            2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]
    return np.stack(rows, axis=1).reshape(-1, 3, 3)


def planted(column):
    """Pieces of the column in the world: points, radii, colours, and how many points each polyline has."""
    palette = (np.array(column["palette"]) * 255 + .5).astype(np.uint8)
    instances = np.array(column["instances"], dtype=np.float64)
    for index, neuron in enumerate(column["neurons"]):
        own = instances[instances[:, 0] == index]
        strips = np.array(neuron["strips"], dtype=np.int64)
        if not len(own) or not len(strips):
            continue
        points = np.array(neuron["points"], dtype=np.float32).reshape(-1, 4)
        kinds = np.repeat(np.array(neuron["kinds"], dtype=np.int64), strips)
        at_once = max(1, PIECE // max(1, int((strips - 1).sum())))
        for first in range(0, len(own), at_once):
            some = own[first:first + at_once]
            turned = np.einsum("nij,pj->npi", matrices(some[:, 4:8]).astype(np.float32), points[:, :3])
            world = (turned + some[:, None, 1:4].astype(np.float32)).reshape(-1, 3)
            colours = palette[(some[:, 8].astype(np.int64)[:, None] * 8 + kinds[None, :])].reshape(-1, 3)
            yield world, np.tile(points[:, 3], len(some)), colours, np.tile(strips, len(some))


def array(values, name):
    result = numpy_to_vtk(np.ascontiguousarray(values), deep=1)
    result.SetName(name)
    return result


def poly(points, colours, **others):
    data, where = vtkPolyData(), vtkPoints()
    where.SetData(numpy_to_vtk(np.ascontiguousarray(points, dtype=np.float32), deep=1))
    data.SetPoints(where)
    data.GetPointData().AddArray(array(colours, "colour"))
    for name, values in others.items():
        data.GetPointData().AddArray(array(values.astype(np.float32), name))
    return data


def vertices(data):
    """One cell for all points: without a cell VTK 9.1 takes them to be nowhere and draws nothing."""
    count = data.GetNumberOfPoints()
    cells = vtkCellArray()
    cells.SetData(numpy_to_vtkIdTypeArray(np.array([0, count]), deep=1), numpy_to_vtkIdTypeArray(np.arange(count), deep=1))
    data.SetVerts(cells)
    return data


def polylines(world, radii, colours, strips):
    data = poly(world, colours, radius=radii)
    cells = vtkCellArray()
    offsets = np.concatenate([[0], np.cumsum(strips)])
    cells.SetData(numpy_to_vtkIdTypeArray(offsets, deep=1), numpy_to_vtkIdTypeArray(np.arange(len(world)), deep=1))
    data.SetLines(cells)
    return data


def lines(*piece):
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(polylines(*piece))
    return mapper


def tubes(*piece):
    data = polylines(*piece)
    data.GetPointData().SetActiveScalars("radius")
    tube = vtkTubeFilter()
    tube.SetInputData(data)
    tube.SetNumberOfSides(6)
    tube.SetVaryRadiusToVaryRadiusByAbsoluteScalar()
    tube.Update()
    result = tube.GetOutput()
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(result)
    return mapper


def impostors(world, radii, colours, strips):
    begin = np.ones(len(world), dtype=bool)
    begin[np.cumsum(strips) - 1] = False  # a segment begins at every point but the last of its polyline
    begin = np.flatnonzero(begin)
    a, b = world[begin], world[begin + 1]
    length = np.linalg.norm(b - a, axis=1)
    radius = .5 * (radii[begin] + radii[begin + 1])
    direction = (b - a) / np.maximum(length, 1e-6)[:, None]
    data = poly(.5 * (a + b), colours[begin], orient=direction, scale=np.stack([length, radius, radius], axis=1))
    mapper = opengl.vtkOpenGLStickMapper()
    mapper.SetOrientationArray("orient")
    mapper.SetScaleArray("scale")
    mapper.SetInputData(vertices(data))
    return mapper


def somata(column):
    palette = (np.array(column["palette"]) * 255 + .5).astype(np.uint8)
    rows = [(i[1:4], column["neurons"][int(i[0])]["soma"], palette[int(i[8]) * 8 + 1]) for i in column["instances"]]
    rows = [row for row in rows if row[1] > 0]
    if not rows:
        return None
    places, radii, colours = zip(*rows)
    mapper = opengl.vtkOpenGLSphereMapper()
    mapper.SetScaleArray("radius")
    mapper.SetInputData(vertices(poly(np.array(places), np.array(colours), radius=np.array(radii))))
    return mapper


MODES = {"lines": lines, "impostors": impostors, "tubes": tubes}


def scene(column, mode):
    renderer = vtkRenderer()
    pieces = [MODES[mode](*piece) for piece in planted(column)]
    spheres = somata(column)
    for mapper in pieces + ([spheres] if spheres else []):
        mapper.SetScalarModeToUsePointFieldData()
        mapper.SelectColorArray("colour")
        mapper.SetColorModeToDirectScalars()
        actor = vtkActor()
        actor.SetMapper(mapper)
        look = actor.GetProperty()
        look.SetAmbient(.35)
        look.SetDiffuse(.65)
        if mode == "lines" and mapper is not spheres:
            look.LightingOff()
        renderer.AddActor(actor)
    top, bottom = column["background"]
    renderer.SetGradientBackground(True)
    renderer.SetBackground2(top)
    renderer.SetBackground(bottom)
    renderer.SetAutomaticLightCreation(False)
    light = vtkLight()
    light.SetLightTypeToCameraLight()
    x, y, z = column["light"]
    light.SetPosition(x, y, 1 - z)  # of a camera that stands at z = 1 and looks at the origin
    light.SetFocalPoint(0, 0, 1)
    renderer.AddLight(light)
    return renderer


def look(renderer, view):
    camera = renderer.GetActiveCamera()
    camera.SetPosition(view["eye"])
    camera.SetFocalPoint(view["target"])
    camera.SetViewUp(view["up"])
    camera.SetViewAngle(view["field_of_view"])
    renderer.ResetCameraClippingRange()
    near, far = camera.GetClippingRange()
    camera.SetClippingRange(max(near, view["near"]), far)


def main():
    if len(sys.argv) != 3 or sys.argv[2] not in MODES:
        sys.exit(f"usage: vtk_column.py FOLDER {'|'.join(MODES)}")
    if "DISPLAY" not in os.environ:
        try:
            os.execvp("xvfb-run", ["xvfb-run", "-a", sys.executable, *sys.argv])
        except OSError as error:
            sys.exit(f"VTK needs a display and there is none, nor xvfb-run ({error}); install xvfb and xauth")
    folder, mode = sys.argv[1:]
    with open(os.path.join(folder, "column.json"), encoding="utf-8") as file:
        column = json.load(file)

    start = time.perf_counter()
    renderer = scene(column, mode)
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(*column["size"])
    window.AddRenderer(renderer)
    look(renderer, column["cameras"][0])
    window.Render()
    window.WaitForCompletion()
    first = time.perf_counter() - start

    frames, cores = [], []
    for index, view in enumerate(column["cameras"]):
        wall, core = time.perf_counter(), time.process_time()
        look(renderer, view)
        window.Render()
        window.WaitForCompletion()
        frames.append(time.perf_counter() - wall)
        cores.append(time.process_time() - core)
        picture = vtkWindowToImageFilter()
        picture.SetInput(window)
        picture.SetInputBufferTypeToRGBA()
        picture.ReadFrontBufferOff()
        picture.ShouldRerenderOff()
        writer = vtkPNGWriter()
        writer.SetFileName(os.path.join(folder, f"{mode}-{index}.png"))
        writer.SetInputConnection(picture.GetOutputPort())
        writer.Write()
    driver = [line.split(":", 1)[1].strip() for line in window.ReportCapabilities().splitlines()
              if line.lower().startswith("opengl renderer string")]
    json.dump({"frame_seconds": frames, "core_seconds": cores, "first_picture_seconds": first,
               "peak_bytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
               "version": vtkVersion.GetVTKVersion(), "renderer": driver[0] if driver else ""}, sys.stdout)


if __name__ == "__main__":
    main()

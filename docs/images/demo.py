# SPDX-License-Identifier: AGPL-3.0-or-later
"""Draws demo.png from the results of the sample case:

    apt-get install python3-vtk9 xvfb xauth libgl1-mesa-dri
    make demo && xvfb-run -a /usr/bin/python3 docs/images/demo.py samples/ligament/out docs/images/demo.png
"""
import sys

import vtkmodules.vtkInteractionStyle  # noqa: F401  (registers factories)
import vtkmodules.vtkRenderingFreeType  # noqa: F401
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401
from vtkmodules.vtkCommonCore import vtkLookupTable
from vtkmodules.vtkFiltersCore import vtkPolyDataNormals, vtkThreshold
from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLUnstructuredGridReader
from vtkmodules.vtkRenderingAnnotation import vtkScalarBarActor
from vtkmodules.vtkRenderingCore import (vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow, vtkTextActor,
                                         vtkWindowToImageFilter)

SKIN = 2  # region of the skin, see docs/glossary.md
WIDTH, HEIGHT = 1800, 520


def surface(folder, name):
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(f"{folder}/{name}.vtp")
    return reader


def part(reader, association, array, value):
    """Where the array (association 0 = points, 1 = cells) has the value, as a surface."""
    chosen = vtkThreshold()
    chosen.SetInputConnection(reader.GetOutputPort())
    chosen.SetInputArrayToProcess(0, 0, 0, association, array)
    chosen.SetLowerThreshold(value)
    chosen.SetUpperThreshold(value)
    geometry = vtkGeometryFilter()
    geometry.SetInputConnection(chosen.GetOutputPort())
    return geometry


def skin(folder, name):
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(f"{folder}/{name}.vtu")
    return part(reader, 1, "region", SKIN)


def actor(source, colour, opacity=1.0, lookup=None):
    normals = vtkPolyDataNormals()
    normals.SetInputConnection(source.GetOutputPort())
    normals.SetFeatureAngle(180)
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(normals.GetOutputPort())
    if lookup:
        mapper.SetScalarModeToUsePointFieldData()
        mapper.SelectColorArray("distance_mm")
        mapper.SetLookupTable(lookup)
        mapper.UseLookupTableScalarRangeOn()
    else:
        mapper.ScalarVisibilityOff()
    result = vtkActor()
    result.SetMapper(mapper)
    result.GetProperty().SetColor(colour)
    result.GetProperty().SetOpacity(opacity)
    mapper.SetResolveCoincidentTopologyToPolygonOffset()
    if lookup:
        mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(-2, -2)
    result.GetProperty().SetAmbient(0.35)
    result.GetProperty().SetDiffuse(0.75)
    return result


def diverging(limit):
    """Blue (scan inside the model) over white to red (scan outside)."""
    table = vtkLookupTable()
    table.SetRange(-limit, limit)
    table.SetNumberOfTableValues(65)
    for i in range(65):
        t = i / 32 - 1
        warm, cold = (0.70, 0.09, 0.17), (0.13, 0.40, 0.67)
        end = warm if t > 0 else cold
        table.SetTableValue(i, *[1 - abs(t) * (1 - c) for c in end], 1)
    return table


def panel(window, column, title, actors, lookup=None):
    view = vtkRenderer()
    view.SetViewport(column / 4, 0, (column + 1) / 4, 1)
    view.SetBackground(1, 1, 1)
    for item in actors:
        view.AddActor(item)
    text = vtkTextActor()
    text.SetInput(title)
    text.SetPosition(14, HEIGHT - 44)
    text.GetTextProperty().SetFontSize(22)
    text.GetTextProperty().SetColor(0.1, 0.1, 0.1)
    view.AddViewProp(text)
    if lookup:
        bar = vtkScalarBarActor()
        bar.SetLookupTable(lookup)
        bar.SetTitle("scan outside (+) or inside (-) the model, mm")
        bar.SetNumberOfLabels(5)
        bar.SetLabelFormat("%.0f")
        bar.SetOrientationToHorizontal()
        bar.SetPosition(0.08, 0.02)
        bar.SetWidth(0.84)
        bar.SetHeight(0.16)
        bar.UnconstrainedFontSizeOn()
        bar.GetTitleTextProperty().SetFontSize(15)
        bar.GetLabelTextProperty().SetFontSize(15)
        bar.SetVerticalTitleSeparation(8)
        bar.GetTitleTextProperty().SetColor(0.1, 0.1, 0.1)
        bar.GetLabelTextProperty().SetColor(0.1, 0.1, 0.1)
        view.AddActor2D(bar)
    view.SetUseDepthPeeling(1)
    view.SetMaximumNumberOfPeels(12)
    camera = view.GetActiveCamera()
    camera.SetFocalPoint(0, -8, 0)
    camera.SetPosition(-140, -150, -420)
    camera.SetViewUp(0, -1, 0)
    camera.ParallelProjectionOn()
    camera.SetParallelScale(104)
    view.ResetCameraClippingRange()
    window.AddRenderer(view)


def main(folder, picture):
    muscle = actor(surface(folder, "muscle"), (0.80, 0.42, 0.38))
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetAlphaBitPlanes(1)
    window.SetMultiSamples(0)
    window.SetSize(WIDTH, HEIGHT)
    tones = {"prone": (0.91, 0.76, 0.65), "undeformed": (0.80, 0.80, 0.82), "supine": (0.91, 0.76, 0.65)}
    titles = {"prone": "prone (imaged)", "undeformed": "undeformed (no gravity)", "supine": "supine (predicted)"}
    for column, pose in enumerate(tones):
        gland = actor(surface(folder, f"{pose}_gland"), (0.55, 0.35, 0.60))
        panel(window, column, titles[pose], [muscle, gland, actor(skin(folder, pose), tones[pose], 0.45)])
    lookup = diverging(6)
    compared = surface(folder, "comparison")
    covered = actor(part(compared, 0, "covered", 1), (1, 1, 1), 1, lookup)
    panel(window, 3, "against the scan (grey: none)", [muscle, actor(compared, (0.8, 0.8, 0.8)), covered], lookup)
    window.Render()
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    writer = vtkPNGWriter()
    writer.SetFileName(picture)
    writer.SetInputConnection(grab.GetOutputPort())
    writer.Write()


main(*sys.argv[1:3])

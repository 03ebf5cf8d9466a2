# SPDX-License-Identifier: AGPL-3.0-or-later
"""Opens the results of a case in ParaView with the right colours.

    paraview --script=pipeline/paraview_case.py       (asks CASE_OUT, the environment variable, for the folder)
    CASE_OUT=mycase/out paraview --script=pipeline/paraview_case.py
    CASE_OUT=mycase/out pvpython pipeline/paraview_case.py picture.png

Shows, of what is there: the prone, undeformed and supine shape side by side (region colours), the gland inside, the model's
skin coloured by distance_mm to the scan (red: the scan lies outside), the scan's points, the error map of the diagnosis.
"""

import os
import sys

# Arrays that are asked for, per file: what the tools promise to write.
ARRAYS = {
    "prone.vtu": ("CELLS", "region"),
    "undeformed.vtu": ("CELLS", "region"),
    "supine.vtu": ("CELLS", "region"),
    "comparison.vtp": ("POINTS", "distance_mm"),
    "scan.vtp": ("POINTS", "distance_mm"),
    "error_map_supine.vtp": ("POINTS", "distance_mm"),
}
ORGANS = ("gland", "tumour")
APART_MM = 230
# Okabe and Ito: inner, skin, ligament, cut. ColorBrewer RdBu for distances, symmetric about 0.
REGION_NAMES = ("inner", "skin", "ligament", "cut")
REGION_COLOURS = (0.00, 0.45, 0.70, 0.94, 0.89, 0.26, 0.84, 0.37, 0.00, 0.80, 0.47, 0.65)
DISTANCE_COLOURS = ((-1.0, 0.13, 0.40, 0.67), (-0.5, 0.57, 0.77, 0.87), (0.0, 0.97, 0.97, 0.97), (0.5, 0.96, 0.65, 0.51),
                    (1.0, 0.70, 0.09, 0.17))
RANGE_MM = 4.0


def colour_regions(simple):
    table = simple.GetColorTransferFunction("region")
    table.InterpretValuesAsCategories = 1
    table.Annotations = [text for value, name in enumerate(REGION_NAMES, 1) for text in (str(value), name)]
    table.IndexedColors = list(REGION_COLOURS)


def colour_distances(simple):
    table = simple.GetColorTransferFunction("distance_mm")
    table.RGBPoints = [number for at, *rgb in DISTANCE_COLOURS for number in (RANGE_MM * at, *rgb)]
    table.NanColor = [0.72, 0.72, 0.72]
    return table


def show_pose(simple, view, folder, name, place):
    pose = simple.XMLUnstructuredGridReader(registrationName=name, FileName=[os.path.join(folder, name + ".vtu")])
    boundary = simple.Threshold(registrationName=name + " surface", Input=pose, Scalars=["CELLS", "region"],
                                LowerThreshold=1, UpperThreshold=4)
    shown = simple.Show(boundary, view)
    simple.ColorBy(shown, ("CELLS", "region"))
    shown.Opacity = 0.45
    shown.Position = place
    for organ in ORGANS:
        path = os.path.join(folder, f"{name}_{organ}.vtp")
        if os.path.exists(path):
            inside = simple.Show(simple.XMLPolyDataReader(registrationName=f"{name} {organ}", FileName=[path]), view)
            inside.DiffuseColor = [0.84, 0.37, 0.0]
            inside.Position = place


def show_distances(simple, view, folder, name, place, table):
    shown = simple.Show(simple.XMLPolyDataReader(registrationName=name, FileName=[os.path.join(folder, name)]), view)
    simple.ColorBy(shown, ("POINTS", "distance_mm"))
    shown.Position = place
    table.RescaleTransferFunction(-RANGE_MM, RANGE_MM)
    bar = simple.GetScalarBar(table, view)
    bar.Title, bar.ComponentTitle = "distance, mm", "scan outside > 0"
    shown.SetScalarBarVisibility(view, True)


def main():
    from paraview import simple

    folder = os.environ.get("CASE_OUT", "out")
    there = [name for name in ARRAYS if os.path.exists(os.path.join(folder, name))]
    if not there:
        raise SystemExit(f"{folder} holds no results: set CASE_OUT to the out folder of a case that make has run")
    view = simple.GetActiveViewOrCreate("RenderView")
    view.OrientationAxesVisibility = 1
    colour_regions(simple)
    table = colour_distances(simple)
    column = 0
    for name in there:
        place = [column * APART_MM, 0.0, 0.0]
        if name.endswith(".vtu"):
            show_pose(simple, view, folder, name[:-4], place)
        elif name == "scan.vtp":
            place[0] -= APART_MM  # over the model's skin
            show_distances(simple, view, folder, name, place, table)
            simple.Hide(simple.FindSource(name), view)
            continue
        else:
            show_distances(simple, view, folder, name, place, table)
        column += 1
    # From the front: patient's right at the left of the picture, head up.
    simple.ResetCamera(view)
    view.CameraPosition = [view.CameraFocalPoint[0], view.CameraFocalPoint[1] - 1500, view.CameraFocalPoint[2]]
    view.CameraViewUp = [0, 0, 1]
    simple.ResetCamera(view)
    simple.Render(view)
    if len(sys.argv) > 1 and sys.argv[-1].endswith(".png"):
        simple.SaveScreenshot(sys.argv[-1], view, ImageResolution=[1800, 700])


if __name__ in ("__main__", "__vtkconsole__"):
    main()

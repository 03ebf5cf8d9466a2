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
LABELS = {
    "prone.vtu": "prone (MRI)",
    "undeformed.vtu": "undeformed",
    "supine.vtu": "supine, predicted",
    "comparison.vtp": "distance to the scan",
    "scan.vtp": "distance to the model",
    "error_map_supine.vtp": "error map of the diagnosis",
}
APART_MM = 200
LABEL_MM = 85  # over the middle of a body
SIZE = (1500, 1050)
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


def label(simple, view, text, place):
    simple.RenameSource(text + " (label)", simple.Text(Text=text))
    shown = simple.Show(simple.FindSource(text + " (label)"), view)
    shown.TextPropMode = "Billboard 3D Text"
    shown.BillboardPosition = [place[0] - 0.4 * APART_MM, place[1], place[2] + LABEL_MM]
    shown.Color = [0.1, 0.1, 0.1]
    shown.FontSize = 22


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
    return pose


def show_distances(simple, view, folder, name, place):
    skin = simple.XMLPolyDataReader(registrationName=name, FileName=[os.path.join(folder, name)])
    coloured = skin
    if name == "comparison.vtp":  # where the scan has a hole a distance says nothing: grey
        coloured, hole = (simple.Threshold(registrationName=f"{name} {what}", Input=skin, Scalars=["POINTS", "covered"],
                                           LowerThreshold=1, UpperThreshold=1, Invert=invert)
                          for what, invert in (("covered", 0), ("not covered", 1)))
        bare = simple.Show(hole, view)
        simple.ColorBy(bare, None)
        bare.AmbientColor = bare.DiffuseColor = [0.72, 0.72, 0.72]
        bare.Position = place
    shown = simple.Show(coloured, view)
    simple.ColorBy(shown, ("POINTS", "distance_mm"))
    shown.Position = place
    return skin


def centre_of(source):
    x0, x1, y0, y1, z0, z1 = source.GetDataInformation().GetBounds()
    return [(x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2]


def lay_out(simple, view, folder, names):
    """Shapes in the upper row, error maps in the lower one. Returns where the picture's middle is, and how wide it is."""
    columns, centre = {0: 0, 1: 0}, None
    for name in names:
        row = 0 if name.endswith(".vtu") else 1
        on_model = name == "scan.vtp" and columns[1] > 0
        column = columns[row] - (1 if on_model else 0)
        place = [column * APART_MM, 0.0, -row * APART_MM]
        show = show_pose if row == 0 else show_distances
        source = show(simple, view, folder, name[:-4] if row == 0 else name, place)
        if on_model:  # over the model's skin: to be switched on in the browser of the pipeline
            simple.Hide(source, view)
            continue
        if centre is None:
            centre = centre_of(source)
        label(simple, view, LABELS[name], [c + p for c, p in zip(centre, place)])
        columns[row] += 1
    across, down = max(columns.values()), 1 + (columns[1] > 0)
    middle = [centre[0] + (across - 1) * APART_MM / 2, centre[1], centre[2] - (down - 1) * APART_MM / 2]
    return middle, across * APART_MM, down * APART_MM


def look_from_the_front(view, middle, width_mm, height_mm):
    """Patient's right at the left of the picture, head up."""
    view.CameraParallelProjection = 1
    view.CameraFocalPoint = middle
    view.CameraPosition = [middle[0], middle[1] - 1500, middle[2]]
    view.CameraViewUp = [0, 0, 1]
    view.CameraParallelScale = max(height_mm / 2, width_mm / 2 * SIZE[1] / SIZE[0]) * 1.05


def show_legend(simple, view, table):
    table.RescaleTransferFunction(-RANGE_MM, RANGE_MM)
    bar = simple.GetScalarBar(table, view)
    bar.Title, bar.ComponentTitle = "scan outside the model, mm", ""
    bar.TitleFontSize, bar.LabelFontSize = 18, 18
    bar.TitleColor = bar.LabelColor = [0.1, 0.1, 0.1]
    bar.LabelFormat = bar.RangeLabelFormat = "%.0f"
    bar.AutoOrient, bar.Orientation, bar.WindowLocation = 0, "Horizontal", "Lower Right Corner"
    bar.ScalarBarLength = 0.25
    bar.Visibility = 1


def main():
    from paraview import simple

    folder = os.environ.get("CASE_OUT", "out")
    there = [name for name in ARRAYS if os.path.exists(os.path.join(folder, name))]
    if not there:
        raise SystemExit(f"{folder} holds no results: set CASE_OUT to the out folder of a case that make has run")
    view = simple.GetActiveViewOrCreate("RenderView")
    view.OrientationAxesVisibility = 1
    view.UseColorPaletteForBackground = 0
    view.Background = [1, 1, 1]
    view.ViewSize = list(SIZE)
    colour_regions(simple)
    table = colour_distances(simple)
    middle, width_mm, height_mm = lay_out(simple, view, folder, there)
    if any(name.endswith(".vtp") for name in there):
        show_legend(simple, view, table)
    simple.Render(view)  # the first one sets a camera of its own
    look_from_the_front(view, middle, width_mm, height_mm)
    simple.Render(view)
    if len(sys.argv) > 1 and sys.argv[-1].endswith(".png"):
        simple.SaveScreenshot(sys.argv[-1], view, ImageResolution=list(SIZE))


if __name__ in ("__main__", "__vtkconsole__"):
    main()

# SPDX-License-Identifier: AGPL-3.0-or-later
"""Memory, time and cores of each stage, from the sizes of what the stages before have left (cohort/README.md has the
measurements). A second attempt gets twice as much."""

import json

# Of each stage: MB at rest (of them 200 of Snakemake itself, which each job runs), MB per million voxels, MB per thousand
# nodes; minutes at rest, minutes per thousand nodes; cores. Twice what was measured at 1.5 and 42 million voxels and at 2500
# nodes, memory and time alike; LARGEST is for a stage that is not named.
ROWS = {
    "segment": (600, 20, 0, 10, 0, 1),
    "reconstruct": (600, 20, 0, 10, 0, 1),
    "decimate": (700, 5, 0, 20, 0, 1),
    "mesh": (700, 10, 0, 20, 0, 1),
    "simulate": (600, 0, 100, 15, 4, 2),
    "compare": (600, 0, 50, 10, 0, 1),
    "calibrate": (700, 0, 200, 60, 30, 2),
    "diagnose": (1000, 0, 800, 120, 60, 2),
    "ladder": (1000, 0, 800, 360, 180, 2),
    "parts": (600, 0, 150, 120, 60, 1),
    "sensitivity": (600, 0, 150, 120, 60, 2),
    "report": (800, 0, 50, 20, 0, 1),
}
LARGEST = (2000, 60, 800, 360, 180, 2)
# Where a size is not known yet: a breast at 1 mm, a mesh of 2500 triangles.
USUAL_VOXELS, USUAL_NODES = 8e6, 4000


def number(file, key, otherwise):
    """Of a sidecar; `otherwise` where it is not there yet."""
    try:
        return float(json.loads(file.read_text())[key])
    except (OSError, ValueError, KeyError, TypeError):
        return otherwise


def voxels(case_images, out):
    """Of the image: as the segmentation counted them, else its bytes: a voxel has at least one unless it is compressed."""
    counted = 0
    try:
        counted = sum(json.loads((out / "labels.json").read_text())["voxels"].values())
    except (OSError, ValueError, KeyError, AttributeError, TypeError):
        pass
    return counted or max(USUAL_VOXELS, sum(file.stat().st_size for file in case_images if file.is_file()))


def of_stage(stage, case_images, out, attempt, factor=1.0):
    """(MB, minutes, cores) of a stage of the case with its results in `out`; `factor` scales the memory."""
    rest, per_voxel, per_node, minutes, minutes_per_node, cores = ROWS.get(stage, LARGEST)
    nodes = number(out / "mesh.json", "nodes", USUAL_NODES)
    mb = factor * (rest + per_voxel * voxels(case_images, out) / 1e6 + per_node * nodes / 1e3)
    return int(mb) * attempt, int(minutes + minutes_per_node * nodes / 1e3) * attempt, cores

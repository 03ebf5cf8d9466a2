// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "segmentation/steps/step_table.h"

namespace supine::segmentation {

// One reader per kind of step: from its table, whose keys are those of docs/supine-segment.md, to its struct.
// Each throws InputError naming file, line, step, key, value and bound.

// Greys: grey_step_readers.cpp.
Step read_noise_floor(const StepTable& table);
Step read_bias(const StepTable& table);
Step read_smooth(const StepTable& table);

// Masks from greys: region_step_readers.cpp.
Step read_threshold(const StepTable& table);
Step read_otsu(const StepTable& table);
Step read_grow(const StepTable& table);
Step read_march(const StepTable& table);

// Masks from masks, and the labels: mask_step_readers.cpp.
Step read_islands(const StepTable& table);
Step read_holes(const StepTable& table);
Step read_combine(const StepTable& table);
Step read_morph(const StepTable& table);
Step read_layer(const StepTable& table);
Step read_region(const StepTable& table);
Step read_paint(const StepTable& table);

// Anatomy: anatomy_step_readers.cpp.
Step read_body(const StepTable& table);
Step read_chest(const StepTable& table);
Step read_planes(const StepTable& table);
Step read_gland(const StepTable& table);

/// In the order of step_names.
constexpr Step (*step_readers[])(const StepTable&) = {
    read_noise_floor, read_bias,    read_smooth, read_threshold, read_grow,   read_islands,
    read_holes,       read_combine, read_morph,  read_layer,     read_region, read_paint,
    read_body,        read_chest,   read_planes, read_otsu,      read_march,  read_gland};
static_assert(std::size(step_readers) == std::variant_size_v<Step>);

}  // namespace supine::segmentation

// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "pipeline/case/case.h"
#include "pipeline/tool/tool.h"
#include "segmentation/formats/image_io.h"

namespace supine::pipeline {

/// A volume of a case, its own image or another: a file, or a folder with a DICOM series (image.series names it, where
/// there are several). A file that names no frame is in image.frame, else in case.frame. Files read are noted in @p
/// run, what was assumed is warned of.
/// @throws InputError  as read_image() and read_dicom(); a series of another position or side than the case says
segmentation::ImageFile read_case_volume(Run& run, const Case& measured, const std::filesystem::path& file);

}  // namespace supine::pipeline

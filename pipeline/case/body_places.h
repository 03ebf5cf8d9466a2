// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <vector>

#include "meshing/body_surface.h"
#include "pipeline/case/case.h"
#include "pipeline/tool/tool.h"

namespace supine::pipeline {

/// The supports of a case whose image is a surface, their files read.
/// @throws InputError  a file that cannot be read
std::vector<meshing::BodyPlace> read_supports(Run& run, const Case& description);

/// Its parts.
/// @throws InputError  also a surface that is not closed, crosses itself or faces inward
std::vector<meshing::BodyPlace> read_parts(Run& run, const Case& description);

}  // namespace supine::pipeline

// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>

#include "diagnosis/evidence/priors.h"
#include "pipeline/case/case.h"

namespace supine::pipeline {

/// How well measurements are known, 1 sigma, as said on the command line: for every pose, in place of the case's keys.
struct KnownOptions {
  std::optional<double> registration_mm;  ///< its turn goes with it, 0.75 degrees per mm
  std::optional<double> segmentation_mm, chest_wall_mm;
};

/// The priors of a diagnosis: the options, else what the case says of a pose or its image, else the defaults.
diagnosis::Priors case_priors(const Case& description, const KnownOptions& options);

}  // namespace supine::pipeline

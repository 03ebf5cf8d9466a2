// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "diagnosis/examine.h"
#include "diagnosis/hot_spots.h"
#include "diagnosis/next_measurement.h"
#include "pipeline/case/measured_case.h"

namespace supine::pipeline {

/// Findings with what is told beside them.
struct DiagnosisResult {
  std::unique_ptr<diagnosis::Findings> found;
  std::vector<diagnosis::HotSpot> hot_spots;
  std::vector<diagnosis::Separation> next;
  /// Triangles of a surface whose mesh errs less, where the mesh errs by more than anything else does; 0 where not.
  Eigen::Index finer_triangles = 0;
};

/// @param given  the base model: where priors stand
diagnosis::Subject subject_of(const MeasuredCase& measured, const simulation::Model& given,
                              const std::vector<double>& noise_mm);

/// Hot spots and next measurements of findings.
DiagnosisResult complete(const MeasuredCase& measured, std::unique_ptr<diagnosis::Findings> found);

/// Keys as in docs/supine-diagnose.md.
nlohmann::ordered_json diagnosis_figures(const DiagnosisResult& result);

/// The lines a person reads.
void say_diagnosis(const Run& run, const DiagnosisResult& result);

/// diagnosis.vtp and the files beside it: error maps of the model's skin, scan points with the shapes of the effects.
void write_diagnosis_files(Run& run, const MeasuredCase& measured, const DiagnosisResult& result,
                           const std::filesystem::path& folder);

}  // namespace supine::pipeline

// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "meshing/anatomy.h"
#include "meshing/quality.h"
#include "meshing/tetrahedra/curve.h"
#include "meshing/tetrahedra/tissue_fractions.h"

namespace supine::pipeline {

class Run;

/// What is known of a mesh besides the mesh itself.
struct MeshFindings {
  int order = 1;
  std::string side;
  meshing::QualityReport quality;
  std::optional<meshing::CurveReport> curve;
  std::optional<meshing::FractionReport> fractions;
  std::optional<meshing::Anatomy> anatomy;
  std::vector<std::pair<std::string, double>> parts_ml = {};      ///< named parts, by name
  std::vector<std::pair<std::string, double>> supports_cm2 = {};  ///< area of the faces on each named support
};

/// Figures of mesh.json.
void fill(nlohmann::ordered_json& json, const MeshFindings& findings);

/// The same for a person.
void say(const MeshFindings& findings, const Run& run);

}  // namespace supine::pipeline

// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/landmarks.h"
#include "pipeline/case/case_inputs.h"
#include "reconstruction/surface.h"
#include "simulation/embedding.h"

namespace supine::pipeline {

/// Surfaces of organs and landmarks of the imaged body, which move along with the tissue they lie in.
struct Passengers {
  struct Organ {
    std::string name;  ///< "gland", "tumour", …
    reconstruction::Surface surface;
    simulation::Embedding places;
  };
  struct Marked {
    std::vector<std::string> names;
    simulation::Embedding places;
  };
  std::vector<Organ> organs;
  std::optional<Marked> landmarks;
};

/// Organs of the tissues that the mesh has (FOLDER/gland.vtp, …) and the case's landmarks in the imaged pose. Warns of
/// landmarks over 2 mm outside the body.
/// @throws InputError  an organ of another body: over 10 % of its points more than 5 mm outside; a landmark more than
///   10 mm outside
Passengers read_passengers(Run& run, const CaseInputs& inputs, const std::filesystem::path& folder);

/// Writes NAME_gland.vtp, …, and NAME_landmarks.csv to @p folder.
/// @param x  #N by 3, the shape called @p name, mm
void write_passengers(Run& run, const Passengers& passengers, const Points& x, const std::filesystem::path& folder,
                      const std::string& name);

}  // namespace supine::pipeline

// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/work/passengers.h"

#include <fmt/format.h>

#include "common/error.h"
#include "reconstruction/surface_io.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;

// Landmarks are marked on the imaged body: a little noise is to be expected, no more.
constexpr double landmark_warning_mm = 2, landmark_bound_mm = 10;

/// An organ of another body, or one that was moved since.
void check_lies_in_mesh(const fs::path& file, const Points& points, const simulation::Embedding& places) {
  constexpr double far_mm = 5, most_far = 0.1;
  const auto far = (places.outside_mm().array() > far_mm).count();
  if (static_cast<double>(far) <= most_far * static_cast<double>(points.rows())) return;
  Eigen::Index worst = 0;
  const double distance = places.outside_mm().maxCoeff(&worst);
  throw InputError(fmt::format(
      "{}: {:.0f} % of its points lie more than {:g} mm outside the imaged body (bound {:.0f} %), the farthest "
      "{:.1f} mm "
      "at ({:.1f}, {:.1f}, {:.1f}) mm. It belongs to another mesh: make it again with supine-reconstruct, or take it "
      "away",
      file.string(), 100.0 * static_cast<double>(far) / static_cast<double>(points.rows()), far_mm, 100 * most_far,
      distance, points(worst, 0), points(worst, 1), points(worst, 2)));
}

void check_landmarks(Run& run, const CaseInputs& in, const Landmarks& landmarks, const simulation::Embedding& places) {
  if (landmarks.names.empty()) return;
  Eigen::Index worst = 0;
  const double distance = places.outside_mm().maxCoeff(&worst);
  if (distance <= landmark_warning_mm) return;
  const std::string what = fmt::format("{}: landmark '{}' lies {:.1f} mm outside the imaged body",
                                       in.description.prone_landmarks->string(), landmarks.names[worst], distance);
  if (distance <= landmark_bound_mm) return run.warn(what + "; it moves along with the closest tissue");
  Points flipped = landmarks.points;
  flipped.leftCols<2>() *= -1;
  const double other = simulation::Embedding(in.mesh, flipped).outside_mm().maxCoeff();
  throw InputError(fmt::format("{} (bound {} mm). {}", what, landmark_bound_mm,
                               other <= landmark_bound_mm
                                   ? "With x and y negated all lie inside: the file is RAS and case.frame says LPS, or "
                                     "the other way round"
                                   : "Check its unit (mm), its frame, and that it was marked in the image itself"));
}

}  // namespace

Passengers read_passengers(Run& run, const CaseInputs& in, const fs::path& folder) {
  Passengers found;
  for (int tissue = 0; tissue < segmentation::tissue_count; ++tissue) {
    const std::string name(segmentation::tissue_names[tissue]);
    const fs::path file = folder / (name + ".vtp");
    // A surface of a tissue the mesh does not have is left over from other labels.
    if (in.mesh.fraction.col(tissue).sum() == 0 || !fs::exists(file)) continue;
    auto surface = reconstruction::read_surface(run.input(file));
    simulation::Embedding places(in.mesh, surface.points);
    check_lies_in_mesh(file, surface.points, places);
    found.organs.push_back({name, std::move(surface), std::move(places)});
  }
  if (in.description.prone_landmarks) {
    Landmarks landmarks = read_landmarks(run.input(*in.description.prone_landmarks), in.description.frame);
    simulation::Embedding places(in.mesh, landmarks.points);
    check_landmarks(run, in, landmarks, places);
    found.landmarks = {std::move(landmarks.names), std::move(places)};
  }
  return found;
}

void write_passengers(Run& run, const Passengers& passengers, const Points& x, const fs::path& folder,
                      const std::string& name) {
  for (const auto& organ : passengers.organs) {
    reconstruction::Surface moved = organ.surface;
    moved.points = organ.places.at(x);
    reconstruction::write_surface(moved, run.output(folder / (name + "_" + organ.name + ".vtp")));
  }
  if (passengers.landmarks)
    write_landmarks({passengers.landmarks->names, passengers.landmarks->places.at(x)},
                    run.output(folder / (name + "_landmarks.csv")));
}

}  // namespace supine::pipeline

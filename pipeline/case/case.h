// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "segmentation/steps/recipe.h"
#include "segmentation/support_voxels.h"
#include "segmentation/tissue.h"

namespace supine::pipeline {

/// Where the case allows the model to end in a cut face; anywhere else a cut is an error.
struct AllowedCuts {
  bool excluded = false;  ///< next to the label `excluded`
  bool edge = false;      ///< at the edge of the image
  bool rim = false;       ///< bare tissue within rim_mm of the muscle
  double rim_mm = 10;     ///< > 0
};

/// How well a measurement is known, 1 sigma, where the case says so (docs/case-file.md).
struct Known {
  std::optional<double> registration_mm, registration_deg;  ///< place of the scan, in each direction
  std::optional<double> gravity_deg;                        ///< direction of gravity
  std::optional<double> breath_mm;                          ///< the muscle under the mound
  std::optional<double> noise_shared_mm;                    ///< what neighbouring points of the scan err together
};

/// One body position: how things fall, and what was measured there.
struct Pose {
  std::string name;                                ///< "prone", "supine", or the user's
  Eigen::Vector3d gravity;                         ///< unit vector, LPS; zero where it acts on nothing (buoyancy)
  std::optional<std::filesystem::path> surface;    ///< measured surface
  std::optional<double> noise_mm;                  ///< 1 sigma along the normal; absent = estimate it
  std::optional<std::filesystem::path> landmarks;  ///< CSV
  Known known;
  /// How many points that err one by one the scan is worth, as noise_mm errs; absent = as many as it has.
  std::optional<double> independent_points = {};
};

/// How supine-register lays a scan on the body.
struct RegisterOn {
  std::vector<std::string> on;     ///< of landmarks, model, support; empty: landmarks where there are, and the model
  std::vector<std::string> rigid;  ///< names of landmarks that do not move with the tissue
};

/// A support or a part of a body whose image is a surface; see meshing/body_surface.h.
struct NamedPlace {
  std::string name;
  std::optional<std::filesystem::path> file;  ///< a surface; else a plane
  Eigen::Vector3d point = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
  double within_mm = 0.5;
  bool beyond = false;
};

/// case.toml: what was measured. Coordinates are LPS after reading, whatever `frame` says.
struct Case {
  std::filesystem::path folder;
  std::string name;
  std::string frame = "LPS";    ///< of coordinates in files that name none: LPS or RAS
  std::string body = "breast";  ///< breast or object
  std::string side;             ///< left, right or both; none of an object

  std::filesystem::path image_file;   ///< absolute or relative to the working directory, exists
  std::string image_kind;             ///< labels, mri or surface
  std::string imaged_pose = "prone";  ///< the pose that was imaged; undeformed: free of load
  std::string image_frame;            ///< of a volume that names none (patient_frame.h); empty = `frame`
  std::string image_series;           ///< of a DICOM folder: number, description or uid; empty = the only one
  std::optional<std::filesystem::path> second_file;  ///< another series of the same visit, of an image of kind mri
  std::string second_series;                         ///< as image_series, of second_file
  std::optional<double> segmentation_mm;             ///< how well the place of the imaged skin is known, 1 sigma
  AllowedCuts cut;
  std::map<int, segmentation::Tissue> labels;  ///< value in the file → tissue (kind = labels)
  std::optional<segmentation::Recipe> recipe;  ///< kind = mri
  /// With names, where [image.labels] gives some; then muscle beside them is one too. In file order, muscle first.
  std::vector<segmentation::LabelSupport> label_supports;
  std::vector<NamedPlace> supports, parts;  ///< kind = surface

  /// The imaged one first (of a body imaged free of load one named undeformed, without gravity), then supine where
  /// there is one, then in file order.
  std::vector<Pose> poses;
  std::optional<std::filesystem::path> prone_landmarks;  ///< in the imaged pose
  /// Default: supine, where it has a surface or the body is a breast, else every measured pose.
  std::vector<std::string> calibrated_poses;
  RegisterOn register_on;
  std::optional<std::filesystem::path> cohort;  ///< a population's priors: a cohort.json, exists
  std::vector<std::string> expected;            ///< effects of the catalogue that are as likely there as not

  const Pose& imaged() const { return poses.front(); }
  /// The pose that stands for what is predicted: supine, or the first other than the imaged one.
  const Pose& predicted() const { return poses[poses.size() > 1 ? 1 : 0]; }
  /// Name of a file of that pose: "comparison.json" is that of supine, of another pose it is "comparison_POSE.json".
  static std::string file_of(const std::string& stem, const std::string& pose, const std::string& end) {
    return stem + (pose == "supine" ? "" : "_" + pose) + end;
  }
  bool is_object() const { return body == "object"; }
  const Pose& pose(std::string_view name) const;  ///< @throws InputError listing the poses there are
};

/// Reads and checks FOLDER/case.toml.
/// @throws InputError  naming file, line, key, value and bound: unknown or missing key, wrong type, unknown tissue,
///   a label value listed twice or empty, gravity not unit (1e-3), zero in a pose that is neither imaged nor measured,
///   or the same in two poses, a support or part that is neither plane nor surface, a file that is not there
Case read_case(const std::filesystem::path& folder);

}  // namespace supine::pipeline

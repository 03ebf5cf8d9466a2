// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/model_skin.h"
#include "calibration/scan.h"

namespace supine::registration {

/// A shape that a scan may show.
struct PoseShape {
  std::string pose;
  const calibration::ModelSkin* skin;
  Points displacement;  ///< of the skin's rows, from the imaged pose, mm; zero for the imaged pose
};

/// Another way to read a scan.
struct Reading {
  std::string words;   ///< "mirrored (x negated)", "turned by 90° about the axis …", "in cm", "as a scan of tilt45"
  double misfit_mm;    ///< see examine_readings()
  double covered = 0;  ///< share of the skin that the scan lies over
};

/// How well a scan fits as given, and how much better it would fit if it were read otherwise.
struct Readings {
  Reading given;
  std::optional<Reading> mirrored;  ///< left for right; none where nothing of it meets the skin
  std::optional<Reading> upended;   ///< head for feet; likewise
  std::optional<Reading> better;    ///< fits far better than as given

  /// A scan of the other side, or of one turned head for feet, would fit as well: its shape does not say which it is.
  bool side_unverified() const { return fits_as_well(mirrored); }
  bool head_unverified() const { return fits_as_well(upended); }

  bool fits_as_well(const std::optional<Reading>& other) const;
};

/// The scan as given against itself mirrored, turned by quarters, shifted, in other units or of another size, and
/// against the body's other poses.
///
/// Each reading may still shift and turn a little (as given 2 mm and 1.5°, 1 sigma) and the body move further or less
/// far than predicted (a share of 0.4, 1 sigma), so that a model that is not calibrated does not speak against a scan.
/// The misfit is the root of the mean of min(d, 10 mm)² over the scan points over the skin. Another reading fits far
/// better when it leaves less than half of a misfit of more than 2 mm over at least four fifths of the skin that
/// the scan covers as given, and a quarter of all of it; a turned or mirrored one also less than 0.6, one of
/// another size than units make less than 0.75, of what the scan itself leaves when it may move as far (60 mm, 5°).
/// Distances are taken at up to 240 points; the
/// answer does not depend on threads.
/// @param shapes  first that of the scan's own pose; of others at least the imaged one
Readings examine_readings(const calibration::Scan& scan, const std::vector<PoseShape>& shapes);

/// Refuses a scan that another reading fits far better, and one that fits in none: misfit over 8 mm, of 10 that it can
/// be.
/// @param landmarks  whether the scan has landmarks, which say what is left
/// @return  what a person should know of it; empty: nothing
/// @throws InputError  naming the reading, the misfits and what to do
std::string check_readings(const Readings& readings, const std::string& pose, bool landmarks, const std::string& name);

}  // namespace supine::registration

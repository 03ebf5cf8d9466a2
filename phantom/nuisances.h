// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "phantom/causes/cause.h"
#include "phantom/placement.h"
#include "phantom/random_field.h"
#include "simulation/model.h"

namespace supine::phantom {

/// A number that is never known: normal around 0, which is what the base model has.
struct NuisanceRow {
  std::string name;  ///< ends in its unit where it has one; log_…: added to the ln of what it is of
  double sigma;
  bool of_pose;                                             ///< another one in every pose but prone
  double lower = -std::numeric_limits<double>::infinity();  ///< drawn again below it
};

/// All of them, as docs/supine-phantom.md lists them.
const std::vector<NuisanceRow>& nuisance_rows();

/// What every patient brings beside the causes: the numbers above; patchy tissue and skin and a muscle that lies
/// elsewhere, as random fields; an error that the points of a scan share. Depends on the seed alone.
class Nuisances {
 public:
  enum class Kind {
    realistic,  ///< a tenth of the seeds has numbers three times as wide; tissue that stiffens mildly
    prior       ///< from the priors and nothing else
  };
  /// @param causes  what they say of a number that is one for all poses (CauseKind::nuisance) stands in its place
  /// @param poses   all but prone
  Nuisances(std::uint64_t seed, Kind kind, const std::vector<Cause>& causes, const std::vector<std::string>& poses);

  /// Sets Poisson's ratio and the stiffness of interface and cut.
  void change(simulation::Model& model) const;
  /// Changes the fields of one pose. What Young's modulus, the skin's and breath can make up for is taken out of the
  /// random fields.
  void apply(const Stage& stage, simulation::Fields<double>& fields) const;
  /// Of the scan of a pose.
  Placement placement(const std::string& pose) const;
  /// What the points of a scan err together, mm along the skin's normal at a place in that pose.
  RandomField scan_error(const std::string& pose) const;
  /// How much thicker the labels are drawn than the body is, mm.
  double labels_grown_mm() const { return -numbers_.at("imaged_skin_mm"); }

  double width() const { return width_; }  ///< 1, or 3: of the numbers against their sigma
  const std::map<std::string, double>& numbers() const { return numbers_; }
  const std::map<std::string, double>& numbers_of(const std::string& pose) const { return of_pose_.at(pose); }
  /// The causes of the catalogue that these numbers look like, being beyond three sigma of them, and those that are in
  /// every case: neither right nor wrong to name.
  std::vector<std::string> look_like() const;
  /// Standard deviation and correlation length in mm of every field.
  struct FieldSize {
    double sd, length_mm;
  };
  std::map<std::string, FieldSize> field_sizes() const;

 private:
  std::uint64_t seed_;
  Kind kind_;
  double width_;
  std::map<std::string, double> numbers_;
  std::map<std::string, std::map<std::string, double>> of_pose_;
};

/// The sigma of the nuisances that share a coordinate with a cause, by the cause's parameters.
std::map<std::string, double> nuisance_sigma(const std::string& cause);

}  // namespace supine::phantom

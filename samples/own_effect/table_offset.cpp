// SPDX-License-Identifier: AGPL-3.0-or-later
// A measurement effect that Supine does not have: the scanner stood on the floor, the patient on a table that was
// raised after calibration. Every scan lies off along the patient's front-back axis, by another amount each.
#include "simulation/catalogue.h"
#include "simulation/fields.h"

namespace {

using namespace supine::simulation;

class TableOffset : public Effect {
 public:
  std::string name() const override { return "table_offset"; }
  std::string meaning() const override { return "table that stood higher or lower than the scanner was told"; }

  /// A cause of the measurement: named before tissue where both do equally well, and no shape depends on it.
  EffectTraits traits() const override {
    return {.kind = EffectKind::measurement,
            .acts_in = ActsIn::all_but_imaged,
            .moves_scan = true,
            .error_source = "table",
            .error_of_each_scan = true};
  }
  /// The table's scale is read to half a millimetre.
  double tolerance(const std::string&, const MeasurementTolerances&) const override { return 0.5; }

  const std::vector<Parameter>& parameters() const override {
    static const std::vector<Parameter> rows = {{.name = "height_mm",
                                                 .unit = "mm",
                                                 .null = 0,
                                                 .lower = -30,
                                                 .upper = 30,
                                                 .median = 0,
                                                 .spread = 8,
                                                 .meaning = "how far each scan lies too far back"}};
    return rows;
  }

  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>&,
             Fields<Dual>& fields) const override {
    if (!scene.is_imaged()) fields.scan_motion[1] += values[0];  // LPS: y runs to the patient's back
  }
};

const TableOffset table_offset;
const bool known = add_to_catalogue(table_offset);

}  // namespace

// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "segmentation/tissue.h"
#include "simulation/effect.h"

namespace supine::simulation {

/// A tissue that is stiffer (or softer) than the rest: ln E += log_ratio × fraction of that tissue in the cell.
class TissueStiffness : public Effect {
 public:
  explicit TissueStiffness(segmentation::Tissue tissue, Parameter row) : tissue_(tissue), rows_{std::move(row)} {}
  std::string name() const override {
    return std::string(segmentation::tissue_names[static_cast<int>(tissue_)]) + "_stiffness";
  }
  std::string meaning() const override;
  EffectTraits traits() const override { return {.error_source = is_gland() ? "gland" : ""}; }
  double tolerance(const std::string&, const MeasurementTolerances& known) const override {
    return is_gland() ? known.gland_log : 0;
  }
  /// An object whose labels know no such tissue has none.
  bool belongs_to(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model& model) const override;
  const std::vector<Parameter>& parameters() const override { return rows_; }
  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>& options,
             Fields<Dual>& fields) const override;

 private:
  bool is_gland() const { return tissue_ == segmentation::Tissue::gland; }

  segmentation::Tissue tissue_;
  std::vector<Parameter> rows_;
};

}  // namespace supine::simulation

// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/effect.h"

namespace supine::simulation {

/// Two breasts of unlike stiffness: ln E += log_ratio / 2 in the left one, -log_ratio / 2 in the right one, so that
/// log_ratio = ln(E_left / E_right) and the base model's modulus is their geometric mean. Changes nothing where the
/// mesh holds one breast only.
class LeftRightStiffness : public Effect {
 public:
  std::string name() const override { return "left_right_stiffness"; }
  std::string meaning() const override { return "left breast stiffer than the right one (case.side = \"both\")"; }
  EffectTraits traits() const override { return {.breast_only = true}; }
  const std::vector<Parameter>& parameters() const override;
  bool belongs_to(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model& model) const override;
  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>& options,
             Fields<Dual>& fields) const override;
};

}  // namespace supine::simulation

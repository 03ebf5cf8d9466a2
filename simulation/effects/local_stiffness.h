// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/effect.h"

namespace supine::simulation {

/// Tissue or skin that is stiffer or softer about some place: ln E += log_ratio × exp(-½ d²/length²), d the distance in
/// anatomy coordinates from (centre_lateral, centre_head, height), all in foot radii. Option of: which of both.
/// A stand-in for what has no effect of its own (a shell about the gland, a scar), so no candidate of the diagnosis by
/// itself: it may lie anywhere. One breast.
class LocalStiffness : public Effect {
 public:
  std::string name() const override { return "local_stiffness"; }
  std::string meaning() const override { return "tissue or skin stiffer or softer about some place"; }
  EffectTraits traits() const override { return {.breast_only = true}; }
  const std::vector<Parameter>& parameters() const override;
  const std::vector<OptionRow>& options() const override;
  bool belongs_to(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model& model) const override;
  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>& options,
             Fields<Dual>& fields) const override;
};

/// Anatomy coordinates of the middle of some nodes of the mesh: lateral, head, height over the muscle, in foot radii.
Eigen::Vector3d anatomy_place(const Scene& scene, const Eigen::Ref<const Eigen::RowVectorXi>& nodes);

}  // namespace supine::simulation

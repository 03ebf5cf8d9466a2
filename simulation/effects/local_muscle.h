// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "simulation/effect.h"

namespace supine::simulation {

/// The rigid muscle lies elsewhere than in the image about some place: it has come out along its normal by
/// offset_mm × exp(-½ d²/length²), d the distance in anatomy coordinates from (centre_lateral, centre_head), all in
/// foot radii. Every pose but the imaged one. A stand-in for what has no effect of its own (a support that sags, a
/// border drawn wrongly), so no candidate of the diagnosis by itself: it may lie anywhere, which the hill of
/// chest_wall_motion may not. One breast.
class LocalMuscle : public Effect {
 public:
  std::string name() const override { return "local_muscle"; }
  std::string meaning() const override { return "muscle that lies elsewhere about some place"; }
  EffectTraits traits() const override {
    return {.kind = EffectKind::boundary, .acts_in = ActsIn::all_but_imaged, .breast_only = true};
  }
  const std::vector<Parameter>& parameters() const override;
  bool belongs_to(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model& model) const override;
  /// Whether such a hill is one of those that chest_wall_motion lists: its middle stands, and it is as wide at half of
  /// its height, as that can. Both in foot radii.
  static bool is_listed(const Eigen::Vector2d& centre, double length);
  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>& options,
             Fields<Dual>& fields) const override;
};

}  // namespace supine::simulation

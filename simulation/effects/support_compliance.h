// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/effect.h"

namespace supine::simulation {

/// A support that gives way: its springs are put in line with softer ones, spread evenly over it, that turn by
/// turn_deg_per_nm under a moment about an axis in its plane: 1/k_n += c ∫y² dA, and 1/k_t += across × that, so that
/// it shifts by across × c ∫y² dA / A under a force across its normal (SupportTerm). Turns and shifts are means over
/// the support, which may warp; a shift along the normal and a twist about it go with them as the springs do.
/// Option support: its name; all = every one that is fixed or elastic, each by its own force and moment. What slides (a
/// breast's muscle does) has a stiffness of its own in the model and is left alone.
class SupportCompliance : public Effect {
 public:
  std::string name() const override { return "support_compliance"; }
  std::string meaning() const override { return "a support that gives way: turns and shifts under what it carries"; }
  EffectTraits traits() const override { return {.kind = EffectKind::boundary}; }
  const std::vector<Parameter>& parameters() const override;
  const std::vector<OptionRow>& options() const override;
  bool belongs_to(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model& model) const override;
  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>& options,
             Fields<Dual>& fields) const override;
};

}  // namespace supine::simulation

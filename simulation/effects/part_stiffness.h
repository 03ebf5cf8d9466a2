// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "simulation/effect.h"

namespace supine::simulation {

/// A named part ([image.parts]) that is stiffer or softer than the rest: ln E += log_ratio × share of the part in the
/// cell. Option part: its name, first = the first of the case.
class PartStiffness : public Effect {
 public:
  std::string name() const override { return "part_stiffness"; }
  std::string meaning() const override { return "a named part of the body stiffer or softer than the rest"; }
  const std::vector<Parameter>& parameters() const override;
  const std::vector<OptionRow>& options() const override;
  bool belongs_to(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model& model) const override;
  void apply(const Scene& scene, std::span<const Dual> values, const std::map<std::string, std::string>& options,
             Fields<Dual>& fields) const override;
};

}  // namespace supine::simulation

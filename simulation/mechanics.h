// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "meshing/anatomy.h"
#include "meshing/tet_mesh.h"
#include "simulation/model.h"
#include "simulation/terms/chest_contact.h"
#include "simulation/terms/skin_contact.h"
#include "simulation/terms/volume_strain.h"

namespace supine::simulation {

/// The terms of one model on one mesh, summed: r(x, X) and its derivatives.
/// Nodes that the model holds (interface.kind = fixed on the muscle, cut.kind = held) keep x = X = imaged place. Named
/// supports that are fixed are held by springs of fixed_support_kpa_per_mm (model_fields.h), so that they can give way.
class Mechanics {
 public:
  /// @param mesh, anatomy  of the imaged shape; must outlive the object
  /// @throws InputError  a law that does not go with the mesh, no interface, no skin; contact with the chest of an
  /// object or where the skin is closed
  /// @param same_mesh  another of the same mesh, whose tables of the cells are shared; or nullptr
  Mechanics(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model& model,
            const Mechanics* same_mesh = nullptr);

  const Layout& layout() const { return layout_; }
  const Pattern& pattern() const { return *pattern_; }
  const meshing::TetMesh& mesh() const { return mesh_; }
  const meshing::Anatomy& anatomy() const { return anatomy_; }
  bool has_energy() const;

  /// Takes over material and loads of one pose.
  void set_fields(const Fields<double>& fields);

  /// Fills @p sums with what is demanded; rows and columns of held nodes become those of the identity.
  void evaluate(const State& state, const Demand& demand, Sums& sums) const;

  /// The tissue's resistance to a change of each cell's whole volume.
  const VolumeStrainTerm& volume() const { return *volume_; }

  /// Skin on skin; nullptr where the model leaves it off.
  const SkinContactTerm* contact() const { return contact_; }
  /// Skin on the chest beside the breast; nullptr where the model leaves it off.
  const ChestContact* chest_contact() const { return chest_contact_; }

  /// ∂r/∂p at frozen x and X, mN per unit of p; zero at held nodes.
  void parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const;

 private:
  void add_contact(const ContactSettings& settings);
  void hold(const Demand& demand, Sums& sums) const;

  const meshing::TetMesh& mesh_;
  const meshing::Anatomy& anatomy_;
  Layout layout_;
  std::shared_ptr<const Pattern> pattern_;
  std::shared_ptr<const Elements> cells_;
  bool bends_ = false;  // the pattern couples across the edges of the skin
  std::vector<std::unique_ptr<Term>> terms_;
  const VolumeStrainTerm* volume_ = nullptr;     // one of the terms
  const SkinContactTerm* contact_ = nullptr;     // one of the terms, if any
  const ChestContact* chest_contact_ = nullptr;  // the same
  std::vector<char> held_;                       // per node
  bool any_held_ = false;
};

/// Smallest det F (F = ∂x/∂X) over the quadrature points of each cell, and the corners of quadratic ones; <= 0 where X
/// or x is inverted.
Eigen::VectorXd cell_det_f(const Indices& cells, const Points& x, const Points& X);

/// The same over the quadrature points alone: what the energy sees.
Eigen::VectorXd cell_det_f_at_points(const Indices& cells, const Points& x, const Points& X);

/// Volume of a mesh in the shape @p x (#N by 3, mm) by the cells' quadrature, mm³.
double volume_mm3(const Indices& cells, const Points& x);

}  // namespace supine::simulation

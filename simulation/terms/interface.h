// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "meshing/anatomy/muscle_distance.h"
#include "simulation/elements/elements.h"
#include "simulation/laws/contact_law.h"
#include "simulation/terms/term.h"

namespace supine::simulation {

/// The breast on the rigid muscle: springs on the inner surface, force-free in the undeformed shape.
/// Energy per undeformed area ½ k_n g² + ½ k_t |s|² with gap g = φ(x) - φ(X) - load × offset, φ the smooth distance to
/// the muscle, and slip s = T (x - X), T = I - n nᵀ with n = ∇φ/|∇φ| at X; traction -k_n g ∇φ(x) - k_t s.
///
/// offset is how far the muscle has come out along its normal (Fields::muscle_offset); it rides with the material point
/// and grows with the load, so that without load X is free of force whatever the pose.
///
/// Friction (Fields::interface_friction, Coulomb's μ) adds the traction -μ p s/√(|s|² + s0²) with the pressure p that
/// the normal spring pushes with (contact_law.h); none under tension. Slip counts from the undeformed shape, as if
/// every pose were reached on a straight way from there. It has no energy and an unsymmetric tangent.
template <class Face>
class InterfaceTerm : public Term {
 public:
  /// @param first_point  row of the interface's fields that belongs to the first point of the first face
  InterfaceTerm(const Indices& faces, const Pattern& pattern, std::shared_ptr<const meshing::MuscleDistance> muscle,
                Eigen::Index first_point = 0);

  void set_fields(const Fields<double>& fields) override;
  void add(const State& state, const Demand& demand, Sums& sums) const override;
  void add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const override;
  bool has_energy() const override { return !rubs_; }

 private:
  using Sample = meshing::MuscleDistance::Sample;
  struct Cached {
    Eigen::Vector3d at = Eigen::Vector3d::Constant(1e300);
    Sample sample;
  };
  /// One quadrature point of a face.
  struct Point {
    const Sample& now;
    const Sample& before;
    ContactPlace place;
    Eigen::Vector3d normal;
    double along;  // normal part of x - X
  };
  const Sample& look_up(std::vector<Cached>& cache, int point, const Eigen::Vector3d& at) const;
  Point point_at(int index, const Eigen::Vector3d& x, const Eigen::Vector3d& X) const;
  void add_face(int e, const State& state, const Demand& demand, Local<Face::nodes>& local) const;

  Elements elements_;
  std::shared_ptr<const meshing::MuscleDistance> muscle_;
  Eigen::Index first_point_;
  std::vector<ContactMaterial<double>> material_;  // per point; offset at full load
  bool rubs_ = false;                              // friction somewhere
  // φ is asked for at the same X (or x) in every iteration of a solve that only moves the other one; each point
  // belongs to one element, hence to one thread.
  mutable std::vector<Cached> at_x_, at_X_;
};

extern template class InterfaceTerm<Tri3>;
extern template class InterfaceTerm<Tri6>;

}  // namespace supine::simulation

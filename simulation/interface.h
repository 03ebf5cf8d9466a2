// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "meshing/muscle_distance.h"
#include "simulation/elements.h"
#include "simulation/term.h"

namespace supine::simulation {

/// The breast on the rigid muscle: springs on the inner surface, force-free in the undeformed shape.
/// Energy per undeformed area ½ k_n (φ(x) - φ(X))² + ½ k_t |T (x - X)|², φ the smooth distance to the muscle,
/// T = I - n nᵀ with n = ∇φ/|∇φ| at X; traction -k_n (φ(x) - φ(X)) ∇φ(x) - k_t T (x - X).
template <class Face>
class InterfaceTerm : public Term {
 public:
  InterfaceTerm(const Indices& faces, const Pattern& pattern, std::shared_ptr<const meshing::MuscleDistance> muscle);

  void set_fields(const Fields<double>& fields) override;
  void add(const State& state, const Demand& demand, Sums& sums) const override;
  void add_parameter_derivative(const State& state, const Fields<Dual>& fields, Sums& sums) const override;

 private:
  using Sample = meshing::MuscleDistance::Sample;
  struct Cached {
    Eigen::Vector3d at = Eigen::Vector3d::Constant(1e300);
    Sample sample;
  };
  const Sample& look_up(std::vector<Cached>& cache, int point, const Eigen::Vector3d& at) const;
  void add_face(int e, const State& state, const Demand& demand, Local<Face::nodes>& local) const;

  Elements elements_;
  std::shared_ptr<const meshing::MuscleDistance> muscle_;
  Eigen::VectorXd normal_, tangential_;  // per point, kPa/mm
  // φ is asked for at the same X (or x) in every iteration of a solve that only moves the other one; each point
  // belongs to one element, hence to one thread.
  mutable std::vector<Cached> at_x_, at_X_;
};

extern template class InterfaceTerm<Tri3>;
extern template class InterfaceTerm<Tri6>;

}  // namespace supine::simulation

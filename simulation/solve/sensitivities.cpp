// SPDX-License-Identifier: AGPL-3.0-or-later
#include "simulation/solve/sensitivities.h"

#include <fmt/format.h>

#include <optional>

#include "common/error.h"
#include "simulation/parameters.h"
#include "simulation/solve/linear_solver.h"

namespace supine::simulation {
namespace {

using Flat = Eigen::VectorXd;

Flat flat(const Points& points) { return Eigen::Map<const Flat>(points.data(), points.size()); }

Points shaped(const Flat& values) { return Eigen::Map<const Points>(values.data(), values.size() / 3, 3); }

template <class Solver>
using Spare = std::vector<std::unique_ptr<Solver>>;

/// A solver taken from @p spare, or a new one; given back when it goes.
template <class Solver>
class Borrowed {
 public:
  Borrowed(Spare<Solver>& spare, const SparseMatrix& pattern) : spare_(spare) {
    if (spare.empty()) {
      solver_ = std::make_unique<Solver>(pattern);
    } else {
      solver_ = std::move(spare.back());
      spare.pop_back();
    }
  }
  ~Borrowed() { spare_.push_back(std::move(solver_)); }
  Borrowed(const Borrowed&) = delete;
  Borrowed& operator=(const Borrowed&) = delete;
  Solver* operator->() const { return solver_.get(); }

 private:
  Spare<Solver>& spare_;
  std::unique_ptr<Solver> solver_;
};

/// K of one pose, factorised: Cholesky where there is an energy, LU where there is none.
class TangentSolver {
 public:
  /// @param spare_cholesky, spare_lu  analysed for the pattern of sums.tangent
  TangentSolver(Spare<CholeskySolver>& spare_cholesky, Spare<LuSolver>& spare_lu, bool has_energy, const Sums& sums,
                const std::string& pose) {
    const SparseMatrix tangent = sums.whole_tangent();
    const bool coupled = tangent.nonZeros() > sums.tangent.nonZeros();  // what touches is another pair in every pose
    bool done = false;
    if (has_energy) done = cholesky_.emplace(coupled ? own_cholesky_ : spare_cholesky, tangent)->factorise(tangent);
    if (!done) {
      cholesky_.reset();
      done = lu_.emplace(coupled ? own_lu_ : spare_lu, tangent)->factorise(tangent);
    }
    if (!done) throw NumericalFailure("the tangent at the solution of '" + pose + "' is singular: no sensitivities");
  }
  Eigen::MatrixXd solve(const Eigen::MatrixXd& b) const {
    return cholesky_ ? (*cholesky_)->solve(b) : (*lu_)->solve(b);
  }
  Flat solve_transposed(const Flat& b) const {
    return cholesky_ ? Flat((*cholesky_)->solve(Eigen::MatrixXd(b))) : (*lu_)->solve_transposed(b);
  }

 private:
  Spare<CholeskySolver> own_cholesky_;
  Spare<LuSolver> own_lu_;
  std::optional<Borrowed<CholeskySolver>> cholesky_;
  std::optional<Borrowed<LuSolver>> lu_;
};

}  // namespace

struct Sensitivities::State {
  Chain& chain;
  Model model;
  ChainSolution solution;
  Sums sums;
  SparseMatrix prone_tangent;                            // ∂r/∂x of prone: what moving the known shape does
  std::optional<Borrowed<LuSolver>> inverse;             // none where the body was imaged free of load
  std::vector<std::unique_ptr<TangentSolver>> tangents;  // per pose but prone
  std::vector<SparseMatrix> reference_tangents;          // ∂r/∂X, per pose but prone

  State(Chain& c, const Model& m, const ChainSolution& s)
      : chain(c),
        model(m),
        solution(s),
        sums(c.mechanics().pattern()),
        tangents(c.poses().size() - 1),
        reference_tangents(c.poses().size() - 1) {}

  simulation::State at(std::size_t pose) const {  // 0 is prone
    return {pose == 0 ? solution.prone : solution.poses[pose - 1].x, solution.X, 1.0};
  }

  /// Tangents of a pose, factorised.
  void linearise(std::size_t pose) {
    if (pose == 0 && chain.imaged_free_of_load()) return;
    Chain::Workplace& place = chain.workplace(pose, model);
    chain.load(place, model, chain.poses()[pose]);
    Sums there(place.mechanics.pattern());
    place.mechanics.evaluate(at(pose), Demand{.residual = true, .tangent = true, .reference_tangent = true}, there);
    if (pose > 0) {
      tangents[pose - 1] = std::make_unique<TangentSolver>(
          place.spare_cholesky, place.spare_lu, place.mechanics.has_energy(), there, chain.poses()[pose].name);
      reference_tangents[pose - 1] = std::move(there.reference_tangent);
      return;
    }
    prone_tangent = there.whole_tangent();
    if (!inverse.emplace(place.spare_lu, there.reference_tangent)->factorise(there.reference_tangent))
      throw NumericalFailure("the tangent of the undeformed shape is singular: no sensitivities");
  }

  /// ∂r/∂p of a pose with x and X held, and what moving the known shape does to its mass.
  Flat force_derivative(std::size_t pose, const std::string& parameter, Points* prone_derivative) {
    return force_derivative(pose, chain.fields(model, chain.poses()[pose], parameter), prone_derivative);
  }

  Flat force_derivative(std::size_t pose, const FieldDirection& direction, Points* prone_derivative) {
    Fields<Dual> fields = chain.fields(model, chain.poses()[pose]);
    direction(chain.poses()[pose], fields);
    return force_derivative(pose, fields, prone_derivative);
  }

  Flat force_derivative(std::size_t pose, const Fields<Dual>& fields, Points* prone_derivative) {
    Mechanics& mechanics = chain.workplace(pose, model).mechanics;
    mechanics.set_fields(values_of(fields));
    const Points imaged = shaped(derivatives_of(fields).imaged_offset);
    mechanics.parameter_derivative(at(pose), fields, sums);
    if (prone_derivative != nullptr) *prone_derivative = imaged;
    return sums.residual;
  }

  /// @param whats  parameters or directions of the fields
  template <class What>
  std::vector<ChainDerivative> derivatives(const std::vector<What>& whats) {
    const auto count = static_cast<Eigen::Index>(whats.size());
    std::vector<ChainDerivative> results(whats.size());
    Eigen::MatrixXd undeformed(solution.X.size(), count);  // of a body imaged free of load that of prone
    for (Eigen::Index k = 0; k < count; ++k) {
      ChainDerivative& result = results[static_cast<std::size_t>(k)];
      undeformed.col(k) = force_derivative(0, whats[static_cast<std::size_t>(k)], &result.prone);
      const Flat prone = flat(result.prone);
      if (!inverse)
        undeformed.col(k) = prone;
      else if (!prone.isZero(0))
        undeformed.col(k) += prone_tangent * prone;
    }
    if (inverse) undeformed = -(*inverse)->solve(undeformed);
    for (Eigen::Index k = 0; k < count; ++k) results[static_cast<std::size_t>(k)].X = shaped(undeformed.col(k));
    Eigen::MatrixXd pull(solution.X.size(), count);
    for (std::size_t p = 1; p < chain.poses().size(); ++p) {
      for (Eigen::Index k = 0; k < count; ++k)
        pull.col(k) = force_derivative(p, whats[static_cast<std::size_t>(k)], nullptr) +
                      reference_tangents[p - 1] * undeformed.col(k);
      const Eigen::MatrixXd moved = tangents[p - 1]->solve(pull);
      for (Eigen::Index k = 0; k < count; ++k)
        results[static_cast<std::size_t>(k)].poses.push_back(shaped(-moved.col(k)));
    }
    return results;
  }
};

Sensitivities::Sensitivities(Chain& chain, const Model& model, const ChainSolution& solution)
    : state_(std::make_unique<State>(chain, model, solution)) {
  chain.each_pose(0, [this](std::size_t pose) { state_->linearise(pose); });
}

Sensitivities::~Sensitivities() = default;

ChainDerivative Sensitivities::of(const std::string& parameter) const {
  return std::move(of(std::vector{parameter}).front());
}

std::vector<ChainDerivative> Sensitivities::of(const std::vector<std::string>& parameters) const {
  return state_->derivatives(parameters);
}

ChainDerivative Sensitivities::along(const FieldDirection& direction) const {
  return std::move(along(std::vector{direction}).front());
}

std::vector<ChainDerivative> Sensitivities::along(const std::vector<FieldDirection>& directions) const {
  return state_->derivatives(directions);
}

std::vector<Points> Sensitivities::moved_by(std::size_t pose, const std::vector<Eigen::VectorXd>& forces) const {
  Eigen::MatrixXd all(state_->solution.X.size(), static_cast<Eigen::Index>(forces.size()));
  for (std::size_t f = 0; f < forces.size(); ++f) all.col(static_cast<Eigen::Index>(f)) = forces[f];
  const Eigen::MatrixXd moved = state_->tangents.at(pose)->solve(all);
  std::vector<Points> moves;
  for (Eigen::Index f = 0; f < moved.cols(); ++f) moves.push_back(shaped(moved.col(f)));
  return moves;
}

Points Sensitivities::moved_by(std::size_t pose, const Eigen::VectorXd& force) const {
  return std::move(moved_by(pose, std::vector{force}).front());
}

Eigen::VectorXd Sensitivities::gradient(const std::vector<Points>& by_pose,
                                        const std::vector<std::string>& parameters) const {
  State& s = *state_;
  // dJ/dp = -Σ λ_sᵀ ∂r_s/∂p - λ_pᵀ (∂r_p/∂p + K_p dx_p/dp), K_sᵀ λ_s = ∂J/∂x_s, L_pᵀ λ_p = -Σ L_sᵀ λ_s.
  std::vector<Flat> adjoint(s.chain.poses().size());
  Flat pull = Flat::Zero(s.solution.X.size());
  for (std::size_t p = 1; p < adjoint.size(); ++p) {
    adjoint[p] = s.tangents[p - 1]->solve_transposed(flat(by_pose.at(p - 1)));
    pull -= s.reference_tangents[p - 1].transpose() * adjoint[p];
  }
  if (s.inverse) adjoint[0] = (*s.inverse)->solve_transposed(pull);
  Eigen::VectorXd gradient(parameters.size());
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    Points prone;
    Flat force = s.force_derivative(0, parameters[i], &prone);
    double slope = pull.dot(flat(prone));  // of a body imaged free of load
    if (s.inverse) {
      if (!prone.isZero(0)) force += s.prone_tangent * flat(prone);
      slope = -adjoint[0].dot(force);
    }
    for (std::size_t p = 1; p < adjoint.size(); ++p)
      slope -= adjoint[p].dot(s.force_derivative(p, parameters[i], nullptr));
    gradient[static_cast<Eigen::Index>(i)] = slope;
  }
  return gradient;
}

}  // namespace supine::simulation

// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "simulation/solve/equilibrium.h"
#include "simulation/solve/linear_solver.h"

namespace supine::simulation {

/// How the undeformed shape is found. newton is the true inverse; the others are kept to be compared with:
/// fixed_point corrects X by the forward error until it is small (Sellier 2011), reversed_gravity loads the imaged
/// shape, taken as stress-free, with gravity turned round.
enum class InverseMethod { newton, fixed_point, reversed_gravity };

/// A body position to predict.
struct PoseLoad {
  std::string name;         ///< supine, …: what effects that act in some poses go by
  Eigen::Vector3d gravity;  ///< unit, LPS
};

struct PoseSolution {
  std::string name;
  Points x;  ///< #N by 3, mm
  SolveReport report;
  /// Largest distance to another balanced shape, that the solver reaches from the imaged one; 0 where there is none.
  /// Looked for by Chain::certify() and only where forces have no energy (corotational_qr, friction): with one, the
  /// solver goes downhill.
  double second_shape_mm = 0;
  std::optional<ContactFigures> contact{};        ///< what touches, where the model has [contact]; by Chain::certify()
  std::optional<ContactFigures> chest_contact{};  ///< the same of the chest beside the breast
};

struct ChainSolution {
  Points prone;  ///< the known shape, of the imaged pose: imaged nodes, moved by what the model says of the
                 ///< segmentation; #N by 3, mm
  Points X;      ///< undeformed shape, #N by 3, mm
  SolveReport inverse;
  std::vector<PoseSolution> poses;  ///< all but the imaged one, in the order given
  PoseSolution round_trip;          ///< the imaged pose again, from X and no load; filled by Chain::certify()
  double round_trip_max_mm = 0;     ///< its largest distance to the known shape
  double round_trip_rms_mm = 0;
  int dearest_solve = 0;              ///< EquilibriumSolver::work() of the dearest solve of Chain::solve()
  std::vector<std::string> warnings;  ///< what a user must know of the answer
};

/// Name of the imaged pose of a body that was imaged free of load (CAD, cast, buoyancy): its shape is the undeformed
/// one as it stands, there is no inverse and no round trip.
inline constexpr const char* free_of_load = "undeformed";

/// imaged (prone) → undeformed → every other pose, for one mesh and one kind of model (laws, boundary kinds), as often
/// as wanted with other numbers and effects. Symbolic work and memory are kept between solves.
class Chain {
 public:
  /// @param mesh, anatomy  of the imaged shape; must outlive the object
  /// @param poses  the first one is the imaged pose; at least that. Gravity may be zero in it
  /// @throws InputError  the first pose is not anatomy.imaged_pose; prone gravity of a breast that points into the
  /// muscle (bound: the angle to the muscle's outward normal is
  ///   under 90°); what Mechanics refuses
  Chain(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model& model, std::vector<PoseLoad> poses,
        SolveOptions options = {});

  /// Whether the body was imaged free of load.
  bool imaged_free_of_load() const { return poses_[0].name == free_of_load; }
  const Mechanics& mechanics() const { return workplaces_[0]->mechanics; }
  const std::vector<PoseLoad>& poses() const { return poses_; }

  /// @param model  of the kind given to the constructor: numbers and effects may differ
  /// @param near   solution for similar numbers to start from, or nullptr to start from the imaged shape and no load;
  ///   when that fails it starts without
  /// @return without round trip and second shapes, see certify()
  /// @throws NoEquilibrium  naming the pose, how far its load came and the modulus that might carry it
  /// @throws NumericalFailure  naming the pose and the cell that is inverted there
  /// @throws InputError  what make_fields refuses
  ChainSolution solve(const Model& model, const ChainSolution* near = nullptr,
                      InverseMethod method = InverseMethod::newton);

  /// EquilibriumSolver::limit_work() of each solve of a chain: a trial of which one costs much more than any of others
  /// is not worth waiting for. nullopt = no bound.
  void limit_each_solve(std::optional<int> most) { most_of_each_ = most; }

  /// Makes the round trip: loads solution.X with the imaged pose's gravity, from no load. Where forces have no energy
  /// it also looks for a second balanced shape of every pose. Notes what touches, and warns of skin that passes through
  /// skin and of pairs of faces that contact leaves out.
  /// @param solution  of @p model by this chain
  /// @throws NumericalFailure  no equilibrium on the way back to the imaged pose
  void certify(const Model& model, ChainSolution& solution);

  /// Fields of one pose with the derivative with respect to @p varied (make_fields).
  Fields<Dual> fields(const Model& model, const PoseLoad& pose, const std::string& varied = {}) const;

 private:
  friend class Sensitivities;

  /// What a pose is solved with. The solvers of Sensitivities that are gone stay: analysed once, ready for the next.
  struct Workplace {
    Workplace(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model& model,
              const Mechanics* same_mesh, const SolveOptions& options)
        : mechanics(mesh, anatomy, model, same_mesh), solver(mechanics, options) {}
    Mechanics mechanics;
    EquilibriumSolver solver;
    std::vector<std::unique_ptr<CholeskySolver>> spare_cholesky;
    std::vector<std::unique_ptr<LuSolver>> spare_lu;
  };

  Workplace& workplace(std::size_t pose, const Model& model);
  void each_pose(std::size_t first, const std::function<void(std::size_t pose)>& work) const;
  ChainSolution solve_all(const Model& model, const ChainSolution* near, InverseMethod method);
  PoseSolution solve_pose(const Model& model, std::size_t pose, const ChainSolution* near,
                          const ChainSolution& solution, int& work);
  void load(Workplace& place, const Model& model, const PoseLoad& pose) const;
  int within_limit(EquilibriumSolver& solver, const std::function<void()>& solve) const;
  void solve_undeformed(const Model& model, InverseMethod method, const ChainSolution* near, ChainSolution& solution);
  void correct_by_fixed_point(const Model& model, ChainSolution& solution);
  void look_for_contact(const Model& model, ChainSolution& solution);
  void look_into_chest(const Model& model, const Indices& skin, ChainSolution& solution) const;
  void look_for_second_shapes(const Model& model, ChainSolution& solution);

  std::vector<PoseLoad> poses_;
  SolveOptions options_;
  // One of each pose, made when it is first needed, so that poses are solved side by side; or one for all.
  std::vector<std::unique_ptr<Workplace>> workplaces_;
  std::optional<int> most_of_each_;
};

/// A chain used once, with its round trip and with effects that can change nothing refused. Parameters and errors as of
/// Chain::Chain(), solve() and certify().
ChainSolution solve_chain(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model& model,
                          const std::vector<PoseLoad>& poses, InverseMethod method = InverseMethod::newton,
                          const SolveOptions& options = {});

/// ρ g H / E: how far the tissue's weight outdoes its stiffness; above about 2 shapes hardly carry themselves.
double load_number(const meshing::Anatomy& anatomy, const Model& model);

}  // namespace supine::simulation

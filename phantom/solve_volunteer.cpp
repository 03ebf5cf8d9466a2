// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/solve_volunteer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "phantom/solve_poses.h"
#include "phantom/volunteers.h"

namespace supine::phantom {
namespace {

constexpr int stiffer_tries = 4;
constexpr double stiffer = 1.5;
constexpr double close_enough = 0.03;  // of the way the nipple is to move
constexpr int most_solves = 12;
constexpr double longest_step = 1.25, shortest_step = 1.05;         // factors of the moduli: softer shapes are followed
constexpr double usual_slope = -1, steepest = -4, flattest = -0.3;  // of ln way over ln factor

class Search {
 public:
  Search(const BodyMesh& body_mesh, const PhantomOptions& options, Phantom& phantom)
      : body_mesh_(body_mesh), options_(options), phantom_(phantom), drawn_(phantom.body) {}

  void run() {
    carry();
    for (int solves = 0; solves < most_solves && std::abs(moved_ / drawn_.nipple_moves_mm - 1) > close_enough; ++solves)
      if (!step()) break;
  }

 private:
  /// From no load, stiffer until it is carried.
  void carry() {
    for (int tried = 0;; ++tried, factor_ *= stiffer) try {
        carried_ = factor_;
        return solve(factor_, Truth::Start::no_load);
      } catch (const NumericalFailure& failure) {
        phantom_.gave_way.push_back(failure.what());
        followed_below_ = factor_;
        if (tried == stiffer_tries) throw;
      }
  }

  /// Towards the way that was drawn. @return  false: the moduli end there
  bool step() {
    const double wanted = factor_ * std::pow(drawn_.nipple_moves_mm / moved_, 1 / slope_);
    const double next = std::clamp(within_range(wanted), factor_ / longest_, factor_ * stiffer);
    if (std::abs(next / factor_ - 1) < 1e-3) {
      phantom_.gave_way.push_back(
          fmt::format("the nipple moves {:.0f} mm at the end of the moduli's range, {:.0f} were drawn", moved_,
                      drawn_.nipple_moves_mm));
      return false;
    }
    const double before = factor_, moved = moved_;
    try {
      solve_near(next);
    } catch (const NumericalFailure& failure) {
      phantom_.gave_way.push_back(failure.what());
      longest_ = std::sqrt(longest_);
      return longest_ > shortest_step && next < before;
    }
    slope_ = std::clamp(std::log(moved_ / moved) / std::log(factor_ / before), steepest, flattest);
    return true;
  }

  /// From no load, as a simulation of the case finds it: shapes that are followed may lead to another equilibrium.
  /// Where that fails, and with what is softer still, they are followed.
  void solve_near(double factor) {
    if (factor > followed_below_) try {
        return solve(factor, Truth::Start::no_load);
      } catch (const NumericalFailure&) {
        followed_below_ = factor;
      }
    solve(factor, Truth::Start::shapes);
  }

  /// A factor beyond which both moduli stay at the ends of their ranges is none.
  double within_range(double factor) const {
    const double least = std::min(softest_breast_kpa / drawn_.breast_kpa, softest_skin_kpa / drawn_.skin_kpa);
    const double most = std::max(stiffest_breast_kpa / drawn_.breast_kpa, stiffest_skin_kpa / drawn_.skin_kpa);
    return std::clamp(factor, least, std::max(most, carried_));
  }

  /// Each in its own range; where the body is carried by stiffer ones alone, up to these.
  Body scaled(double factor) const {
    Body body = drawn_;
    const double most = std::max(carried_, 1.0);
    body.breast_kpa = std::clamp(factor * drawn_.breast_kpa, softest_breast_kpa,
                                 std::max(stiffest_breast_kpa, most * drawn_.breast_kpa));
    body.skin_kpa =
        std::clamp(factor * drawn_.skin_kpa, softest_skin_kpa, std::max(stiffest_skin_kpa, most * drawn_.skin_kpa));
    return body;
  }

  void solve(double factor, Truth::Start start) {
    const Body body = scaled(factor);
    solve_poses(body_mesh_, body, options_, phantom_, start);
    factor_ = factor;
    moved_ = measure_motion(body_mesh_, body, phantom_.poses[0].x, phantom_.poses[1].x, options_.seed).nipple_mm.norm();
  }

  const BodyMesh& body_mesh_;
  const PhantomOptions& options_;
  Phantom& phantom_;
  Body drawn_;
  double factor_ = 1, carried_ = 1, followed_below_ = 0, moved_ = 0, slope_ = usual_slope, longest_ = longest_step;
};

}  // namespace

void solve_volunteer(const BodyMesh& body_mesh, const PhantomOptions& options, Phantom& phantom) {
  Search(body_mesh, options, phantom).run();
}

}  // namespace supine::phantom

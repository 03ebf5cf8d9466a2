// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/chest/cheapest_surface.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace supine::segmentation {
namespace {

constexpr int rounds = 12;
// The four neighbours of a ray; those of lower number come before it in a forward pass.
enum Side { before, below, after, above };
constexpr std::array<Side, 4> opposite{after, above, before, below};

class Messages {
 public:
  explicit Messages(const SurfaceProblem& problem) : p_(problem), belief_(problem.samples) {
    for (auto& messages : from_) messages.assign(p_.costs.size(), 0.0f);
  }

  void pass(bool forward) {
    const int n = p_.rays * p_.rows;
    for (int step = 0; step < n; ++step) {
      const int node = forward ? step : n - 1 - step;
      gather(node);
      for (const Side to : forward ? std::array{after, above} : std::array{before, below}) send(node, to);
    }
  }

  /// One ray after the other, each knowing what those before it took.
  std::vector<int> decide() {
    std::vector<int> chosen(static_cast<std::size_t>(p_.rays) * p_.rows);
    for (int node = 0; node < static_cast<int>(chosen.size()); ++node) {
      const float* cost = at(p_.costs, node);
      for (int i = 0; i < p_.samples; ++i) {
        double sum = cost[i] + at(from_[after], node)[i] + at(from_[above], node)[i];
        for (const Side side : {before, below})
          if (const int other = neighbour(node, side); other >= 0) sum += step_cost(side, i - chosen[other]);
        belief_[i] = static_cast<float>(sum);
      }
      chosen[node] = static_cast<int>(std::min_element(belief_.begin(), belief_.end()) - belief_.begin());
    }
    return chosen;
  }

 private:
  const float* at(const std::vector<float>& values, int node) const {
    return values.data() + static_cast<std::size_t>(node) * p_.samples;
  }
  int neighbour(int node, Side side) const {
    const int ray = node % p_.rays, row = node / p_.rays;
    switch (side) {
      case before:
        return ray > 0 ? node - 1 : -1;
      case after:
        return ray + 1 < p_.rays ? node + 1 : -1;
      case below:
        return row > 0 ? node - p_.rays : -1;
      default:
        return row + 1 < p_.rows ? node + p_.rays : -1;
    }
  }
  static bool along_row(Side side) { return side == before || side == after; }
  double step_cost(Side side, int step) const {
    return along_row(side) ? p_.ray_slope * std::abs(step) : std::min(p_.row_most, p_.row_slope * std::abs(step));
  }

  void gather(int node) {
    const float* cost = at(p_.costs, node);
    for (int i = 0; i < p_.samples; ++i) belief_[i] = cost[i];
    for (const auto& messages : from_)
      for (int i = 0; i < p_.samples; ++i) belief_[i] += at(messages, node)[i];
  }

  /// min over i of half the belief without what came from there, plus the cost of the step.
  void send(int node, Side to) {
    const int other = neighbour(node, to);
    if (other < 0) return;
    const float* back = at(from_[to], node);
    float* message = from_[opposite[to]].data() + static_cast<std::size_t>(other) * p_.samples;
    float least = INFINITY;
    for (int i = 0; i < p_.samples; ++i) {
      message[i] = 0.5f * belief_[i] - back[i];
      least = std::min(least, message[i]);
    }
    const auto slope = static_cast<float>(along_row(to) ? p_.ray_slope : p_.row_slope);
    for (int i = 1; i < p_.samples; ++i) message[i] = std::min(message[i], message[i - 1] + slope);
    for (int i = p_.samples - 2; i >= 0; --i) message[i] = std::min(message[i], message[i + 1] + slope);
    const float most = along_row(to) ? INFINITY : static_cast<float>(p_.row_most);
    for (int i = 0; i < p_.samples; ++i) message[i] = std::min(message[i] - least, most);
  }

  const SurfaceProblem& p_;
  std::array<std::vector<float>, 4> from_;  // per side: what the neighbour there says of each sample
  std::vector<float> belief_;
};

}  // namespace

std::vector<int> cheapest_surface(const SurfaceProblem& problem) {
  Messages messages(problem);
  for (int round = 0; round < rounds; ++round) {
    messages.pass(true);
    messages.pass(false);
  }
  return messages.decide();
}

}  // namespace supine::segmentation

// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/fronts/fast_marching.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "common/error.h"
#include "segmentation/fronts/front_grid.h"
#include "segmentation/fronts/front_queue.h"
#include "segmentation/fronts/upwind.h"

namespace supine::segmentation {
namespace {

constexpr float infinite = std::numeric_limits<float>::infinity();
constexpr float not_solved = -1, given_back = -2;

/// A voxel beside the front, one cache line: all that its arrival time depends on, so that no stencil is gathered.
struct alignas(64) BandVoxel {
  UpwindSides sides;
  float slowness;
  float time;  ///< the last solution, which the entry in the queue must agree with
  std::uint32_t voxel;
};

/// Records of the voxels beside the front; a number given back is used again.
class Band {
 public:
  BandVoxel& operator[](std::uint32_t record) { return records_[record]; }
  const BandVoxel& operator[](std::uint32_t record) const { return records_[record]; }
  std::uint32_t take(std::uint32_t voxel, float slowness) {
    std::uint32_t record = static_cast<std::uint32_t>(records_.size());
    if (free_.empty()) {
      records_.emplace_back();
    } else {
      record = free_.back();
      free_.pop_back();
    }
    BandVoxel& taken = records_[record];
    taken.sides.forget();
    taken.slowness = slowness;
    taken.time = not_solved;
    taken.voxel = voxel;
    return record;
  }
  void give_back(std::uint32_t record) {
    records_[record].time = given_back;
    free_.push_back(record);
  }
  void prefetch(std::uint32_t record) const { fetch_ahead(&records_[record]); }
  bool is_current(FrontQueue::Entry entry) const {
    return std::bit_cast<std::uint32_t>(records_[entry.item()].time) == entry.time_bits();
  }

 private:
  std::vector<BandVoxel, LargePages<BandVoxel>> records_;
  std::vector<std::uint32_t> free_;
};

/// Records that wait for their first solution, in the order of the times at which they may pass at the earliest.
class WaitingRoom {
 public:
  struct Guest {
    float earliest;
    std::uint32_t record;
  };
  void push(float earliest, std::uint32_t record) { guests_.push_back({earliest, record}); }
  bool empty() const { return head_ == guests_.size(); }
  const Guest& first() const { return guests_[head_]; }
  const Guest& later(std::size_t places) const { return guests_[std::min(head_ + places, guests_.size() - 1)]; }
  void pop() {
    if (++head_ < 65536 || 2 * head_ < guests_.size()) return;
    guests_.erase(guests_.begin(), guests_.begin() + static_cast<std::ptrdiff_t>(head_));
    head_ = 0;
  }

 private:
  std::vector<Guest> guests_;
  std::size_t head_ = 0;
};

class FrontRun {
 public:
  FrontRun(const Image<float>& speed, const FastMarchingOptions& options)
      : speed_(speed), grid_(speed.grid), options_(options), front_(grid_.size) {
    const float fastest = *std::max_element(speed.voxels.begin(), speed.voxels.end());
    least_slowness_ = 1 / fastest;
#pragma omp parallel for schedule(static)
    for (int k = 0; k < grid_.size.z(); ++k)
      for (int j = 0; j < grid_.size.y(); ++j)
        for (int i = 0; i < grid_.size.x(); ++i) {
          const float slowness = fastest / speed.at(i, j, k);
          if (std::isfinite(slowness * least_slowness_)) front_[front_.index(i, j, k)] = FrontState::fresh(slowness);
        }
    double squares = 0;
    for (int a = 0; a < 3; ++a) {
      inverse_squared_[a] = static_cast<float>(1 / std::pow(grid_.spacing_mm[a], 2));
      if (grid_.size[a] > 1) squares += inverse_squared_[a];
    }
    // All sides at the time of the earliest and in full use; second order moves a side up to 1.5 times as steeply.
    earliest_after_ =
        static_cast<float>(0.9999 * least_slowness_ / std::sqrt(squares) / (options.order == 2 ? 1.5 : 1));
  }

  void start(const FrontSource& source) {
    const Eigen::Vector3d at = grid_.continuous_index(source.point_mm);
    const Eigen::Vector3i nearest = at.array().round().cast<int>();
    const double slow = 1 / speed_.at(nearest.x(), nearest.y(), nearest.z());
    Eigen::Vector3i low, high;
    for (int a = 0; a < 3; ++a) {
      const double reach = options_.source_radius_mm / grid_.spacing_mm[a];
      low[a] = std::max(0, static_cast<int>(std::floor(at[a] - reach)));
      high[a] = std::min(grid_.size[a] - 1, static_cast<int>(std::ceil(at[a] + reach)));
    }
    for (int k = low.z(); k <= high.z(); ++k)
      for (int j = low.y(); j <= high.y(); ++j)
        for (int i = low.x(); i <= high.x(); ++i) {
          const Eigen::Vector3d voxel(i, j, k);
          const double way = (voxel - at).cwiseProduct(grid_.spacing_mm).norm();
          const bool around = ((voxel - at).array().abs() < 1).all();
          if ((way <= options_.source_radius_mm || around) && speed_.at(i, j, k) > 0)
            give(front_.index(i, j, k), static_cast<float>(source.time + way * slow));
        }
  }

  Image<float> run() {
    for (const std::uint32_t voxel : given_) {
      const std::uint32_t record = band_.take(voxel, 0);
      band_[record].time = front_[voxel].time();
      queue_.push(front_[voxel].time(), record);
    }
    while (next_bucket()) {
      const FrontQueue::Entry entry = queue_.earliest();
      if (!waiting_.empty() && waiting_.first().earliest <= entry.time()) {
        settle_first_waiting();
        continue;
      }
      if (entry.time() > options_.stop_time) break;
      queue_.pop();
      look_ahead();
      if (band_.is_current(entry)) pass(entry);
    }
    return times();
  }

 private:
  void give(std::uint32_t voxel, float time) {
    if (front_[voxel].is_passed() && time >= front_[voxel].time()) return;
    if (!front_[voxel].is_passed()) given_.push_back(voxel);
    front_[voxel] = FrontState::passed(time);
  }

  /// Whether anything is left; then the queue's open bucket holds something, and nobody waits who might come before.
  bool next_bucket() {
    while (queue_.used_up()) {
      const std::uint32_t bucket = queue_.next_bucket();
      if (!waiting_.empty() && FrontQueue::bucket(waiting_.first().earliest) <= bucket) {
        settle_first_waiting();
      } else if (bucket == FrontQueue::none) {
        return false;
      } else {
        queue_.open_next([this](FrontQueue::Entry entry) { return band_.is_current(entry); },
                         [this](FrontQueue::Entry entry) { band_.prefetch(entry.item()); });
      }
    }
    return true;
  }

  void settle_first_waiting() {
    const std::uint32_t record = waiting_.first().record;
    band_.prefetch(waiting_.later(8).record);
    waiting_.pop();
    settle(record);
  }

  /// Solves for the record's time. The last solution counts, not the smallest: it knows most neighbours, and second
  /// differences may raise it.
  void settle(std::uint32_t record) {
    BandVoxel& voxel = band_[record];
    const float time = arrival_time(voxel.sides, voxel.slowness);
    if (time == voxel.time) return;
    voxel.time = time;
    if (time < infinite) queue_.push(time, record);
  }

  void pass(FrontQueue::Entry entry) {
    const float time = entry.time();
    const std::uint32_t voxel = band_[entry.item()].voxel;
    front_[voxel] = FrontState::passed(time);
    band_.give_back(entry.item());
    const FrontGrid::Neighbours neighbours = front_.neighbours(voxel);
    std::array<FrontState, 6> states;
    for (int side = 0; side < 6; ++side) states[side] = front_[neighbours[side]];
    unsigned open = 0;
    for (int side = 0; side < 6; ++side) open |= static_cast<unsigned>(!states[side].is_passed()) << side;
    for (; open != 0; open &= open - 1) {
      const int side = std::countr_zero(open);
      tell(neighbours[side], states[side], side / 2, time, states[side ^ 1]);
    }
  }

  /// A voxel learns that the front passed its neighbour along an axis. @param beyond  state of the neighbour's
  /// neighbour
  void tell(std::uint32_t voxel, FrontState state, int axis, float time, FrontState beyond) {
    std::uint32_t record;
    if (state.is_fresh()) {
      record = band_.take(voxel, state.slowness() * least_slowness_);
      front_[voxel] = FrontState::in_band(record);
      waiting_.push(time + earliest_after_, record);
    } else {
      record = state.record();
      if (band_[record].sides.known(axis)) return;  // the front came from the other side before
    }
    BandVoxel& told = band_[record];
    if (options_.order == 2 && beyond.passed_by(time)) {
      told.sides.set_second_order(axis, time, beyond.time(), inverse_squared_[axis]);
    } else {
      told.sides.set_first_order(axis, time, inverse_squared_[axis]);
    }
    if (told.time != not_solved) settle(record);
  }

  /// Fetches what the next entries will read, in steps: their records, their neighbours, their neighbours' records.
  void look_ahead() const {
    const auto next = queue_.ahead();
    if (next.size() > 24) band_.prefetch(next[24].item());
    if (next.size() > 12 && band_.is_current(next[12]))
      for (const std::uint32_t n : front_.neighbours(band_[next[12].item()].voxel)) fetch_ahead(&front_[n]);
    if (next.size() > 5 && band_.is_current(next[5]))
      for (const std::uint32_t n : front_.neighbours(band_[next[5].item()].voxel))
        if (front_[n].is_in_band()) band_.prefetch(front_[n].record());
  }

  Image<float> times() const {
    Image<float> result{grid_, std::vector<float>(grid_.count())};
#pragma omp parallel for schedule(static)
    for (int k = 0; k < grid_.size.z(); ++k)
      for (int j = 0; j < grid_.size.y(); ++j)
        for (int i = 0; i < grid_.size.x(); ++i) {
          const FrontState state = front_[front_.index(i, j, k)];
          result.at(i, j, k) = state.is_passed() && state.time() <= options_.stop_time ? state.time() : infinite;
        }
    return result;
  }

  const Image<float>& speed_;
  const Grid& grid_;
  FastMarchingOptions options_;
  std::array<float, 3> inverse_squared_;
  float least_slowness_ = 0;
  float earliest_after_ = 0;  ///< the least time from the first neighbour to a voxel
  FrontGrid front_;
  FrontQueue queue_;
  Band band_;
  WaitingRoom waiting_;
  std::vector<std::uint32_t> given_;  ///< voxels with a source's time
};

void check(const Image<float>& speed, std::span<const FrontSource> sources, const FastMarchingOptions& options) {
  if (options.order != 1 && options.order != 2)
    throw InputError(fmt::format("fast marching: order {}; it is 1 or 2", options.order));
  if (!(options.stop_time > 0))
    throw InputError(fmt::format("fast marching: stop_time {} must be > 0", options.stop_time));
  if (!(options.source_radius_mm >= 0))
    throw InputError(fmt::format("fast marching: source_radius_mm {} must be >= 0", options.source_radius_mm));
  if (const double stored = FrontGrid::stored(speed.grid.size); stored > FrontQueue::none)
    throw InputError(
        fmt::format("fast marching: {:.0f} voxels with the border; at most {}: use a coarser or smaller volume", stored,
                    FrontQueue::none));
  if (sources.empty()) throw InputError("fast marching: there is no source; give at least one point in mm");
  const auto bad =
      std::find_if(speed.voxels.begin(), speed.voxels.end(), [](float v) { return !(v >= 0) || std::isinf(v); });
  if (bad != speed.voxels.end())
    throw InputError(fmt::format("fast marching: the speed of voxel {} is {}; it must be finite and >= 0",
                                 bad - speed.voxels.begin(), *bad));
  const Grid& grid = speed.grid;
  for (const FrontSource& source : sources) {
    const Eigen::Vector3d& p = source.point_mm;
    const std::string place = fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", p.x(), p.y(), p.z());
    const Eigen::Vector3i at = grid.continuous_index(p).array().round().cast<int>();
    const Eigen::Vector3d a = grid.point(Eigen::Vector3d::Zero()),
                          b = grid.point((grid.size - Eigen::Vector3i::Ones()).cast<double>());
    if (!grid.contains(at.x(), at.y(), at.z()))
      throw InputError(
          fmt::format("fast marching: source {} lies outside the image, which reaches from ({:.1f}, {:.1f}, {:.1f}) to "
                      "({:.1f}, {:.1f}, {:.1f}) mm",
                      place, a.x(), a.y(), a.z(), b.x(), b.y(), b.z()));
    if (speed.at(at.x(), at.y(), at.z()) == 0)
      throw InputError(
          fmt::format("fast marching: the speed at source {} is 0; move it, or widen the speed's range", place));
    if (!(source.time >= 0))
      throw InputError(fmt::format("fast marching: time {} of source {} must be >= 0", source.time, place));
  }
}

}  // namespace

Image<float> fast_march(const Image<float>& speed, std::span<const FrontSource> sources,
                        const FastMarchingOptions& options) {
  check(speed, sources, options);
  FrontRun march(speed, options);
  for (const FrontSource& source : sources) march.start(source);
  return march.run();
}

}  // namespace supine::segmentation

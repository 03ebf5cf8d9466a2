// SPDX-License-Identifier: AGPL-3.0-or-later
#include "segmentation/fast_marching.h"

#include <fmt/format.h>
#include <sys/mman.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <vector>

#include "common/error.h"

namespace supine::segmentation {
namespace {

constexpr float infinite = std::numeric_limits<float>::infinity();
constexpr std::size_t bucket_count = 4096;
constexpr int rim = 2;  // voxels around the volume that no front enters, so that stencils need no bounds

/// Time and state of a voxel side by side: the front comes back to its voxels in an order that no cache foresees.
struct Voxel {
  float time = infinite;
  float slowness = infinite;  ///< negative once the front has passed; infinite where it may not go or the time is given
  bool passed() const { return std::signbit(slowness); }
  void pass() { slowness = -slowness; }
};

/// Memory in large pages where the system has them: half of the time went into finding small ones.
template <class T>
struct LargePages {
  using value_type = T;
  LargePages() = default;
  template <class U>
  LargePages(const LargePages<U>&) {}
  T* allocate(std::size_t count) {
    constexpr std::size_t page = std::size_t{1} << 21;
    const std::size_t bytes = (count * sizeof(T) + page - 1) / page * page;
    void* memory = std::aligned_alloc(page, bytes);
    if (memory == nullptr) throw std::bad_alloc();
    madvise(memory, bytes, MADV_HUGEPAGE);
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, std::size_t) { std::free(memory); }
  bool operator==(const LargePages&) const { return true; }
};

/// Voxels in the order of their times: buckets of equal width, of which the earliest is a heap. Times beyond the last
/// bucket wait aside until the others are used up.
class BucketQueue {
 public:
  struct Entry {
    float time;
    std::uint32_t voxel;
    /// For a heap with the earliest on top; ties by voxel, so that the order does not depend on the heap's.
    bool operator<(const Entry& other) const {
      return time > other.time || (time == other.time && voxel > other.voxel);
    }
  };
  explicit BucketQueue(double width) : width_(width), buckets_(bucket_count) {}

  void push(std::uint32_t voxel, float time) {
    const std::int64_t bucket = std::max(current_, static_cast<std::int64_t>(time / width_));
    if (bucket >= current_ + static_cast<std::int64_t>(bucket_count)) {
      later_.push_back({time, voxel});
      return;
    }
    auto& entries = buckets_[static_cast<std::size_t>(bucket) % bucket_count];
    entries.push_back({time, voxel});
    if (bucket == current_) std::push_heap(entries.begin(), entries.end());
    ++held_;
  }
  /// The earliest entry, or false.
  bool pop(Entry& entry) {
    if (held_ == 0) {
      if (later_.empty()) return false;
      fetch_later();
    }
    while (buckets_[static_cast<std::size_t>(current_) % bucket_count].empty()) {
      ++current_;
      auto& next = buckets_[static_cast<std::size_t>(current_) % bucket_count];
      std::make_heap(next.begin(), next.end());
    }
    auto& entries = buckets_[static_cast<std::size_t>(current_) % bucket_count];
    std::pop_heap(entries.begin(), entries.end());
    entry = entries.back();
    entries.pop_back();
    --held_;
    return true;
  }

 private:
  void fetch_later() {
    float first = infinite;
    for (const Entry& waiting : later_) first = std::min(first, waiting.time);
    current_ = static_cast<std::int64_t>(first / width_);
    std::vector<Entry> waiting;
    waiting.swap(later_);
    for (const Entry& entry : waiting) push(entry.voxel, entry.time);
  }
  double width_;
  std::int64_t current_ = 0;
  std::size_t held_ = 0;
  std::vector<std::vector<Entry>> buckets_;
  std::vector<Entry> later_;
};

class FrontRun {
 public:
  FrontRun(const Image<float>& speed, const FastMarchingOptions& options)
      : speed_(speed), grid_(speed.grid), options_(options), queue_(bucket_width(speed)) {
    const Eigen::Vector3i padded = grid_.size.array() + 2 * rim;
    strides_ = {1, padded.x(), static_cast<std::ptrdiff_t>(padded.x()) * padded.y()};
    const std::size_t count = static_cast<std::size_t>(strides_[2]) * padded.z();
    voxels_.resize(count);
#pragma omp parallel for schedule(static)
    for (int k = 0; k < grid_.size.z(); ++k)
      for (int j = 0; j < grid_.size.y(); ++j)
        for (int i = 0; i < grid_.size.x(); ++i) voxels_[padded_index(i, j, k)].slowness = 1 / speed.at(i, j, k);
    for (int a = 0; a < 3; ++a) inverse_[a] = static_cast<float>(1 / grid_.spacing_mm[a]);
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
            give(static_cast<std::uint32_t>(padded_index(i, j, k)), static_cast<float>(source.time + way * slow));
        }
  }

  Image<float> run() {
    BucketQueue::Entry entry;
    while (queue_.pop(entry)) {
      const std::uint32_t n = entry.voxel;
      Voxel& voxel = voxels_[n];
      if (voxel.passed() || entry.time != voxel.time) continue;  // an entry it left behind
      if (entry.time > options_.stop_time) break;
      voxel.pass();
      for (const std::ptrdiff_t stride : strides_) {
        visit(static_cast<std::uint32_t>(n - stride));
        visit(static_cast<std::uint32_t>(n + stride));
      }
    }
    return unpad();
  }

 private:
  /// A bucket is crossed in a sixteenth of a voxel at full speed, so that its heap stays small.
  static double bucket_width(const Image<float>& speed) {
    float fastest = 0;
    for (const float v : speed.voxels) fastest = std::max(fastest, v);
    return speed.grid.spacing_mm.minCoeff() / (16.0 * fastest);
  }
  std::size_t padded_index(int i, int j, int k) const {
    return static_cast<std::size_t>((i + rim) + (j + rim) * strides_[1] + (k + rim) * strides_[2]);
  }
  void give(std::uint32_t n, float time) {
    if (time >= voxels_[n].time) return;
    voxels_[n] = {time, infinite};
    queue_.push(n, time);
  }
  void visit(std::uint32_t n) {
    Voxel& voxel = voxels_[n];
    if (voxel.passed() || std::isinf(voxel.slowness)) return;
    // The last solution counts, not the smallest: it knows most neighbours, and second differences may raise it.
    const float time = solve(n);
    if (time == voxel.time) return;
    voxel.time = time;
    queue_.push(n, time);
  }

  /// One axis of the upwind differences: (a T - b)^2 with T > from.
  struct Side {
    float a, b, from;
  };
  float passed_time(std::size_t n) const { return voxels_[n].passed() ? voxels_[n].time : infinite; }
  float solve(std::uint32_t n) const {
    std::array<Side, 3> sides;
    int count = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const std::ptrdiff_t stride = strides_[axis];
      const float below = passed_time(n - stride), above = passed_time(n + stride);
      const float nearest = std::min(below, above);
      if (std::isinf(nearest)) continue;
      const std::ptrdiff_t step = below < above ? -stride : stride;
      Side side{inverse_[axis], nearest * inverse_[axis], nearest};
      if (const float second = options_.order == 2 ? passed_time(n + 2 * step) : infinite; second <= nearest)
        side = {1.5f * inverse_[axis], (2 * nearest - 0.5f * second) * inverse_[axis], nearest};
      int at = count++;
      for (; at > 0 && sides[at - 1].from > side.from; --at) sides[at] = sides[at - 1];
      sides[at] = side;
    }
    for (; count > 0; --count) {  // leave out the latest side until the front comes from behind all that are left
      const float time = root(sides, count, voxels_[n].slowness);
      if (time >= sides[count - 1].from) return time;
    }
    return infinite;
  }
  static float root(const std::array<Side, 3>& sides, int count, float slowness) {
    double aa = 0, ab = 0, bb = -static_cast<double>(slowness) * slowness;
    for (int s = 0; s < count; ++s) {
      aa += static_cast<double>(sides[s].a) * sides[s].a;
      ab += static_cast<double>(sides[s].a) * sides[s].b;
      bb += static_cast<double>(sides[s].b) * sides[s].b;
    }
    const double discriminant = ab * ab - aa * bb;
    return discriminant < 0 ? -1.0f : static_cast<float>((ab + std::sqrt(discriminant)) / aa);
  }

  Image<float> unpad() const {
    Image<float> result{grid_, std::vector<float>(grid_.count())};
#pragma omp parallel for schedule(static)
    for (int k = 0; k < grid_.size.z(); ++k)
      for (int j = 0; j < grid_.size.y(); ++j)
        for (int i = 0; i < grid_.size.x(); ++i) {
          result.at(i, j, k) = passed_time(padded_index(i, j, k));
        }
    return result;
  }

  const Image<float>& speed_;
  const Grid& grid_;
  FastMarchingOptions options_;
  BucketQueue queue_;
  std::array<std::ptrdiff_t, 3> strides_;
  std::array<float, 3> inverse_;
  std::vector<Voxel, LargePages<Voxel>> voxels_;
};

void check(const Image<float>& speed, std::span<const FrontSource> sources, const FastMarchingOptions& options) {
  if (options.order != 1 && options.order != 2)
    throw InputError(fmt::format("fast marching: order {}; it is 1 or 2", options.order));
  if (!(options.stop_time > 0))
    throw InputError(fmt::format("fast marching: stop_time {} must be > 0", options.stop_time));
  if (!(options.source_radius_mm >= 0))
    throw InputError(fmt::format("fast marching: source_radius_mm {} must be >= 0", options.source_radius_mm));
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

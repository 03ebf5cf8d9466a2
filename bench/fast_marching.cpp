// SPDX-License-Identifier: AGPL-3.0-or-later
// Fast marching from one point of a box with speed 1 against the exact distance: error, time and memory, of both
// orders, and of ITK's filter when it was there at configure time. Arguments: voxels along x, y, z (default 512 512
// 200).
#include "segmentation/fronts/fast_marching.h"

#include <fmt/core.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <string>
#ifdef SUPINE_WITH_ITK
#include <itkFastMarchingImageFilter.h>
#endif

namespace {

using supine::segmentation::Grid;
using supine::segmentation::Image;

double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// Resident memory in MB: "VmRSS" now, "VmHWM" the most since forget_most_memory().
double memory_mb(const std::string& which) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with(which + ":")) return std::stod(line.substr(which.size() + 1)) / 1024;
  return 0;
}
void forget_most_memory() { std::ofstream("/proc/self/clear_refs") << "5"; }

struct Spent {
  double wall_s, cpu_s, memory_mb;
};

/// Time and memory on top of what was there at the start.
class Meter {
 public:
  Meter() {
    forget_most_memory();
    before_mb_ = memory_mb("VmRSS");
    cpu_s_ = cpu_s();
    wall_ = std::chrono::steady_clock::now();
  }
  Spent read() const {
    return {std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_).count(), cpu_s() - cpu_s_,
            memory_mb("VmHWM") - before_mb_};
  }

 private:
  std::chrono::steady_clock::time_point wall_;
  double cpu_s_, before_mb_;
};

template <class Value>
void compare(const Grid& grid, const Eigen::Vector3d& source, const Spent& spent, const char* what, Value value) {
  double squares = 0, worst = 0;
  std::size_t n = 0;
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        const double off = std::abs(value(n++) - (grid.point(Eigen::Vector3d(i, j, k)) - source).norm());
        squares += off * off;
        worst = std::max(worst, off);
      }
  fmt::print("{:<22} {:>8.2f} {:>8.2f} {:>8.0f} {:>10.4f} {:>10.4f}\n", what, spent.wall_s, spent.cpu_s,
             spent.memory_mb, std::sqrt(squares / static_cast<double>(n)), worst);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  Image<float> speed;
  speed.grid.size = argc > 3 ? Eigen::Vector3i(std::atoi(argv[1]), std::atoi(argv[2]), std::atoi(argv[3]))
                             : Eigen::Vector3i(512, 512, 200);
  speed.grid.spacing_mm = {0.7, 0.7, 1.5};
  speed.voxels.assign(speed.grid.count(), 1.0f);
  const Eigen::Vector3i middle = speed.grid.size / 2;
  const Eigen::Vector3d source = speed.grid.point(middle.cast<double>());
  fmt::print("{} x {} x {} voxels of 0.7 x 0.7 x 1.5 mm, one source\n", speed.grid.size.x(), speed.grid.size.y(),
             speed.grid.size.z());
  fmt::print("{:<22} {:>8} {:>8} {:>8} {:>10} {:>10}\n", "", "wall s", "CPU s", "MB", "rms mm", "worst mm");
  for (const auto& [order, radius, name] :
       {std::tuple(1, 0.0, "first order"), {2, 0.0, "second order"}, {2, 6.0, "second, 6 mm exact"}}) {
    const std::vector<supine::segmentation::FrontSource> sources = {{source, 0}};
    const Meter meter;
    const auto time = supine::segmentation::fast_march(speed, sources, {order, INFINITY, radius});
    compare(speed.grid, source, meter.read(), name, [&](std::size_t n) { return time.voxels[n]; });
  }
#ifdef SUPINE_WITH_ITK
  using ItkImage = itk::Image<float, 3>;
  using Filter = itk::FastMarchingImageFilter<ItkImage, ItkImage>;
  auto image = ItkImage::New();
  const ItkImage::SizeType size = {{static_cast<unsigned>(speed.grid.size.x()),
                                    static_cast<unsigned>(speed.grid.size.y()),
                                    static_cast<unsigned>(speed.grid.size.z())}};
  image->SetRegions(ItkImage::RegionType(size));
  image->SetSpacing(speed.grid.spacing_mm.data());
  image->Allocate();
  image->FillBuffer(1.0f);
  auto filter = Filter::New();
  auto seeds = Filter::NodeContainer::New();
  Filter::NodeType node;
  node.SetValue(0);
  node.SetIndex({{middle.x(), middle.y(), middle.z()}});
  seeds->Initialize();
  seeds->InsertElement(0, node);
  filter->SetTrialPoints(seeds);
  filter->SetInput(image);
  const Meter meter;
  filter->Update();
  const float* time = filter->GetOutput()->GetBufferPointer();
  compare(speed.grid, source, meter.read(), "ITK 5.2", [&](std::size_t n) { return time[n]; });
#endif
}

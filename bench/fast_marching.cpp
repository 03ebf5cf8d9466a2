// SPDX-License-Identifier: AGPL-3.0-or-later
// Fast marching from one point of a box with speed 1 against the exact distance: error and time, of both orders, and of
// ITK's filter when it was there at configure time. Arguments: voxels along x, y, z (default 512 512 200).
#include "segmentation/fast_marching.h"

#include <fmt/core.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#ifdef SUPINE_WITH_ITK
#include <itkFastMarchingImageFilter.h>
#endif

namespace {

using supine::segmentation::Grid;
using supine::segmentation::Image;

double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

struct Stopwatch {
  std::chrono::steady_clock::time_point wall = std::chrono::steady_clock::now();
  double cpu = cpu_s();
  std::pair<double, double> read() const {
    return {std::chrono::duration<double>(std::chrono::steady_clock::now() - wall).count(), cpu_s() - cpu};
  }
};

template <class Value>
void compare(const Grid& grid, const Eigen::Vector3d& source, std::pair<double, double> spent, const char* what,
             Value value) {
  double squares = 0, worst = 0;
  std::size_t n = 0;
  for (int k = 0; k < grid.size.z(); ++k)
    for (int j = 0; j < grid.size.y(); ++j)
      for (int i = 0; i < grid.size.x(); ++i) {
        const double off = std::abs(value(n++) - (grid.point(Eigen::Vector3d(i, j, k)) - source).norm());
        squares += off * off;
        worst = std::max(worst, off);
      }
  fmt::print("{:<22} {:>8.2f} {:>8.2f} {:>10.4f} {:>10.4f}\n", what, spent.first, spent.second,
             std::sqrt(squares / static_cast<double>(n)), worst);
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
  fmt::print("{:<22} {:>8} {:>8} {:>10} {:>10}\n", "", "wall s", "CPU s", "rms mm", "worst mm");
  for (const auto& [order, radius, name] :
       {std::tuple(1, 0.0, "first order"), {2, 0.0, "second order"}, {2, 6.0, "second, 6 mm exact"}}) {
    const Stopwatch watch;
    const std::vector<supine::segmentation::FrontSource> sources = {{source, 0}};
    const auto time = supine::segmentation::fast_march(speed, sources, {order, INFINITY, radius});
    compare(speed.grid, source, watch.read(), name, [&](std::size_t n) { return time.voxels[n]; });
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
  const Stopwatch watch;
  filter->Update();
  const float* time = filter->GetOutput()->GetBufferPointer();
  compare(speed.grid, source, watch.read(), "ITK 5.2", [&](std::size_t n) { return time[n]; });
#endif
}

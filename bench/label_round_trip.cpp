// SPDX-License-Identifier: AGPL-3.0-or-later
// Labels to a surface and back: Dice overlap with the labels, volume and area, for the faired surface that
// supine-reconstruct makes, for the bare staircase of marching cubes and for marching cubes on a smoothed signed
// distance (VTK), each in CPU seconds. Solids whose volume and area are known, at 0.5 mm and with 0.7 x 0.7 x 4 mm
// voxels.
#include <fmt/core.h>
#include <vtkFloatArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkImageStencil.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyDataToImageStencil.h>

#include <Eigen/Geometry>
#include <cmath>
#include <ctime>
#include <functional>
#include <numbers>

#include "reconstruction/reconstruct.h"
#include "segmentation/blur.h"
#include "segmentation/masks.h"

namespace {

using namespace supine;
using segmentation::Grid;
using segmentation::LabelImage;
using segmentation::Tissue;

constexpr double pi = std::numbers::pi;

double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

struct Solid {
  const char* name;
  double volume_mm3, area_mm2;  ///< exact
  Tissue measured;              ///< adipose: everything that is meshed, else that organ
  Grid grid;
  std::function<Tissue(const Eigen::Vector3d&)> tissue;
};

Grid grid_around(const Eigen::Vector3d& spacing_mm, const Eigen::Matrix3d& direction) {
  Grid grid;
  grid.spacing_mm = spacing_mm;
  grid.direction = direction;
  grid.size = (72 / spacing_mm.array()).ceil().cast<int>();
  grid.origin_mm = -direction * spacing_mm.cwiseProduct((grid.size.array() - 1).matrix().cast<double>() / 2);
  return grid;
}

LabelImage voxelise(const Solid& solid) {
  LabelImage image{solid.grid, {}};
  for (int k = 0; k < solid.grid.size.z(); ++k)
    for (int j = 0; j < solid.grid.size.y(); ++j)
      for (int i = 0; i < solid.grid.size.x(); ++i)
        image.voxels.push_back(static_cast<std::uint8_t>(solid.tissue(solid.grid.point(Eigen::Vector3d(i, j, k)))));
  return image;
}

bool belongs(const Solid& solid, std::uint8_t value) {
  return solid.measured == Tissue::adipose ? is_meshed(static_cast<Tissue>(value))
                                           : static_cast<Tissue>(value) == solid.measured;
}

/// The surface (patient mm) in mm along the image's axes, from voxel 0.
Points along_axes(Points points, const Grid& grid) {
  for (auto row : points.rowwise())
    row = grid.continuous_index(row.transpose()).cwiseProduct(grid.spacing_mm).transpose();
  return points;
}

vtkNew<vtkImageData> new_image(const Grid& grid) {
  vtkNew<vtkImageData> data;
  data->SetDimensions(grid.size.x(), grid.size.y(), grid.size.z());
  data->SetSpacing(grid.spacing_mm.x(), grid.spacing_mm.y(), grid.spacing_mm.z());
  return data;
}

/// Voxels whose centre lies inside the closed surface.
std::vector<bool> fill(vtkPolyData* surface, const Grid& grid) {
  vtkNew<vtkImageData> ones = new_image(grid);
  ones->AllocateScalars(VTK_UNSIGNED_CHAR, 1);
  ones->GetPointData()->GetScalars()->Fill(1);
  vtkNew<vtkPolyDataToImageStencil> stencil;
  stencil->SetInputData(surface);
  stencil->SetOutputSpacing(ones->GetSpacing());
  stencil->SetOutputWholeExtent(ones->GetExtent());
  stencil->SetTolerance(0);
  vtkNew<vtkImageStencil> cut;
  cut->SetInputData(ones);
  cut->SetStencilConnection(stencil->GetOutputPort());
  cut->SetBackgroundValue(0);
  cut->Update();
  const auto* values = static_cast<unsigned char*>(cut->GetOutput()->GetScalarPointer());
  return std::vector<bool>(values, values + grid.count());
}

vtkNew<vtkPolyData> poly_data(const Points& points, const Triangles& triangles) {
  vtkNew<vtkPoints> places;
  for (const auto& p : points.rowwise()) places->InsertNextPoint(p.x(), p.y(), p.z());
  vtkNew<vtkCellArray> cells;
  for (const auto& t : triangles.rowwise()) cells->InsertNextCell({t[0], t[1], t[2]});
  vtkNew<vtkPolyData> data;
  data->SetPoints(places);
  data->SetPolys(cells);
  return data;
}

void report(const Solid& solid, const LabelImage& image, const char* what, double seconds, const Points& points,
            const Triangles& triangles) {
  double volume = 0, area = 0;
  for (const auto& t : triangles.rowwise()) {
    const Eigen::Vector3d a = points.row(t[0]), b = points.row(t[1]), c = points.row(t[2]);
    volume += a.dot(b.cross(c)) / 6;
    area += (b - a).cross(c - a).norm() / 2;
  }
  const std::vector<bool> inside = fill(poly_data(points, triangles), solid.grid);
  std::size_t labels = 0, surface = 0, common = 0;
  for (std::size_t n = 0; n < inside.size(); ++n) {
    const bool wanted = belongs(solid, image.voxels[n]);
    labels += wanted;
    surface += inside[n];
    common += wanted && inside[n];
  }
  const double voxels_mm3 = static_cast<double>(labels) * solid.grid.voxel_volume_mm3();
  fmt::print("| {} | {} | {:.4f} | {:+.3f} | {:+.3f} | {:+.2f} | {} | {:.2f} |\n", solid.name, what,
             2.0 * static_cast<double>(common) / static_cast<double>(labels + surface),
             100 * (std::abs(volume) / voxels_mm3 - 1), 100 * (std::abs(volume) / solid.volume_mm3 - 1),
             100 * (area / solid.area_mm2 - 1), triangles.rows(), seconds);
}

void ours(const Solid& solid, const LabelImage& image) {
  const double start = cpu_s();
  reconstruction::ReconstructOptions options;
  options.cut = {.excluded = true, .edge = true};
  const auto made = reconstruction::reconstruct(image, options);
  const double seconds = cpu_s() - start;
  const std::string name(segmentation::tissue_names[static_cast<int>(solid.measured)]);
  for (const auto& organ : made.organs)
    if (organ.name == name)
      return report(solid, image, "faired", seconds, along_axes(organ.surface.points, solid.grid),
                    organ.surface.triangles);
  report(solid, image, "faired", seconds, along_axes(made.breast.surface.points, solid.grid),
         made.breast.surface.triangles);
}

void staircase(const Solid& solid, const LabelImage& image) {
  const double start = cpu_s();
  const auto members =
      solid.measured == Tissue::adipose ? reconstruction::meshed_tissues() : reconstruction::only(solid.measured);
  const auto made = reconstruction::voxel_surface(image, members);
  report(solid, image, "staircase", cpu_s() - start, made.surface.points, made.surface.triangles);
}

void smoothed_distance(const Solid& solid, const LabelImage& image) {
  const double start = cpu_s();
  const Grid& grid = solid.grid;
  segmentation::Mask in(image.voxels.size()), out(image.voxels.size());
  for (std::size_t n = 0; n < in.size(); ++n) out[n] = !(in[n] = belongs(solid, image.voxels[n]));
  const auto to_out = segmentation::squared_distance_mm2(out, grid), to_in = squared_distance_mm2(in, grid);
  std::vector<float> distance(in.size());
  for (std::size_t n = 0; n < in.size(); ++n) distance[n] = std::sqrt(to_out[n]) - std::sqrt(to_in[n]);
  segmentation::gaussian_blur(distance, grid, grid.spacing_mm.maxCoeff());
  vtkNew<vtkImageData> data = new_image(grid);
  vtkNew<vtkFloatArray> values;
  values->SetArray(distance.data(), static_cast<vtkIdType>(distance.size()), 1);
  data->GetPointData()->SetScalars(values);
  vtkNew<vtkFlyingEdges3D> contour;
  contour->SetInputData(data);
  contour->SetValue(0, 0.0);
  contour->Update();
  const double seconds = cpu_s() - start;
  vtkPolyData* made = contour->GetOutput();
  Points points(made->GetNumberOfPoints(), 3);
  for (Eigen::Index p = 0; p < points.rows(); ++p) points.row(p) = Eigen::Map<Eigen::RowVector3d>(made->GetPoint(p));
  Triangles triangles(made->GetNumberOfCells(), 3);
  for (Eigen::Index t = 0; t < triangles.rows(); ++t)
    for (int c = 0; c < 3; ++c) triangles(t, c) = static_cast<int>(made->GetCell(t)->GetPointId(c));
  report(solid, image, "smoothed distance", seconds, points, triangles);
}

/// A ball of gland of 20 mm in a block of fat on a muscle.
Tissue ball(const Eigen::Vector3d& p) {
  if (p.norm() < 20) return Tissue::gland;
  if (p.cwiseAbs().maxCoeff() > 28) return Tissue::air;
  return p.y() > 24 ? Tissue::muscle : Tissue::adipose;
}

std::vector<Solid> solids() {
  const Eigen::Matrix3d straight = Eigen::Matrix3d::Identity(), flipped = Eigen::Vector3d(-1, 1, -1).asDiagonal();
  const Eigen::Matrix3d oblique = Eigen::AngleAxisd(0.6, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const Eigen::Vector3d fine = Eigen::Vector3d::Constant(0.5), flat(0.7, 0.7, 4);
  const double ball_volume = 4.0 / 3 * pi * 8000, ball_area = 4 * pi * 400;
  const auto halves = [](const Eigen::Vector3d& p) {
    const Tissue t = ball(p);
    return t == Tissue::gland && p.x() > 0.1 ? Tissue::tumour : t;
  };
  const double cap_volume = pi * 19.9 * 19.9 * (60 - 19.9) / 3, cap_area = 2 * pi * 20 * 19.9 + pi * (400 - 0.01);
  const auto shell = [](const Eigen::Vector3d& p) {
    return p.norm() < 27 ? Tissue::muscle : p.norm() < 30 ? Tissue::adipose : Tissue::air;
  };
  return {{"ball, 0.5 mm", ball_volume, ball_area, Tissue::gland, grid_around(fine, straight), ball},
          {"ball, flipped axes", ball_volume, ball_area, Tissue::gland, grid_around(fine, flipped), ball},
          {"ball, oblique axes", ball_volume, ball_area, Tissue::gland, grid_around(fine, oblique), ball},
          {"half ball that touches another", cap_volume, cap_area, Tissue::tumour, grid_around(fine, straight), halves},
          {"shell of 3 mm on a muscle", 4.0 / 3 * pi * (27000 - 19683), 4 * pi * (900 + 729), Tissue::adipose,
           grid_around(fine, straight), shell},
          {"ball, 0.7 x 0.7 x 4 mm", ball_volume, ball_area, Tissue::gland, grid_around(flat, straight), ball}};
}

}  // namespace

int main() {
  fmt::print(
      "| solid | surface | Dice | volume against voxels % | against the solid % | area % | triangles | CPU s |\n");
  fmt::print("|---|---|---|---|---|---|---|---|\n");
  for (const Solid& solid : solids()) {
    const LabelImage image = voxelise(solid);
    ours(solid, image);
    staircase(solid, image);
    smoothed_distance(solid, image);
  }
}

// SPDX-License-Identifier: AGPL-3.0-or-later
// What was written, read by ITK, which knows nothing of us; and turned round by VTK as 3D Slicer does for points.
#include <gtest/gtest.h>
#include <itkDisplacementFieldTransform.h>
#include <itkImage.h>
#include <itkImageFileReader.h>
#include <itkNiftiImageIOFactory.h>
#include <itkNrrdImageIOFactory.h>
#include <itkResampleImageFilter.h>
#include <itkTransformFactoryBase.h>
#include <itkTransformFileReader.h>
#include <itkTxtTransformIOFactory.h>
#include <vtkGridTransform.h>
#include <vtkImageData.h>
#include <vtkNew.h>

#include "segmentation/formats/vector_io.h"
#include "tests/segmentation/formats/image_files.h"
#include "tests/warp/two_shapes.h"
#include "warp/displacement.h"

namespace supine::warp {
namespace {

using segmentation::testing::TemporaryFolder;
using Field = itk::DisplacementFieldTransform<double, 3>;

Eigen::Vector3d middle_of_cell(const meshing::TetMesh& mesh, const Points& shape, Eigen::Index cell) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (int a = 0; a < 4; ++a) middle += 0.25 * shape.row(mesh.cells(cell, a)).transpose();
  return middle;
}

itk::Point<double, 3> itk_point(const Eigen::Vector3d& p) {
  itk::Point<double, 3> point;
  for (unsigned a = 0; a < 3; ++a) point[a] = p[static_cast<Eigen::Index>(a)];
  return point;
}

double distance(const itk::Point<double, 3>& a, const Eigen::Vector3d& b) {
  return (Eigen::Vector3d(a[0], a[1], a[2]) - b).norm();
}

/// ITK finds readers by these alone.
const bool registered = [] {
  itk::TxtTransformIOFactory::RegisterOneFactory();
  itk::NrrdImageIOFactory::RegisterOneFactory();
  itk::NiftiImageIOFactory::RegisterOneFactory();
  itk::TransformFactoryBase::RegisterDefaultTransforms();
  return true;
}();

Field::Pointer read_field(const std::filesystem::path& file) {
  EXPECT_TRUE(registered);
  auto reader = itk::TransformFileReaderTemplate<double>::New();
  reader->SetFileName(file.string());
  reader->Update();
  EXPECT_EQ(reader->GetTransformList()->size(), 1u);
  return dynamic_cast<Field*>(reader->GetTransformList()->front().GetPointer());
}

struct Written {
  Written() : box(testing::moved_box(1, testing::affine)), field(displacement_of(box.shapes(), 2, 10)) {}
  testing::MovedBox box;
  Displacement field;
  TemporaryFolder folder;
};

TEST(Itk, TakesTargetPlacesToSourcePlaces) {
  Written w;
  write_tfm(w.field.image, w.folder / "a.tfm");
  const Field::Pointer transform = read_field(w.folder / "a.tfm");
  ASSERT_TRUE(transform);
  for (Eigen::Index c = 0; c < w.box.mesh.cells.rows(); ++c) {
    const Eigen::Vector3d source = middle_of_cell(w.box.mesh, w.box.mesh.points, c);
    const Eigen::Vector3d target = middle_of_cell(w.box.mesh, w.box.target, c);
    EXPECT_LT(distance(transform->TransformPoint(itk_point(target)), source), 1e-3) << c;
  }
}

// Both formats hold the same vectors in the same places, and these are LPS.
TEST(Itk, ReadsTheGridsOfBothFormats) {
  Written w;
  using VectorImage = itk::Image<itk::Vector<float, 3>, 3>;
  for (const char* name : {"a.nrrd", "a.nii.gz"}) {
    segmentation::write_vectors(w.field.image, w.folder / name);
    auto reader = itk::ImageFileReader<VectorImage>::New();
    reader->SetFileName((w.folder / name).string());
    reader->Update();
    const auto& grid = w.field.image.grid;
    auto* image = reader->GetOutput();
    for (int a = 0; a < 3; ++a)
      ASSERT_EQ(static_cast<int>(image->GetLargestPossibleRegion().GetSize()[static_cast<unsigned>(a)]), grid.size[a]);
    for (std::size_t n = 0; n < grid.count(); n += 97) {
      const auto i = static_cast<long>(n);
      const long nx = grid.size.x(), ny = grid.size.y();
      const VectorImage::IndexType index = {i % nx, i / nx % ny, i / nx / ny};
      itk::Point<double, 3> place;
      image->TransformIndexToPhysicalPoint(index, place);
      EXPECT_LT(distance(place, grid.point(Eigen::Vector3d(static_cast<double>(index[0]), static_cast<double>(index[1]),
                                                           static_cast<double>(index[2])))),
                1e-3)
          << name;
      for (unsigned a = 0; a < 3; ++a)
        EXPECT_NEAR(image->GetPixel(index)[a], w.field.image.vectors[n][a], 1e-5) << name << " " << n;
    }
  }
}

// ITK resamples the volume with our transform: in the body it shows what we show.
TEST(Itk, ResamplesAVolumeAsWeDo) {
  Written w;
  const auto volume = testing::volume_of(testing::grid_over({-40, -40, -40}, 120, 2),
                                         [](const auto& p) { return 300 + 2 * p.x() - 3 * p.y() + p.z(); });
  const auto grid = testing::grid_over({-20, -20, -20}, 80, 2.5);
  const WarpedVolume ours = warp_volume(w.box.shapes(), volume, grid, {});
  segmentation::write_image(volume, w.folder / "v.nrrd");
  segmentation::write_image(ours.image, w.folder / "ours.nrrd");
  write_tfm(w.field.image, w.folder / "a.tfm");
  using Image = itk::Image<float, 3>;
  const auto read = [&](const char* name) {
    auto reader = itk::ImageFileReader<Image>::New();
    reader->SetFileName((w.folder / name).string());
    reader->Update();
    return Image::Pointer(reader->GetOutput());
  };
  const Image::Pointer like = read("ours.nrrd");
  auto resample = itk::ResampleImageFilter<Image, Image>::New();
  resample->SetInput(read("v.nrrd"));
  resample->SetTransform(read_field(w.folder / "a.tfm"));
  resample->UseReferenceImageOn();
  resample->SetReferenceImage(like);
  resample->Update();
  std::size_t inside = 0;
  for (std::size_t n = 0; n < grid.count(); ++n) {
    const auto i = static_cast<long>(n);
    const long nx = grid.size.x(), ny = grid.size.y();
    const Image::IndexType index = {i % nx, i / nx % ny, i / nx / ny};
    const Eigen::Vector3d from = testing::affine_back(grid.point(
        Eigen::Vector3d(static_cast<double>(index[0]), static_cast<double>(index[1]), static_cast<double>(index[2]))));
    // A grid's cell that the surface cuts mixes the body's way with that of its surroundings.
    if (from.minCoeff() < 4 || from.maxCoeff() > 36) continue;
    ++inside;
    EXPECT_NEAR(resample->GetOutput()->GetPixel(index), like->GetPixel(index), 0.02);
  }
  EXPECT_GT(inside, 500u);
}

// 3D Slicer moves models and markups by the inverse of the grid, which vtkGridTransform searches: it must end in the
// target shape. As a breast the box stays about where it is at its muscle side (z = 0), and moves up to as far as it is
// thick at the other.
TEST(Vtk, FindsTheWayOfPointsBackThroughTheGrid) {
  for (const double way : {10.0, 40.0}) {
    const testing::MovedBox box = testing::moved_box(1, [way](const Eigen::Vector3d& x) {
      return Eigen::Vector3d(x + x.z() / 40 * way * Eigen::Vector3d(0.6, 0.64, -0.48));
    });
    const Displacement field = displacement_of(box.shapes(), 2, 10);
    const auto& grid = field.image.grid;
    vtkNew<vtkImageData> image;
    image->SetDimensions(grid.size.x(), grid.size.y(), grid.size.z());
    image->SetOrigin(grid.origin_mm.data());
    image->SetSpacing(grid.spacing_mm.data());
    image->AllocateScalars(VTK_FLOAT, 3);
    auto* values = static_cast<float*>(image->GetScalarPointer());
    for (const Eigen::Vector3f& v : field.image.vectors)
      for (int a = 0; a < 3; ++a) *values++ = v[a];
    vtkNew<vtkGridTransform> transform;
    transform->SetDisplacementGridData(image);
    transform->SetInterpolationModeToLinear();
    transform->Inverse();
    for (Eigen::Index c = 0; c < box.mesh.cells.rows(); ++c) {
      const Eigen::Vector3d source = middle_of_cell(box.mesh, box.mesh.points, c);
      double found[3];
      transform->TransformPoint(source.data(), found);
      EXPECT_LT((Eigen::Vector3d(found) - middle_of_cell(box.mesh, box.target, c)).norm(), 0.1) << c;
    }
  }
}

}  // namespace
}  // namespace supine::warp

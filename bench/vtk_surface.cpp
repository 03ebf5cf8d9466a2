// SPDX-License-Identifier: AGPL-3.0-or-later
// What a VTK user runs instead of supine-reconstruct and supine-decimate: the mask of all that is meshed, flying edges,
// windowed sinc smoothing and, with a number of triangles, quadric decimation. No regions, no organs, no proof.
// Arguments: labels.vti OUT.vtp [TRIANGLES].
#include <fmt/core.h>
#include <vtkDiscreteFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkMassProperties.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkQuadricDecimation.h>
#include <vtkUnsignedCharArray.h>
#include <vtkWindowedSincPolyDataFilter.h>
#include <vtkXMLPolyDataWriter.h>

#include <algorithm>
#include <cstdlib>

#include "segmentation/formats/labels_io.h"
#include "segmentation/tissue.h"

int main(int argc, char** argv) {
  if (argc < 3) {
    fmt::print(stderr, "vtk_surface labels.vti OUT.vtp [TRIANGLES]\n");
    return 2;
  }
  supine::segmentation::LabelImage labels = supine::segmentation::read_labels(argv[1]);
  for (auto& voxel : labels.voxels) voxel = is_meshed(static_cast<supine::segmentation::Tissue>(voxel));
  vtkNew<vtkUnsignedCharArray> values;
  values->SetArray(labels.voxels.data(), static_cast<vtkIdType>(labels.voxels.size()), 1);
  vtkNew<vtkImageData> image;
  image->SetDimensions(labels.grid.size.x(), labels.grid.size.y(), labels.grid.size.z());
  image->SetSpacing(labels.grid.spacing_mm.data());
  image->GetPointData()->SetScalars(values);
  vtkNew<vtkDiscreteFlyingEdges3D> contour;
  contour->SetInputData(image);
  contour->SetValue(0, 1);
  vtkNew<vtkWindowedSincPolyDataFilter> smooth;
  smooth->SetInputConnection(contour->GetOutputPort());
  smooth->SetNumberOfIterations(20);
  smooth->SetPassBand(0.01);
  smooth->NormalizeCoordinatesOn();
  smooth->NonManifoldSmoothingOn();
  smooth->Update();
  vtkSmartPointer<vtkPolyData> surface = smooth->GetOutput();
  if (argc > 3) {
    vtkNew<vtkQuadricDecimation> decimate;
    decimate->SetInputData(surface);
    const double wanted = std::atof(argv[3]), all = static_cast<double>(surface->GetNumberOfCells());
    decimate->SetTargetReduction(std::clamp(1 - wanted / all, 0.0, 0.9999));
    decimate->Update();
    surface = decimate->GetOutput();
  }
  vtkNew<vtkMassProperties> mass;
  mass->SetInputData(surface);
  fmt::print("{} triangles, {:.2f} ml, {:.1f} cm2\n", surface->GetNumberOfCells(), mass->GetVolume() / 1000,
             mass->GetSurfaceArea() / 100);
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetFileName(argv[2]);
  writer->SetInputData(surface);
  writer->Write();
}

// SPDX-License-Identifier: AGPL-3.0-or-later
#include <vtkActor.h>
#include <vtkGeometryFilter.h>
#include <vtkLookupTable.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>
#include <vtkThreshold.h>
#include <vtkUnstructuredGrid.h>

#include "common/error.h"
#include "common/vtk_files.h"
#include "pipeline/picture/picture.h"
#include "pipeline/picture/sheet.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;

// Okabe and Ito (2008), in the order of the regions inner, skin, ligament, cut.
constexpr Colour region_colours[] = {{0.00, 0.45, 0.70}, {0.94, 0.89, 0.26}, {0.84, 0.37, 0.00}, {0.80, 0.47, 0.65}};
constexpr const char* region_names[] = {"inner (on the muscle)", "skin", "ligament ring", "cut"};

vtkSmartPointer<vtkPolyData> read_boundary(const fs::path& file) {
  vtkNew<vtkThreshold> boundary;
  boundary->SetInputData(read_vtu(file));
  boundary->SetInputArrayToProcess(0, 0, 0, vtkDataObject::FIELD_ASSOCIATION_CELLS, "region");
  boundary->SetThresholdFunction(vtkThreshold::THRESHOLD_UPPER);
  boundary->SetUpperThreshold(1);
  vtkNew<vtkGeometryFilter> surface;
  surface->SetInputConnection(boundary->GetOutputPort());
  surface->Update();
  vtkSmartPointer<vtkPolyData> found = surface->GetOutput();
  if (found->GetNumberOfPolys() == 0) throw InputError(file.string() + " has no boundary faces to draw");
  return found;
}

void add_regions(vtkRenderer& pane, vtkPolyData* boundary) {
  vtkNew<vtkLookupTable> colours;
  colours->SetNumberOfTableValues(4);
  colours->SetTableRange(1, 4);
  for (int r = 0; r < 4; ++r)
    colours->SetTableValue(r, region_colours[r][0], region_colours[r][1], region_colours[r][2]);
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(boundary);
  mapper->SetScalarModeToUseCellFieldData();
  mapper->SelectColorArray("region");
  mapper->SetLookupTable(colours);
  mapper->UseLookupTableScalarRangeOn();
  vtkNew<vtkActor> actor;
  actor->SetMapper(mapper);
  actor->GetProperty()->EdgeVisibilityOn();
  actor->GetProperty()->SetEdgeColor(0.25, 0.25, 0.25);
  actor->GetProperty()->SetInterpolationToFlat();
  actor->GetProperty()->SetAmbient(0.35);
  actor->GetProperty()->SetDiffuse(0.7);
  pane.AddActor(actor);
}

}  // namespace

void draw_mesh(const fs::path& file, const std::string& title, const fs::path& png) {
  const auto boundary = read_boundary(file);
  double bounds[6];
  boundary->GetBounds(bounds);
  Sheet sheet(title);
  const std::pair<const View*, std::pair<double, double>> places[] = {{&front, {0, 0.42}}, {&behind, {0.42, 0.84}}};
  for (const auto& [view, across] : places) {
    vtkRenderer& pane = sheet.pane(across.first, 0, across.second, 0.93);
    add_regions(pane, boundary);
    look(pane, *view, bounds);
    scale_line(pane);
  }
  vtkRenderer& legend = sheet.pane(0.84, 0, 1, 0.93);
  for (int r = 0; r < 4; ++r) {
    const double up = 0.65 - 0.08 * r, middle = height * 0.93 * up;
    fill(legend, {{10, middle - 10, 30, middle + 10}}, region_colours[r]);
    write_text(legend, region_names[r], 0.18, up, {.size = text_size - 3, .across = Across::left});
  }
  sheet.write(png);
}

}  // namespace supine::pipeline

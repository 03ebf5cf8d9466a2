// SPDX-License-Identifier: AGPL-3.0-or-later
#include "calibration/error_map.h"

#include <fmt/format.h>
#include <vtkDoubleArray.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkXMLImageDataWriter.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "common/error.h"

namespace supine::calibration {
namespace {

std::vector<double> axis_coordinates(const FreeParameters& parameters, double centre, Eigen::Index axis, int count,
                                     double reach) {
  const double low = std::max(centre - reach, parameters.lower()[axis]);
  const double high = std::min(centre + reach, parameters.upper()[axis]);
  std::vector<double> coordinates;
  for (int i = 0; i < count; ++i) coordinates.push_back(low + (high - low) * i / (count - 1));
  return coordinates;
}

[[noreturn]] void complain(const std::filesystem::path& file) {
  throw InputError(fmt::format("{}: cannot be written (disk full, or no permission?)", file.string()));
}

double scaled(double value) { return value > 0 ? std::log10(value) : value; }

}  // namespace

ErrorMap map_error(EvaluatorPool& pool, const FreeParameters& parameters, const Eigen::VectorXd& u,
                   std::pair<Eigen::Index, Eigen::Index> axes, int count, double reach, RunJournal& journal,
                   const std::function<void(const RunResult&)>& done) {
  if (count < 2) throw InputError(fmt::format("map = {}: must be at least 2", count));
  const auto x = axis_coordinates(parameters, u[axes.first], axes.first, count, reach);
  const auto y = axis_coordinates(parameters, u[axes.second], axes.second, count, reach);
  const auto& names = parameters.names();
  ErrorMap map{names[static_cast<std::size_t>(axes.first)], names[static_cast<std::size_t>(axes.second)], {}, {}, {}};
  for (const double c : x) map.x.push_back(parameters.value(axes.first, c));
  for (const double c : y) map.y.push_back(parameters.value(axes.second, c));
  std::vector<Eigen::VectorXd> runs;
  for (const double second : map.y)
    for (const double first : map.x) {
      Eigen::VectorXd values = parameters.values(u);
      values[axes.first] = first;
      values[axes.second] = second;
      runs.push_back(values);
    }
  map.results = pool.run(runs, journal, done);
  return map;
}

void write_map_csv(const ErrorMap& map, const std::filesystem::path& file) {
  std::ofstream stream(file, std::ios::binary);
  stream << map.x_name << "," << map.y_name << ",mae_study_mm,mae_mm,rms_mm,failed\n";
  for (std::size_t i = 0; i < map.results.size(); ++i) {
    const RunResult& r = map.results[i];
    stream << fmt::format("{},{},", map.x[i % map.x.size()], map.y[i / map.x.size()]);
    stream << (r.failed ? std::string(",,,1\n") : fmt::format("{},{},{},0\n", r.mae_study_mm, r.mae_mm, r.rms_mm));
  }
  if (!stream.flush()) complain(file);
}

void write_map_vti(const ErrorMap& map, const std::filesystem::path& file) {
  const int nx = static_cast<int>(map.x.size()), ny = static_cast<int>(map.y.size());
  vtkNew<vtkImageData> image;
  image->SetDimensions(nx, ny, 1);
  image->SetOrigin(scaled(map.x.front()), scaled(map.y.front()), 0);
  image->SetSpacing((scaled(map.x.back()) - scaled(map.x.front())) / (nx - 1),
                    (scaled(map.y.back()) - scaled(map.y.front())) / (ny - 1), 1);
  vtkNew<vtkDoubleArray> mae, rms;
  mae->SetName("mae_study_mm");
  rms->SetName("rms_mm");
  for (const RunResult& r : map.results) {
    const double none = std::numeric_limits<double>::quiet_NaN();
    mae->InsertNextValue(r.failed ? none : r.mae_study_mm);
    rms->InsertNextValue(r.failed ? none : r.rms_mm);
  }
  image->GetPointData()->SetScalars(mae);
  image->GetPointData()->AddArray(rms);
  if (!std::ofstream(file).is_open()) complain(file);
  vtkNew<vtkXMLImageDataWriter> writer;
  writer->SetFileName(file.c_str());
  writer->SetInputData(image);
  if (writer->Write() != 1 || writer->GetErrorCode() != 0) complain(file);
}

}  // namespace supine::calibration

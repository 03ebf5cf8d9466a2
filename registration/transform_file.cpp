// SPDX-License-Identifier: AGPL-3.0-or-later
#include "registration/transform_file.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>
#include <fstream>
#include <sstream>
#include <vector>

#include "common/error.h"

namespace supine::registration {
namespace {

namespace fs = std::filesystem;
constexpr const char* itk_header = "#Insight Transform File V1.0";

struct Entries {
  std::string kind;
  std::vector<double> parameters, fixed;
};

[[noreturn]] void refuse(const fs::path& file, const std::string& why) {
  throw InputError(fmt::format("{}: {}", file.string(), why));
}

std::vector<double> numbers(const std::string& text, const fs::path& file) {
  std::istringstream stream(text);
  std::vector<double> values;
  std::string word;
  while (stream >> word) {
    std::size_t used = 0;
    double value = std::nan("");
    try {
      value = std::stod(word, &used);
    } catch (const std::exception&) {
      used = 0;
    }
    if (used != word.size() || !std::isfinite(value)) refuse(file, fmt::format("'{}' is not a number", word));
    values.push_back(value);
  }
  return values;
}

Entries read_entries(const fs::path& file) {
  std::ifstream in(file);
  if (!in) refuse(file, "cannot be read");
  std::string line;
  std::getline(in, line);
  if (line.rfind("#Insight Transform File V1", 0) != 0)
    refuse(file, fmt::format("does not begin with '{}', so neither its frame nor its sense is known. Save it as an ITK "
                             "transform (.tfm; 3D Slicer: Save, format ITK transform, text)",
                             itk_header));
  Entries found;
  while (std::getline(in, line)) {
    const auto colon = line.find(':');
    if (line.empty() || line.front() == '#' || colon == std::string::npos) continue;
    const std::string key = line.substr(0, colon), value = line.substr(colon + 1);
    if (key == "Transform") {
      if (!found.kind.empty()) refuse(file, "holds several transforms; harden them to one first");
      found.kind = value.substr(std::min(value.find_first_not_of(' '), value.size()));
      while (!found.kind.empty() && std::isspace(static_cast<unsigned char>(found.kind.back()))) found.kind.pop_back();
    }
    if (key == "Parameters") found.parameters = numbers(value, file);
    if (key == "FixedParameters") found.fixed = numbers(value, file);
  }
  return found;
}

Eigen::Matrix3d matrix_of(const Entries& entries, const fs::path& file) {
  const auto need = [&](std::size_t count) {
    if (entries.parameters.size() != count)
      refuse(file, fmt::format("{} has {} parameters, not {}", entries.kind, entries.parameters.size(), count));
  };
  const std::vector<double>& p = entries.parameters;
  if (entries.kind == "AffineTransform_double_3_3" || entries.kind == "MatrixOffsetTransformBase_double_3_3") {
    need(12);
    return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(p.data());
  }
  if (entries.kind == "Euler3DTransform_double_3_3") {
    need(6);
    const Eigen::Vector3d angle(p[0], p[1], p[2]);
    const Eigen::AngleAxisd x(angle.x(), Eigen::Vector3d::UnitX()), y(angle.y(), Eigen::Vector3d::UnitY()),
        z(angle.z(), Eigen::Vector3d::UnitZ());
    // The fourth fixed parameter is ITK's ComputeZYX.
    const bool zyx = entries.fixed.size() > 3 && entries.fixed[3] != 0;
    return zyx ? (z * y * x).toRotationMatrix() : (z * x * y).toRotationMatrix();
  }
  if (entries.kind == "VersorRigid3DTransform_double_3_3") {
    need(6);
    const Eigen::Vector3d versor(p[0], p[1], p[2]);
    if (versor.norm() > 1) refuse(file, "its versor is longer than 1");
    return Eigen::Quaterniond(std::sqrt(1 - versor.squaredNorm()), p[0], p[1], p[2]).toRotationMatrix();
  }
  refuse(file, fmt::format("holds a '{}'; a rigid one is needed: AffineTransform, Euler3DTransform or "
                           "VersorRigid3DTransform (_double_3_3)",
                           entries.kind));
}

}  // namespace

void write_tfm(const RigidTransform& scan_to_image, const Eigen::Vector3d& centre, const fs::path& file) {
  const RigidTransform out = scan_to_image.inverse();
  const Eigen::Vector3d translation = out.at(centre) - centre;
  std::ofstream stream(file);
  stream << itk_header << "\n"
         << "# LPS, mm. Maps points of the image to points of the scan as given (ITK: fixed image -> moving scan).\n"
         << "# To move the scan onto the image, apply the inverse; 3D Slicer does so when the scan is put under it.\n"
         << "#Transform 0\nTransform: AffineTransform_double_3_3\nParameters:";
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) stream << fmt::format(" {:.17g}", out.rotation(row, column));
  for (const double value : translation) stream << fmt::format(" {:.17g}", value);
  stream << fmt::format("\nFixedParameters: {:.17g} {:.17g} {:.17g}\n", centre.x(), centre.y(), centre.z());
  stream.flush();
  if (!stream) refuse(file, "cannot be written");
}

RigidTransform read_tfm(const fs::path& file) {
  constexpr double tolerance = 1e-3;
  const Entries entries = read_entries(file);
  const Eigen::Matrix3d matrix = matrix_of(entries, file);
  if (entries.fixed.size() < 3) refuse(file, "FixedParameters must hold the centre, three numbers");
  if (matrix.determinant() < 0) refuse(file, "mirrors (determinant < 0); a body is not its mirror image");
  if (const double off = (matrix.transpose() * matrix - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
      off > tolerance)
    refuse(file,
           fmt::format("is not rigid: RᵀR differs from 1 by {:.3g} (bound {:g}); it scales or shears", off, tolerance));
  const Eigen::Vector3d centre(entries.fixed[0], entries.fixed[1], entries.fixed[2]);
  const auto last = entries.parameters.end();
  const Eigen::Vector3d translation(last[-3], last[-2], last[-1]);
  // Twelve digits of a file make the rotation not quite one.
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d rotation = svd.matrixU() * svd.matrixV().transpose();
  return RigidTransform{rotation, translation + centre - rotation * centre}.inverse();
}

}  // namespace supine::registration

// SPDX-License-Identifier: AGPL-3.0-or-later
#include <fmt/ostream.h>

#include <fstream>

#include "common/error.h"
#include "simulation/export/calculix.h"
#include "simulation/export/exported_pose.h"
#include "simulation/export/febio.h"
#include "simulation/export/sofa.h"

namespace supine::simulation {
namespace {

template <class Write>
void write_file(const std::filesystem::path& file, const Write& write) {
  std::ofstream stream(file);
  write(stream);
  stream.close();
  if (!stream)
    throw InputError("writing " + file.string() + " failed; check the folder and the free space on the disk");
}

}  // namespace

void write_export(Solver solver, const ExportedPose& pose, const std::filesystem::path& file) {
  write_file(file, [&](std::ostream& out) {
    if (solver == Solver::calculix) return write_calculix(out, pose);
    if (solver == Solver::febio) return write_febio(out, pose);
    write_sofa(out, pose);
  });
}

void write_displacements(const ExportedPose& pose, const std::filesystem::path& file) {
  write_file(file, [&pose](std::ostream& out) {
    fmt::print(out, "node,ux_mm,uy_mm,uz_mm\n");
    for (int n = 0; n < pose.nodes; ++n) {
      const Eigen::RowVector3d u = pose.answer.row(n) - pose.X.row(n);
      fmt::print(out, "{},{:.9g},{:.9g},{:.9g}\n", n + 1, u[0], u[1], u[2]);
    }
  });
}

}  // namespace supine::simulation

// SPDX-License-Identifier: AGPL-3.0-or-later
// The mesh on which the truth of a case from the priors was solved, in the imaged pose: a diagnosis on it has no error
// of the mesh.
//   bench_phantom_mesh SEED RINGS MESH.vtu
#include <fmt/format.h>

#include <exception>
#include <string>

#include "common/error.h"
#include "meshing/mesh_io.h"
#include "phantom/body_mesh.h"
#include "phantom/phantom.h"
#include "reconstruction/reconstruct.h"

using namespace supine;

int main(int count, char** words) {
  try {
    if (count != 4) throw InputError("bench_phantom_mesh SEED RINGS MESH.vtu");
    phantom::PhantomOptions options;
    options.seed = std::stoull(words[1]);
    options.rings = std::stoi(words[2]);
    options.prior = options.tilt = true;
    const phantom::Phantom phantom = phantom::make_phantom(options);
    meshing::TetMesh mesh = phantom::mesh_body(phantom.body, options.seed, options.rings, options.order).mesh;
    mesh.points = phantom.poses.front().x;
    const reconstruction::Surface skin{mesh.points, mesh.faces.leftCols(3), mesh.region};
    mesh.muscle = reconstruction::reversed_region(skin, reconstruction::Region::inner);
    meshing::write_mesh(mesh, words[3], phantom.body.side);
    fmt::print("{} nodes\n", mesh.points.rows());
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_phantom_mesh: error: {}\n", error.what());
    return 2;
  }
  return 0;
}

// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <memory>

#include "meshing/anatomy.h"
#include "meshing/tet_mesh.h"
#include "simulation/mechanics.h"

namespace supine::testing {

/// A mesh with its anatomy, for tests of the engine.
struct TestScene {
  meshing::TetMesh mesh;
  meshing::Anatomy anatomy;
};

/// The box of box_mesh() with z = 0 on the muscle, its sides cut and its top skin; outward is +z.
TestScene box_scene(int n, const Eigen::Vector3d& size_mm);

/// A small dome on a cylinder-like muscle, sagging along -y when prone. Made once.
const TestScene& dome_scene(int order = 1);

/// Two breasts of one piece over one flat muscle, sagging along -y when prone; the right one is the smaller. Made once.
const TestScene& two_breasts_scene();

/// Two parts, "left" and "right" of the middle in x, and the muscle as a support named "clamp".
void name_parts_and_support(meshing::TetMesh& mesh);

/// A bar along x, from 0 to -length_mm, of a square section of width_mm, quadratic cells, held at x = 0 by the support
/// "clamp"; free of load as imaged; parts as above.
TestScene bar_scene(double length_mm, double width_mm, int along, int across);

/// The same mesh with straight-sided quadratic elements.
meshing::TetMesh quadratic(const meshing::TetMesh& linear);

/// The base model with every term in play and numbers of ordinary size.
simulation::Model soft_model(simulation::BulkLaw law = simulation::BulkLaw::neo_hookean,
                             simulation::SkinLaw skin = simulation::SkinLaw::neo_hookean);

}  // namespace supine::testing

// SPDX-License-Identifier: AGPL-3.0-or-later
#include "diagnosis/evidence/patchiness.h"

#include <memory>

#include "diagnosis/evidence/field_modes.h"
#include "meshing/topology.h"

namespace supine::diagnosis {
namespace {

using simulation::Dual;
using simulation::Fields;
using simulation::PoseLoad;

constexpr int most_on_surfaces = 40;  // shapes of what varies over skin or muscle alone

Eigen::MatrixXd tissue_fields(const meshing::TetMesh& mesh, const Patchiness& size) {
  Eigen::VectorXd volume(mesh.cells.rows());
  for (Eigen::Index c = 0; c < volume.size(); ++c) volume[c] = meshing::cell_volume_mm3(mesh.points, mesh.cells, c);
  return size.tissue * without(Eigen::VectorXd::Ones(volume.size()), volume,
                               field_modes(middles(mesh.points, mesh.cells, 4), size.tissue_length_mm));
}

Eigen::MatrixXd skin_fields(const meshing::TetMesh& mesh, const simulation::Layout& layout, const Patchiness& size) {
  const Indices faces = mesh.faces(layout.skin.faces, Eigen::all);
  return size.skin * without(Eigen::VectorXd::Ones(faces.rows()), layout.skin.area_mm2,
                             field_modes(middles(mesh.points, faces, 3), size.skin_length_mm, most_on_surfaces));
}

/// Over the quadrature points of the interface; places along the muscle are those of anatomy coordinates.
Eigen::MatrixXd muscle_fields(const meshing::Anatomy& anatomy, const simulation::Layout& layout,
                              const Patchiness& size) {
  const simulation::FaceGroup& group = layout.interface;
  Points places = Points::Zero(group.q.rows(), 3);
  Eigen::VectorXd hill(group.q.rows());
  for (Eigen::Index p = 0; p < group.q.rows(); ++p) {
    constexpr double far_apart_mm = 1e4;  // two breasts share nothing
    places.row(p).head<2>() = anatomy.breast_frame(group.breast[p]).foot_radius_mm * group.q.row(p);
    places(p, 2) = far_apart_mm * group.breast[p];
    const double rest = std::max(0.0, 1 - group.q.row(p).squaredNorm());
    hill[p] = rest * rest * rest;
  }
  return size.muscle_mm * without(hill, group.area_mm2, field_modes(places, size.muscle_length_mm, most_on_surfaces));
}

}  // namespace

PatchyFields patchy_fields(const simulation::Mechanics& mechanics, const Patchiness& size) {
  return {tissue_fields(mechanics.mesh(), size), skin_fields(mechanics.mesh(), mechanics.layout(), size),
          muscle_fields(mechanics.anatomy(), mechanics.layout(), size)};
}

std::vector<simulation::Sensitivities::FieldDirection> patchy_directions(const simulation::Chain& chain,
                                                                         const Patchiness& size) {
  const auto fields = std::make_shared<const PatchyFields>(patchy_fields(chain.mechanics(), size));
  std::vector<simulation::Sensitivities::FieldDirection> all;
  for (Eigen::Index k = 0; k < fields->tissue.cols(); ++k)
    all.emplace_back([fields, k](const PoseLoad&, Fields<Dual>& f) {
      for (Eigen::Index c = 0; c < f.ln_young.size(); ++c) f.ln_young[c].v[0] = fields->tissue(c, k);
    });
  for (Eigen::Index k = 0; k < fields->skin.cols(); ++k)
    all.emplace_back([fields, k](const PoseLoad&, Fields<Dual>& f) {
      for (Eigen::Index c = 0; c < f.skin_modulus.size(); ++c)
        f.skin_modulus[c].v[0] = f.skin_modulus[c].a * fields->skin(c, k);
    });
  for (Eigen::Index k = 0; k < fields->muscle.cols(); ++k)
    all.emplace_back([fields, k, &chain](const PoseLoad& pose, Fields<Dual>& f) {
      if (pose.name == chain.poses()[0].name) return;
      for (Eigen::Index c = 0; c < f.muscle_offset.size(); ++c) f.muscle_offset[c].v[0] = fields->muscle(c, k);
    });
  return all;
}

Eigen::MatrixXd patchiness_shapes(const simulation::Chain& chain, const simulation::Sensitivities& sensitivities,
                                  const calibration::Prediction& prediction, const calibration::Residuals& residuals,
                                  const Patchiness& size) {
  const auto directions = patchy_directions(chain, size);
  Eigen::MatrixXd shapes(residuals.size(), static_cast<Eigen::Index>(directions.size()));
  const std::vector<simulation::ChainDerivative> moved = sensitivities.along(directions);
  for (std::size_t k = 0; k < directions.size(); ++k)
    shapes.col(static_cast<Eigen::Index>(k)) = distance_change(prediction, residuals, moved[k].poses);
  return shapes;
}

}  // namespace supine::diagnosis

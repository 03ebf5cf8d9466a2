// SPDX-License-Identifier: AGPL-3.0-or-later
#include "phantom/nuisances.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "meshing/topology.h"
#include "phantom/causes/cause_kind.h"
#include "phantom/random.h"
#include "segmentation/tissue.h"

namespace supine::phantom {
namespace {

using FieldSize = Nuisances::FieldSize;
constexpr double degree = std::numbers::pi / 180;
constexpr FieldSize tissue{0.25, 20};                              // of ln E
constexpr FieldSize skin{0.15, 25};                                // of the ln of the skin's stiffness
constexpr FieldSize muscle{0.7, 30};                               // mm
constexpr FieldSize scan_realistic{0.4, 25}, scan_prior{0.2, 25};  // mm
constexpr double wide_share = 0.1, wide = 3;
constexpr double least_stiffening = 0.08, most_stiffening = 0.3;
constexpr double far_sigmas = 3;

double drawn(const NuisanceRow& row, double width, Random random) {
  double value = 0;
  do value = width * row.sigma * random.normal();
  while (value < row.lower);
  return value;
}

// A hill under the mound that ends at the foot.
double mound(const Eigen::Vector2d& q) {
  const double rest = 1 - q.squaredNorm();
  return rest > 0 ? rest * rest * rest : 0;
}

Points centres(const Points& points, const Indices& nodes, int corners) {
  Points middle = Points::Zero(nodes.rows(), 3);
  for (Eigen::Index e = 0; e < nodes.rows(); ++e)
    for (int a = 0; a < corners; ++a) middle.row(e) += points.row(nodes(e, a)) / corners;
  return middle;
}

// Less its projection on the shape.
Eigen::VectorXd without(const Eigen::VectorXd& shape, const Eigen::VectorXd& weight, Eigen::VectorXd values) {
  const Eigen::VectorXd weighted = weight.cwiseProduct(shape);
  values -= weighted.dot(values) / weighted.dot(shape) * shape;
  return values;
}

Eigen::VectorXd patchy_tissue(std::uint64_t seed, const meshing::TetMesh& mesh) {
  Eigen::VectorXd volume(mesh.cells.rows());
  for (Eigen::Index c = 0; c < volume.size(); ++c) volume[c] = meshing::cell_volume_mm3(mesh.points, mesh.cells, c);
  const RandomField field(seed, "patchy tissue", tissue.sd, tissue.length_mm);
  return without(Eigen::VectorXd::Ones(volume.size()), volume, field.over(centres(mesh.points, mesh.cells, 4)));
}

Eigen::VectorXd patchy_skin(std::uint64_t seed, const Stage& stage) {
  const Indices faces = stage.mesh.faces(stage.layout.skin.faces, Eigen::all);
  const RandomField field(seed, "patchy skin", skin.sd, skin.length_mm);
  return without(Eigen::VectorXd::Ones(faces.rows()), stage.layout.skin.area_mm2,
                 field.over(centres(stage.mesh.points, faces, 3)));
}

Eigen::VectorXd moved_muscle(std::uint64_t seed, double breath_mm, const Stage& stage) {
  const Table& q = stage.layout.interface.q;
  Points places = Points::Zero(q.rows(), 3);
  places.leftCols<2>() = stage.body.foot_radius_mm * q;
  Eigen::VectorXd breath(q.rows());
  for (Eigen::Index p = 0; p < q.rows(); ++p) breath[p] = mound(q.row(p).transpose());
  const RandomField field(seed, "muscle elsewhere", muscle.sd, muscle.length_mm);
  return without(breath, stage.layout.interface.area_mm2, field.over(places)) + breath_mm * breath;
}

}  // namespace

const std::vector<NuisanceRow>& nuisance_rows() {
  static const std::vector<NuisanceRow> rows = {// ln of (0.5 - 0.45) / (0.5 - ν); ν stays above 0.1.
                                                {"log_incompressibility", 0.3, false, -2},
                                                {"log_gland_ratio", 0.3, false},
                                                {"log_tangential", std::numbers::ln2, false},
                                                {"log_normal", std::numbers::ln2, false},
                                                {"log_cut", std::numbers::ln2, false},
                                                {"imaged_skin_mm", 0.3, false},
                                                {"gravity_roll_rad", 2 * degree, true},
                                                {"gravity_pitch_rad", 2 * degree, true},
                                                {"breath_mm", 1, true},
                                                {"shift_x_mm", 2, true},
                                                {"shift_y_mm", 2, true},
                                                {"shift_z_mm", 2, true},
                                                {"turn_x_rad", 1.5 * degree, true},
                                                {"turn_y_rad", 1.5 * degree, true},
                                                {"turn_z_rad", 1.5 * degree, true}};
  return rows;
}

Nuisances::Nuisances(std::uint64_t seed, Kind kind, const std::vector<Cause>& causes,
                     const std::vector<std::string>& poses)
    : seed_(seed), kind_(kind), width_(1) {
  if (kind == Kind::realistic) {
    if (Random(seed, "width").uniform() < wide_share) width_ = wide;
    numbers_["stiffening_exponent"] = Random(seed, "mild stiffening").log_uniform(least_stiffening, most_stiffening);
  }
  for (const NuisanceRow& row : nuisance_rows()) {
    if (!row.of_pose) numbers_[row.name] = drawn(row, width_, {seed, "nuisance " + row.name});
    for (const std::string& pose : poses)
      if (row.of_pose) of_pose_[pose][row.name] = drawn(row, width_, {seed, "nuisance " + row.name + " " + pose});
  }
  for (const Cause& cause : causes)
    for (const auto& [parameter, nuisance] : cause_kind(cause.name).nuisance)
      if (numbers_.contains(nuisance)) numbers_[nuisance] = 0;
}

void Nuisances::change(simulation::Model& model) const {
  double& poisson = model.breast.poisson_ratio.value;
  poisson = 0.5 - (0.5 - poisson) * std::exp(-numbers_.at("log_incompressibility"));
  model.interface.tangential_kpa_per_mm.value *= std::exp(numbers_.at("log_tangential"));
  model.interface.normal_kpa_per_mm.value *= std::exp(numbers_.at("log_normal"));
  model.cut.stiffness_kpa_per_mm.value *= std::exp(numbers_.at("log_cut"));
}

void Nuisances::apply(const Stage& stage, simulation::Fields<double>& fields) const {
  fields.ln_young +=
      patchy_tissue(seed_, stage.mesh) +
      numbers_.at("log_gland_ratio") * stage.mesh.fraction.col(static_cast<int>(segmentation::Tissue::gland));
  fields.skin_modulus.array() *= patchy_skin(seed_, stage).array().exp();
  if (kind_ == Kind::realistic) fields.stiffening.array() += numbers_.at("stiffening_exponent");
  if (stage.pose == "prone") return;
  const auto& own = of_pose_.at(stage.pose);
  fields.muscle_offset += moved_muscle(seed_, own.at("breath_mm"), stage);
  const Eigen::Vector3d g = fields.gravity;
  fields.gravity = Eigen::AngleAxisd(own.at("gravity_roll_rad"), Eigen::Vector3d::UnitZ()) *
                   (Eigen::AngleAxisd(own.at("gravity_pitch_rad"), Eigen::Vector3d::UnitX()) * g);
}

Placement Nuisances::placement(const std::string& pose) const {
  const auto& own = of_pose_.at(pose);
  return {{own.at("shift_x_mm"), own.at("shift_y_mm"), own.at("shift_z_mm")},
          {own.at("turn_x_rad"), own.at("turn_y_rad"), own.at("turn_z_rad")}};
}

RandomField Nuisances::scan_error(const std::string& pose) const {
  const FieldSize size = field_sizes().at("scan_mm");
  return {seed_, "scan error " + pose, size.sd, size.length_mm};
}

std::vector<std::string> Nuisances::look_like() const {
  std::vector<std::string> found;
  if (kind_ != Kind::realistic) return found;
  const auto far = [](const auto& numbers, const CauseKind& kind, const auto& sigma) {
    double squares = 0;
    for (const auto& [parameter, nuisance] : kind.nuisance)
      if (const auto number = numbers.find(nuisance); number != numbers.end())
        squares += std::pow(number->second / sigma.at(parameter), 2);
    return squares > far_sigmas * far_sigmas;
  };
  for (const std::string& name : catalogue_causes()) {
    const CauseKind& kind = cause_kind(name);
    const auto sigma = nuisance_sigma(name);
    bool like = name == "strain_stiffening";
    if (width_ > 1) like = like || far(numbers_, kind, sigma);
    for (const auto& [pose, numbers] : of_pose_)
      if (width_ > 1) like = like || far(numbers, kind, sigma);
    if (like) found.push_back(name);
  }
  return found;
}

std::map<std::string, FieldSize> Nuisances::field_sizes() const {
  return {{"log_tissue", tissue},
          {"log_skin", skin},
          {"muscle_mm", muscle},
          {"scan_mm", kind_ == Kind::realistic ? scan_realistic : scan_prior}};
}

std::map<std::string, double> nuisance_sigma(const std::string& cause) {
  std::map<std::string, double> sigma;
  for (const auto& [parameter, nuisance] : cause_kind(cause).nuisance) {
    const auto& rows = nuisance_rows();
    const auto row =
        std::find_if(rows.begin(), rows.end(), [&name = nuisance](const NuisanceRow& r) { return r.name == name; });
    sigma[parameter] = row->sigma;
  }
  return sigma;
}

}  // namespace supine::phantom

// SPDX-License-Identifier: AGPL-3.0-or-later
#include "pipeline/report/shapes.h"

#include <fmt/core.h>

#include <algorithm>
#include <limits>
#include <map>
#include <optional>

#include "calibration/model_skin.h"
#include "common/landmarks.h"
#include "meshing/mesh_io.h"
#include "pipeline/report/encode.h"
#include "pipeline/report/polydata.h"
#include "reconstruction/surface_io.h"
#include "segmentation/tissue.h"
#include "simulation/embedding.h"

namespace supine::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// Two files of one prediction agree to the rounding of their numbers.
constexpr double same_place_mm = 1e-3;

constexpr int no_area = 255;

Points rows_of(const Points& points, const std::vector<int>& rows) {
  Points picked(static_cast<Eigen::Index>(rows.size()), 3);
  for (std::size_t i = 0; i < rows.size(); ++i) picked.row(static_cast<Eigen::Index>(i)) = points.row(rows[i]);
  return picked;
}

/// Triangles of linear or quadratic faces; region of each.
std::pair<Triangles, Eigen::VectorXi> flat_triangles(const meshing::TetMesh& mesh) {
  static constexpr int parts[4][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}};
  const int per_face = mesh.faces.cols() == 6 ? 4 : 1;
  Triangles triangles(per_face * mesh.faces.rows(), 3);
  Eigen::VectorXi region(triangles.rows());
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    for (int p = 0; p < per_face; ++p) {
      for (int k = 0; k < 3; ++k) triangles(per_face * f + p, k) = mesh.faces(f, per_face == 1 ? k : parts[p][k]);
      region[per_face * f + p] = mesh.region[f];
    }
  return {triangles, region};
}

/// A surface that moves along with the tissue.
struct Organ {
  std::string name;
  Triangles triangles;
  simulation::Embedding embedding;
};

/// Gathers the shapes of one case.
class Gatherer {
 public:
  Gatherer(Run& run, const Case& measured, const fs::path& out, const ShapeLimits& limits)
      : run_(run), case_(measured), out_(out), limits_(limits), mesh_(meshing::read_mesh(run.input(out / "mesh.vtu"))) {
    std::tie(triangles_, region_) = flat_triangles(mesh_);
    const auto corners = triangles_.reshaped();
    nodes_.assign(corners.begin(), corners.end());
    std::sort(nodes_.begin(), nodes_.end());
    nodes_.erase(std::unique(nodes_.begin(), nodes_.end()), nodes_.end());
    row_.assign(static_cast<std::size_t>(mesh_.points.rows()), -1);
    for (std::size_t i = 0; i < nodes_.size(); ++i) row_[nodes_[i]] = static_cast<int>(i);
    for (int& corner : triangles_.reshaped()) corner = row_[corner];
    read_organs();
    if (measured.prone_landmarks) {
      const Landmarks marks = read_landmarks(run.input(*measured.prone_landmarks), measured.frame);
      landmark_names_ = marks.names;
      landmarks_.emplace(mesh_, marks.points);
    }
  }

  Json gather(const std::vector<ModelState>& states) {
    Json all;
    all["body"] = {{"triangles", base64_indices(triangles_)}, {"region", base64_bytes(region_)}};
    all["organs"] = Json::array();
    for (const Organ& organ : organs_)
      all["organs"].push_back({{"name", organ.name}, {"triangles", base64_indices(organ.triangles)}});
    all["muscle"] = muscle();
    all["prone"] = shape(mesh_.points);
    all["measured_landmarks"] = measured_landmarks();
    all["states"] = Json::array();
    for (const ModelState& state : states)
      if (Json entry = state_json(state); !entry.is_null()) all["states"].push_back(std::move(entry));
    all["scans"] = scans_;
    return all;
  }

 private:
  void read_organs() {
    for (int tissue = 0; tissue < segmentation::tissue_count; ++tissue) {
      const std::string name(segmentation::tissue_names[tissue]);
      const fs::path file = out_ / (name + ".vtp");
      // A surface of a tissue the mesh does not have is left over from other labels.
      if (name == "muscle" || mesh_.fraction.col(tissue).sum() == 0 || !fs::exists(file)) continue;
      const auto surface = reconstruction::read_surface(run_.input(file));
      const Thinned thin = thin_out(surface.points, surface.triangles, limits_.organ_triangles);
      organs_.push_back({name, thin.triangles, simulation::Embedding(mesh_, rows_of(surface.points, thin.points))});
    }
  }

  Json muscle() const {
    const Thinned thin = thin_out(mesh_.muscle.points, mesh_.muscle.triangles, limits_.muscle_triangles);
    return {{"points", base64_floats(rows_of(mesh_.muscle.points, thin.points))},
            {"triangles", base64_indices(thin.triangles)}};
  }

  static Json landmarks_json(const std::vector<std::string>& names, const Points& points) {
    return {{"names", names}, {"points", base64_floats(points)}};
  }

  Json measured_landmarks() const {
    Json all = Json::object();
    for (const Pose& pose : case_.poses) {
      if (!pose.landmarks) continue;
      const Landmarks marks = read_landmarks(run_.input(*pose.landmarks), case_.frame);
      all[pose.name] = landmarks_json(marks.names, marks.points);
    }
    return all;
  }

  Json shape(const Points& positions) const {
    Json entry;
    entry["body"] = base64_floats(rows_of(positions, nodes_));
    entry["organs"] = Json::object();
    for (const Organ& organ : organs_) entry["organs"][organ.name] = base64_floats(organ.embedding.at(positions));
    if (landmarks_) entry["landmarks"] = landmarks_json(landmark_names_, landmarks_->at(positions));
    return entry;
  }

  /// The positions of a pose file; nothing, with a warning, when it is of another mesh.
  std::optional<Points> positions(const fs::path& file) {
    const meshing::PoseMesh pose = meshing::read_pose(run_.input(file), file.stem().string());
    const bool same = pose.mesh.points.rows() == mesh_.points.rows() && pose.mesh.faces.rows() == mesh_.faces.rows() &&
                      (pose.mesh.points - mesh_.points).cwiseAbs().maxCoeff() < same_place_mm;
    if (same) return pose.positions;
    run_.warn(fmt::format("{} belongs to another mesh than {} and is left out; simulate again", file.string(),
                          (out_ / "mesh.vtu").string()));
    return {};
  }

  Json state_json(const ModelState& state) {
    const auto undeformed = positions(state.folder / "undeformed.vtu");
    if (!undeformed) return nullptr;
    Json entry = {{"id", state.id}, {"label", state.label}, {"undeformed", shape(*undeformed)}};
    entry["poses"] = Json::object();
    for (const Pose& pose : case_.poses) {
      const fs::path file = state.folder / (pose.name + ".vtu");
      if (pose.name == case_.imaged_pose || !fs::exists(file)) continue;
      const auto x = positions(file);
      if (!x) continue;
      entry["poses"][pose.name] = shape(*x);
      add_comparison(entry["poses"][pose.name], state.folder, pose.name, *x);
    }
    return entry["poses"].empty() ? Json(nullptr) : entry;
  }

  void add_comparison(Json& entry, const fs::path& folder, const std::string& pose, const Points& x) {
    const std::string end = pose == "supine" ? ".vtp" : "_" + pose + ".vtp";
    const fs::path skin_file = folder / ("comparison" + end), scan_file = folder / ("scan" + end);
    if (!fs::exists(skin_file) || !fs::exists(scan_file)) return;
    const PolyData skin = read_polydata(run_.input(skin_file));
    const calibration::ModelSkin model(mesh_, x);
    const Points places = model.node_points();
    if (skin.points.rows() != places.rows() || (skin.points - places).cwiseAbs().maxCoeff() > same_place_mm) {
      run_.warn(fmt::format("{} compares another prediction than {} and is left out; compare again", skin_file.string(),
                            (folder / (pose + ".vtu")).string()));
      return;
    }
    const Eigen::VectorXd &distance = skin.array("distance_mm", skin_file), &covered = skin.array("covered", skin_file);
    Eigen::VectorXd of_body =
        Eigen::VectorXd::Constant(static_cast<Eigen::Index>(nodes_.size()), std::numeric_limits<double>::quiet_NaN());
    for (std::size_t i = 0; i < model.nodes().size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      if (covered[k] != 0) of_body[row_[model.nodes()[i]]] = distance[k];
    }
    entry["distance_mm"] = base64_values(of_body);
    if (const auto area = skin.point_arrays.find("area"); area != skin.point_arrays.end()) {
      Eigen::VectorXi rows = Eigen::VectorXi::Constant(of_body.size(), no_area);
      for (std::size_t i = 0; i < model.nodes().size(); ++i)
        rows[row_[model.nodes()[i]]] = static_cast<int>(area->second[static_cast<Eigen::Index>(i)]);
      entry["area"] = base64_bytes(rows);
    }
    add_scan(entry, pose, scan_file);
  }

  void add_scan(Json& entry, const std::string& pose, const fs::path& file) {
    const PolyData scan = read_polydata(run_.input(file));
    const auto [known, is_new] = thinned_.try_emplace(pose);
    Scan& shown = known->second;
    // A model with the effect misregistration moves the scan; otherwise all states share it.
    if (is_new || shown.of.rows() != scan.points.rows() || shown.of != scan.points) {
      shown.thin = thin_out(scan.points, scan.triangles, limits_.scan_triangles);
      shown.of = scan.points;
      shown.row = scans_.size();
      scans_.push_back({{"pose", pose},
                        {"points", base64_floats(rows_of(scan.points, shown.thin.points))},
                        {"triangles", base64_indices(shown.thin.triangles)}});
    }
    const Eigen::VectorXd &distance = scan.array("distance_mm", file), &used = scan.array("used", file);
    Eigen::VectorXd kept(static_cast<Eigen::Index>(shown.thin.points.size()));
    for (std::size_t i = 0; i < shown.thin.points.size(); ++i) {
      const int k = shown.thin.points[i];
      kept[static_cast<Eigen::Index>(i)] = used[k] != 0 ? distance[k] : std::numeric_limits<double>::quiet_NaN();
    }
    entry["scan"] = shown.row;
    entry["scan_distance_mm"] = base64_values(kept);
  }

  struct Scan {
    Points of;
    Thinned thin;
    std::size_t row = 0;
  };

  Run& run_;
  const Case& case_;
  const fs::path& out_;
  const ShapeLimits& limits_;
  meshing::TetMesh mesh_;
  Triangles triangles_;  // of the boundary, rows of nodes_
  Eigen::VectorXi region_;
  std::vector<int> nodes_, row_;  // boundary points of the mesh, and back
  std::vector<Organ> organs_;
  std::vector<std::string> landmark_names_;
  std::optional<simulation::Embedding> landmarks_;
  std::map<std::string, Scan> thinned_;
  Json scans_ = Json::array();
};

}  // namespace

std::vector<ModelState> find_states(const fs::path& out, const Json& ladder) {
  std::vector<ModelState> states = {{"given", "as given", out}, {"calibrated", "calibrated", out / "calibrated"}};
  if (ladder.is_object() && ladder.contains("rungs"))
    for (std::size_t r = 1; r < ladder["rungs"].size(); ++r)
      states.push_back({fmt::format("rung_{}", r), "+ " + ladder["rungs"][r].value("added", std::string("?")),
                        out / "ladder" / std::to_string(r)});
  std::erase_if(states, [](const ModelState& state) { return !fs::exists(state.folder / "undeformed.vtu"); });
  return states;
}

Json shapes_json(Run& run, const Case& measured, const fs::path& out, const std::vector<ModelState>& states,
                 const ShapeLimits& limits) {
  if (!fs::exists(out / "mesh.vtu")) return nullptr;
  return Gatherer(run, measured, out, limits).gather(states);
}

}  // namespace supine::pipeline

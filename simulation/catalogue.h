// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <ceres/jet.h>

#include <map>
#include <span>
#include <string>
#include <vector>

#include "simulation/base_parameters.h"
#include "simulation/parameter.h"

namespace supine::meshing {
struct Anatomy;
struct TetMesh;
}  // namespace supine::meshing

namespace supine::simulation {

/// A value and its derivative with respect to the one parameter that is being varied.
using Dual = ceres::Jet<double, 1>;

template <class T>
struct Fields;

/// A non-numeric choice of an effect in model.toml.
struct OptionRow {
  std::string name;
  std::string default_value;
  std::vector<std::string> values;  ///< what may be written
  std::string meaning;
};

struct Layout;

/// What an effect may look at when it sets fields.
struct Scene {
  const meshing::TetMesh& mesh;  ///< imaged
  const meshing::Anatomy& anatomy;
  const Layout& layout;  ///< where the fields live
  std::string pose;      ///< prone, supine, …
};

/// A catalogue entry: a few parameters that change fields of the mechanical terms.
/// At the null values of all its parameters an effect leaves every field bit for bit as it was.
class Effect {
 public:
  virtual ~Effect() = default;
  virtual std::string name() const = 0;
  virtual std::string meaning() const = 0;
  virtual const std::vector<Parameter>& parameters() const = 0;
  virtual const std::vector<OptionRow>& options() const;
  /// Whether it acts in prone or in the other poses only, so that with prone alone it means nothing.
  virtual bool needs_other_pose() const { return false; }
  /// @param values   one per row of parameters()
  /// @param options  every option of options(), by name
  virtual void apply(const Scene& scene, std::span<const Dual> values,
                     const std::map<std::string, std::string>& options, Fields<Dual>& fields) const = 0;
};

/// The catalogue, in the order in which effects act and tables list them: what multiplies a stiffness of the base model
/// (adhesion) comes before what adds to it (ligament).
const std::vector<const Effect*>& catalogue();

/// Adds an effect of one's own at the end, for a source file that is linked to a tool:
///   const MyEffect mine;  const bool known = supine::simulation::add_to_catalogue(mine);
/// Before main() or at its beginning; @p effect must live as long as the program. @return true
/// @throws InputError  the name is taken
bool add_to_catalogue(const Effect& effect);

/// @return nullptr for an unknown name
const Effect* find_effect(const std::string& name);

}  // namespace supine::simulation

// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <ceres/jet.h>

#include <map>
#include <span>
#include <string>
#include <vector>

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
struct Model;

/// What an effect may look at when it sets fields.
struct Scene {
  const meshing::TetMesh& mesh;  ///< imaged
  const meshing::Anatomy& anatomy;
  const Layout& layout;  ///< where the fields live
  std::string pose;      ///< prone, supine, …
  /// Of each named support: whether it is held by springs that do not let it slide (is_tied()); make_fields() fills it.
  std::vector<bool> tied_supports = {};
  bool is_imaged() const;  ///< whether that is the pose the mesh was imaged in
};

/// What an effect is a cause of. Measurement and numerical causes come before the others where several do equally well.
enum class EffectKind { tissue, boundary, measurement, numerical };

/// In which poses an effect acts.
enum class ActsIn { every_pose, all_but_imaged, imaged_only };

/// What an effect says of itself: nothing else knows effects by name.
struct EffectTraits {
  EffectKind kind = EffectKind::tissue;
  ActsIn acts_in = ActsIn::every_pose;
  /// It says that a scan and its landmarks lie elsewhere (Fields::scan_motion), each scan in its own way: it moves no
  /// shape that is simulated, and says nothing of where another scan lies.
  bool moves_scan = false;
  /// The error of every measurement that looks like this effect, by its name in budgets; empty: there is none.
  std::string error_source = {};
  bool breast_only = false;         ///< it is about anatomy that an object does not have
  bool error_of_each_scan = false;  ///< that error is another one in each scan: its place, the breath it was taken at
};

/// How well things are known that no effect should be blamed for.
struct MeasurementTolerances {
  double registration_mm = 2;        ///< shift of each scan, 1 sigma in each direction
  double registration_rad = 0.0262;  ///< turn of each scan: 1.5°
  double gravity_rad = 0.0349;       ///< direction of gravity in each pose but the imaged one: 2°
  double segmentation_mm = 0.3;      ///< offset of the imaged skin: a fifth of a 1.5 mm voxel
  double chest_wall_mm = 1;          ///< the muscle between two scans: breath, and where its border was drawn
  double incompressibility = 0.3;    ///< of a in ν = 0.5 - (0.5 - ν₀) e^{-a}: ν itself is assumed
  double gland_log = 0.3;            ///< of the ln of the gland's stiffness over that of the rest
  double spring_log = 0.693;         ///< of the ln of the springs' stiffness under muscle and cut: a factor of 2
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
  virtual EffectTraits traits() const { return {}; }
  /// Whether the body, and how the model holds it, has what the effect is about (breasts, named parts, supports that do
  /// not slide); where it has not, the effect is no candidate and nobody is told of it.
  virtual bool belongs_to(const meshing::TetMesh& mesh, const meshing::Anatomy& anatomy, const Model& model) const;
  /// How well the measurement is known in what this effect stands for, 1 sigma, in the unit of the parameters that have
  /// @p unit (empty: of its strength); 0 where errors of the measurement do not look like it.
  virtual double tolerance([[maybe_unused]] const std::string& unit,
                           [[maybe_unused]] const MeasurementTolerances& known) const {
    return 0;
  }
  /// @param values   one per row of parameters()
  /// @param options  every option of options(), by name
  virtual void apply(const Scene& scene, std::span<const Dual> values,
                     const std::map<std::string, std::string>& options, Fields<Dual>& fields) const = 0;
};

}  // namespace supine::simulation

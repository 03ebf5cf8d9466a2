// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "segmentation/chest/chest_wall.h"
#include "segmentation/gland/gland.h"
#include "segmentation/tissue.h"

namespace supine::segmentation {

// A recipe turns a grey volume into a label map by a list of small steps, run in order. The state they share:
// the grey volume, masks (sets of voxels) with names of the user's choice, and the label map, which starts as air.
// Points are mm, LPS. Greys are in the unit the volume has at that step: the file's, until Bias makes them per cent.
// An empty `within` means the whole image.

/// Grey values from lower to upper, both included.
struct GreyRange {
  float lower = -std::numeric_limits<float>::infinity();
  float upper = std::numeric_limits<float>::infinity();
  bool contains(float grey) const { return grey >= lower && grey <= upper; }
};

/// Removes the noise floor of a magnitude image: grey = sqrt(max(grey^2 - 2 sigma^2, 0)) (Rician second moment).
/// Sigma is estimated from the air: median of the greys below `air_below` / sqrt(2 ln 2) (Rayleigh).
struct NoiseFloor {
  float air_below = 0;  ///< the file's greys; 0 = the lowest of the levels that part the greys into four classes (Otsu)
};

/// Divides out the coil's shading: exp of a polynomial in the coordinates, fitted to ln(grey) of one tissue
/// (fat) with outliers beyond 2.5 sigma dropped. Afterwards that tissue has the grey `level`.
struct Bias {
  GreyRange tissue;      ///< candidates, mostly of that tissue; unbounded without `within` = the upper of two classes
                         ///< (Otsu) of what is brighter than the air
  int degree = 2;        ///< total degree, 0 to 4
  float level = 100;     ///< > 0
  std::string within{};  ///< candidates lie in this mask
  double local_mm = 0;   ///< then also divides by the tissue's local mean (Gaussian of this sd); 0 = not
};

/// Smooths the grey volume.
struct Smooth {
  enum class Kind { median, gaussian };
  Kind kind = Kind::median;
  double radius_mm = 0;  ///< > 0; median: half width of the window; gaussian: standard deviation
};

/// mask = voxels of `within` whose grey lies in `grey`.
struct Threshold {
  std::string mask;
  GreyRange grey;
  std::string within;
};

/// mask = what is reached from the seeds through faces, over voxels of `within` whose grey lies in `grey`.
/// With `confidence`, the range is mean +- multiplier x standard deviation of the region, started from the greys
/// within `radius_mm` of the seeds and renewed `iterations` times; `grey` then only bounds it.
struct Grow {
  struct Confidence {
    double multiplier = 2.5;  ///< > 0
    int iterations = 3;       ///< 0 to 50
    double radius_mm = 3;     ///< > 0
  };
  std::string mask;
  std::vector<Eigen::Vector3d> seeds_mm;  ///< at least one, each inside the image and its range
  GreyRange grey;
  std::optional<Confidence> confidence;
  std::string within;
};

/// mask = some of the classes that part the greys of `within` with least variance inside them (N. Otsu 1979).
struct Otsu {
  std::string mask;
  int classes = 2;  ///< 2 to 8, numbered from 1 (darkest)
  int first = 2;    ///< the mask is the classes from first to last
  int last = 2;
  std::string within;
};

/// mask = what a front from the seeds reaches (fast marching). It moves a mm of way in a mm of time where nothing holds
/// it back, and slower at edges or where the grey is not the tissue's.
struct March {
  enum class Speed { gradient, greys };
  std::string mask;
  std::vector<Eigen::Vector3d> seeds_mm;  ///< at least one, each inside the image and where the speed is not 0
  Speed speed = Speed::gradient;
  double sigma_mm = 1;      ///< gradient: of the Gaussian before it; >= 0
  double half_per_mm = 0;   ///< gradient (grey per mm) at which the speed is a half; > 0
  double mean = 0, sd = 0;  ///< greys: speed exp(-(g - mean)^2 / (2 sd^2)); sd > 0
  double stop_mm = 0;       ///< the front stands still when it would have come so far at full speed; > 0
  int order = 2;            ///< 1 or 2
  std::string within;       ///< the front does not leave this mask
};

/// Keeps the `keep_largest` largest components of the mask (0 = any number), and of those the ones of at least min_ml.
struct Islands {
  std::string mask;
  int keep_largest = 0;
  double min_ml = 0;
};

/// Fills holes of the mask: components of its complement that do not touch the edge of the image, up to max_ml.
struct Holes {
  std::string mask;
  double max_ml = std::numeric_limits<double>::infinity();
};

/// mask = (union of `any`, or the whole image when empty) without the union of `without`.
struct Combine {
  std::string mask;
  std::vector<std::string> any;
  std::vector<std::string> without;
};

/// Changes a mask by distances between voxel centres: grow, shrink, open (shrink, then grow), close (grow, then
/// shrink).
struct Morph {
  enum class Kind { dilate, erode, open, close };
  std::string mask;
  Kind kind = Kind::close;
  double radius_mm = 0;  ///< > 0
};

/// mask = voxels of `of` whose centre lies within thickness_mm of the centre of a voxel outside `of`.
/// The outside of the image does not count. A thickness below the finest voxel side counts as that side.
struct Layer {
  std::string mask;
  std::string of;
  double thickness_mm = 0;  ///< > 0
};

/// mask = voxels whose centre lies inside a solid.
struct Region {
  enum class Shape { cylinder, sphere, box, halfspace };
  std::string mask;
  Shape shape = Shape::cylinder;
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();  ///< of sphere, box; a point of the axis, of the plane
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();      ///< cylinder: its axis; halfspace: towards the inside; not zero
  Eigen::Vector3d half_mm = Eigen::Vector3d::Zero();    ///< box: half its sides along x, y, z; > 0
  double radius_mm = 0;                                 ///< cylinder, sphere; > 0
};

/// mask = the body: what the air in front (-y) does not reach. Body is what is at least `lower` bright, and everything
/// that the bright shell closes off from the air.
struct Body {
  std::string mask;
  float lower = 0;     ///< half of the fat's grey: a voxel half full; 0 = half the median of what is no air (Otsu)
  float air = 0;       ///< greys below are surely air, 0 < air <= lower; 0 = half of lower
  double peel_mm = 4;  ///< darker than `lower` counts as air only this near to what is surely air
  /// Where the skin is bright or its edge is blurred, a fixed grey lies outside it: dark is also what is below this
  /// share of the brightest within peel_mm; 0 to below 1, 0 = off.
  float edge_share = 0;
  double gap_mm = 0;   ///< air does not enter through gaps narrower than twice this; >= 0
  double open_mm = 0;  ///< things on the skin thinner than twice this (tubes, markers) are taken off; >= 0
};

/// mask = the chest: the front of the chest wall and the pectoral muscle, found as one smooth surface, and all behind
/// it.
struct Chest {
  std::string mask;
  std::string body;                  ///< a mask of step Body
  std::optional<double> sternum_mm;  ///< x of the middle line; absent = from the cleft between the breasts
  ChestWallOptions options;
};

/// mask = the part of the body that is modelled, between named planes; also the two sides of the sternum.
struct Planes {
  /// A plane across one patient axis: where it is found, plus an offset, or where the user puts it.
  struct Plane {
    std::optional<double> at_mm;
    double offset_mm = 0;
  };
  std::string mask;
  std::string left, right;  ///< names of two further masks; empty = not made
  std::string body;
  std::string chest;   ///< the mask of a step Chest
  Plane sternum;       ///< x; parts left from right
  Plane mid_axillary;  ///< y; the model ends there towards the back
  Plane inframammary;  ///< z; towards the feet
  Plane superior;      ///< z; towards the head
  /// Where the breast ends. anatomy: at the mid-axillary line, and at the fold of each side. reader: where those end it
  /// who draw breasts by hand, in front of the line where the chest turns to the side, and 10 mm below the lower fold.
  enum class Ends { anatomy, reader } ends = Ends::anatomy;
  enum class Side { both, left, right };
  std::optional<Side> side;  ///< absent: that of the case
};

/// mask = the gland of the breasts, by classes of the grey with their neighbourhood and by its place (find_gland).
/// Keeps the share of gland in each voxel beside the labels. With options.second a second series takes part where one
/// is given.
struct Gland {
  std::string mask;
  std::string body;    ///< a mask of step Body
  std::string breast;  ///< the modelled part of it without the chest
  std::string chest;   ///< the mask of a step Chest
  GlandOptions options;
};

/// Writes `tissue` into the label map wherever the mask is; with `over`, only where one of those tissues was.
struct Paint {
  std::string mask;
  Tissue tissue = Tissue::air;
  std::vector<Tissue> over;
};

using Step = std::variant<NoiseFloor, Bias, Smooth, Threshold, Grow, Islands, Holes, Combine, Morph, Layer, Region,
                          Paint, Body, Chest, Planes, Otsu, March, Gland>;

/// Names of the steps, in the order of the alternatives of Step.
constexpr const char* step_names[] = {"noise_floor", "bias",    "smooth", "threshold", "grow",   "islands",
                                      "holes",       "combine", "morph",  "layer",     "region", "paint",
                                      "body",        "chest",   "planes", "otsu",      "march",  "gland"};
static_assert(std::size(step_names) == std::variant_size_v<Step>);

/// The steps of a segmentation, in the order in which they run.
struct Recipe {
  std::string name;  ///< of one that comes with the program; else empty
  /// What the greys are taken for: checked where a step finds the chest. absent: not checked.
  std::optional<bool> fat_suppressed = {};
  std::vector<Step> steps;

  /// The side of the steps Planes that name none.
  void set_side(Planes::Side side);
};

}  // namespace supine::segmentation

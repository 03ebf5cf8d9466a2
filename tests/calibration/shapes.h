// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <functional>

#include "reconstruction/surface.h"

namespace supine::testing {

/// Sphere about @p centre: an icosahedron split @p splits times, points on the sphere, outward.
reconstruction::Surface sphere(double radius_mm, int splits, const Eigen::Vector3d& centre = Eigen::Vector3d::Zero());

/// Square [low, high]² of cells × cells squares, two triangles each, normals toward +z where it is flat.
/// @param height  z as a function of x and y
reconstruction::Surface sheet(
    double low, double high, int cells,
    const std::function<double(double, double)>& height = [](double, double) { return 0.0; });

/// The surface without the triangles whose centre @p drop names; all points stay.
reconstruction::Surface without(const reconstruction::Surface& surface,
                                const std::function<bool(const Eigen::Vector3d&)>& drop);

/// A contour: rows of points 0.5 mm apart along x from @p low to @p high, one at every 10 mm of y between them.
/// @param height  z as a function of x and y
Points contour(
    double low, double high, const std::function<double(double, double)>& height = [](double, double) { return 0.0; });

/// Random points in the box, the same for the same seed.
Points random_points(int count, double low, double high, unsigned seed);

/// A rotation with nothing special about it.
Eigen::Matrix3d some_rotation();

}  // namespace supine::testing

// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <filesystem>

#include "registration/rigid_transform.h"

namespace supine::registration {

/// Writes the text format of ITK (`#Insight Transform File V1.0`, AffineTransform_double_3_3, LPS, mm).
///
/// Sense: ITK resamples the moving image at TransformPoint(p) for every point p of the fixed one. Fixed is the image,
/// moving the scan, so the file holds image → scan, y = A (x − c) + t + c. 3D Slicer takes it from there: hung over the
/// scan, it moves the scan onto the image. A comment in the file says so.
/// @param scan_to_image  what moves the scan
/// @param centre         c, in the frame of the image
/// @throws InputError  when the file cannot be written
void write_tfm(const RigidTransform& scan_to_image, const Eigen::Vector3d& centre, const std::filesystem::path& file);

/// Reads what write_tfm() wrote, or any rigid AffineTransform, Euler3DTransform (angles x, y, z) or
/// VersorRigid3DTransform of ITK, and gives scan → image.
/// @throws InputError  no such file, no header of ITK (then its frame and sense are not known), several transforms,
///   another kind, wrong count of numbers, not rigid within 1e-3, mirrored
RigidTransform read_tfm(const std::filesystem::path& file);

}  // namespace supine::registration

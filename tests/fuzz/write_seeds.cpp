// SPDX-License-Identifier: AGPL-3.0-or-later
// Small sound files for every reader, for the fuzzer to begin with: write_seeds FOLDER makes FOLDER/TARGET/NAME.
#include <cstdio>
#include <exception>
#include <fstream>
#include <iterator>

#include "common/landmarks.h"
#include "meshing/mesh_io.h"
#include "reconstruction/surface_io.h"
#include "registration/transform_file.h"
#include "segmentation/formats/labels_io.h"
#include "segmentation/formats/vector_io.h"
#include "tests/fuzz/targets.h"
#include "tests/pipeline/small_case.h"
#include "tests/segmentation/formats/dicom_files.h"
#include "tests/segmentation/formats/image_files.h"
#include "tests/support/shapes.h"

namespace supine::fuzz {
namespace {

namespace fs = std::filesystem;
namespace made = segmentation::testing;

std::string content(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void put(const fs::path& folder, const std::string& target, const std::string& name, const std::string& input) {
  target_of(target);  // a seed that nobody reads is a mistake
  fs::create_directories(folder / target);
  std::ofstream(folder / target / name, std::ios::binary) << input;
}

void put_volumes(const fs::path& folder, const fs::path& work) {
  const segmentation::GreyImage image = made::numbered_image();
  const auto take = [&](const std::string& target, const std::string& file) {
    put(folder, target, file, content(work / file));
  };
  made::write_nrrd(work / "raw.nrrd", image, "RAS");
  made::write_gzip_nrrd(work / "gzip.nrrd", image);
  segmentation::write_image(image, work / "bytes.nrrd");
  for (const char* file : {"raw.nrrd", "gzip.nrrd", "bytes.nrrd"}) take("nrrd", file);
  made::write_meta_image(work / "float.mha", image);
  take("metaimage", "float.mha");
  std::string packed = content(work / "float.mha");
  put(folder, "metaimage", "says_compressed.mha", packed.replace(packed.find("False\nTrans"), 5, "True "));
  made::write_nifti(work / "sform.nii", image);
  made::write_nifti(work / "qform.nii", image, made::Form::qform);
  made::write_nifti(work / "packed.nii.gz", image);
  segmentation::write_image(image, work / "ours.nii");
  for (const char* file : {"sform.nii", "qform.nii", "ours.nii"}) take("nifti", file);
  take("nifti_gz", "packed.nii.gz");
  segmentation::LabelImage labels{image.grid, std::vector<std::uint8_t>(image.voxels.size(), 1)};
  labels.voxels[7] = 2;
  segmentation::write_labels(labels, work / "labels.vti", {{"cut", "excluded"}, {"side", "left"}},
                             std::vector<float>(image.voxels.size(), 0.5f),
                             {{"clamp", "rest"}, std::vector<std::uint8_t>(image.voxels.size(), 2)});
  take("vti", "labels.vti");
  made::write_vti(work / "grey.vti", image);
  take("vti", "grey.vti");
  made::write_dicom_slice(work / "1.dcm", image, 0);
  made::write_dicom_slice(work / "2.dcm", image, 1);
  put(folder, "dicom", "two_slices", joined({content(work / "1.dcm"), content(work / "2.dcm")}));
}

/// A tetrahedron as PLY of three kinds, with colours, and a quadrilateral.
void put_ply(const fs::path& folder) {
  const std::string head = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string faces = "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
  put(folder, "ply", "ascii.ply",
      "ply\nformat ascii 1.0\ncomment frame RAS\n" + head + "property uchar red\n" + faces +
          "0 0 0 255\n9 0 0 255\n0 9 0 255\n0 0 9 0\n3 0 1 2\n4 0 1 2 3\n");
  for (const bool big : {false, true}) {
    std::string body;
    const auto add = [&body, big](auto value) {
      char bytes[sizeof value];
      std::memcpy(bytes, &value, sizeof value);
      if (big) std::reverse(bytes, bytes + sizeof value);
      body.append(bytes, sizeof value);
    };
    for (const float x : {0.f, 0.f, 0.f, 9.f, 0.f, 0.f, 0.f, 9.f, 0.f, 0.f, 0.f, 9.f}) add(x);
    for (int face = 0; face < 2; ++face) {
      body += '\3';
      for (int corner = 0; corner < 3; ++corner) add(corner + face);
    }
    put(folder, "ply", big ? "big.ply" : "little.ply",
        std::string("ply\nformat binary_") + (big ? "big" : "little") + "_endian 1.0\n" + head + faces + body);
  }
}

void put_surfaces(const fs::path& folder, const fs::path& work) {
  put_ply(folder);
  put(folder, "obj", "quad.obj", "# frame LPS\nv 0 0 0\nv 9 0 0\nv 0 9 0\nv 0 0 9\nf 1 2 3\nf 1/1 2/2 3//3 -1\n");
  put(folder, "stl", "text.stl",
      "solid a frame LPS\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 9 0 0\nvertex 0 9 0\nendloop\nendfacet\n"
      "endsolid a\n");
  std::string binary(80 + 4 + 50, '\0');
  binary[80] = 1;
  binary[84 + 12 + 12 + 3] = 0x41;
  put(folder, "stl", "binary.stl", binary);
  reconstruction::Surface surface;
  surface.points = Points::Zero(4, 3);
  surface.points.bottomRows(3) = 9 * Points::Identity(3, 3);
  surface.triangles.resize(2, 3);
  surface.triangles << 0, 1, 2, 0, 2, 3;
  surface.region = Eigen::Vector2i(1, 2);
  reconstruction::write_surface(surface, work / "surface.vtp");
  put(folder, "vtp", "surface.vtp", content(work / "surface.vtp"));
  const meshing::TetMesh mesh = supine::testing::box_mesh(1, 1, 1, {20, 20, 20});
  meshing::write_mesh(mesh, work / "mesh.vtu", "left");
  meshing::write_pose(mesh, mesh.points, {}, {}, work / "pose.vtu", "left");
  for (const char* file : {"mesh.vtu", "pose.vtu"}) put(folder, "vtu", file, content(work / file));
}

void put_tables(const fs::path& folder, const fs::path& work) {
  put(folder, "landmarks", "plain.csv", "name,x,y,z\nnipple,1,-20.5,3e0\nleft,20,4,5\n");
  put(folder, "landmarks", "sigma.csv", "name,x,y,z,sigma_mm\r\nnipple,1,-20.5,3,0.5\r\n");
  put(folder, "fcsv", "points.fcsv",
      "# Markups fiducial file version = 4.11\n# CoordinateSystem = RAS\n# columns = id,x,y,z\n"
      "vtkMRMLMarkupsFiducialNode_1,1,2,3,0,0,0,1,1,1,0,\"a, b\",,\n");
  put(folder, "markups", "curve.mrk.json",
      R"({"markups": [{"type": "Curve", "coordinateSystem": "LPS", "coordinateUnits": "mm", "controlPoints": )"
      R"([{"id": "1", "label": "a", "position": [1, 2, 3]}, {"id": "2", "position": [4.5, 5, 6]}]}]})");
  registration::write_tfm({}, {1, 2, 3}, work / "place.tfm");
  put(folder, "tfm", "affine.tfm", content(work / "place.tfm"));
  put(folder, "tfm", "euler.tfm",
      "#Insight Transform File V1.0\n#Transform 0\nTransform: Euler3DTransform_double_3_3\nParameters: 0.1 0 0 1 2 3\n"
      "FixedParameters: 0 0 0 1\n");
  put(folder, "tfm", "versor.tfm",
      "#Insight Transform File V1.0\nTransform: VersorRigid3DTransform_double_3_3\nParameters: 0.1 0 0 1 2 3\n"
      "FixedParameters: 0 0 0\n");
  put(folder, "sensitivity", "draws.csv",
      "sample,breast.young_modulus_kpa,mae_study_mm,mae_mm,rms_mm,failed\n5,0.3,1,2,3,0\n6,0.4,,,,1\n");
  put(folder, "journal", "runs.journal", "key\n0 1.5 2 3 | 1 2 .\n1 0 0 0 | 3 4 .\n0 1");
}

void put_tomls(const fs::path& folder) {
  const fs::path samples = fs::path(SUPINE_SOURCE_DIR) / "samples",
                 recipes = fs::path(SUPINE_SOURCE_DIR) / "segmentation/recipes";
  put(folder, "case_toml", "small.toml", pipeline::small_case_toml());
  put(folder, "case_toml", "full.toml",
      "[case]\nname = \"a\"\nframe = \"RAS\"\nside = \"both\"\n[image]\nfile = \"labels.nrrd\"\nkind = \"labels\"\n"
      "segmentation_mm = 0.3\ncut = [\"edge\", \"rim\"]\nrim_mm = 5\n[image.labels]\nadipose = [1, 2]\nmuscle = [40]\n"
      "[pose.prone]\ngravity = [0.0, 1.0, 0.0]\n[pose.tilt45]\ngravity = [0, -0.6, -0.8]\nsurface = \"tilt45.ply\"\n"
      "noise_mm = 0.7\nlandmarks = \"supine.csv\"\nregistration_mm = 2\nregistration_deg = 1\ngravity_deg = 1\n"
      "breath_mm = 1\nnoise_shared_mm = 0.2\n[landmarks]\nprone = \"prone.csv\"\n[calibration]\nposes = [\"tilt45\"]\n"
      "[register]\non = [\"landmarks\", \"model\"]\nrigid = [\"sternum\"]\n[priors]\ncohort = \"cohort.json\"\n");
  std::string object = content(samples / "silicone_bar/both/case.toml");
  put(folder, "case_toml", "object.toml", object);
  put(folder, "model_toml", "small.toml", pipeline::small_model_toml());
  put(folder, "model_toml", "sample.toml", content(samples / "ligament/model.toml"));
  put(folder, "model_toml", "effects.toml",
      pipeline::small_model_toml() +
          "[interface]\nkind = \"fixed\"\n[cut]\nkind = \"held\"\n[patchiness]\ntissue_sd = 0.2\n[[effect]]\nname = "
          "\"ligament\"\nstiffness_kpa_per_mm = { value = 0.4, lower = 0, upper = 4 }\narc = \"full\"\n");
  for (const char* recipe : {"t1_auto", "fatsat_auto", "t1_fat_bright"})
    put(folder, "recipe_toml", recipe, content(recipes / (std::string(recipe) + ".toml")));
}

void put_results(const fs::path& folder) {
  put(folder, "population", "cohort.json",
      R"({"numbers": [{"name": "breast.young_modulus_kpa", "of_new": {"median": 0.5, "log_sd": 0.3}, "left_out": )"
      R"([{"patient": "P001", "median": 0.4, "log_sd": 0.2}]}]})");
  put(folder, "cohort", "results",
      joined(
          {R"({"verdict": "missing", "missing": ["ligament"], "unexplained_mm": 0.1, "unexplained95": [0, 0.2], )"
           R"("included": [{"effect": "ligament", "probability": 1.0}], "singles": [{"effect": "ligament", )"
           R"("ln_bayes_factor": 9.0, "numbers": [{"name": "ligament.stiffness_kpa_per_mm", "mean": 0.4, )"
           R"("sd": 0.1, "prior_mean": 0.3, "prior_sd": 0.5, "usual": 0.4, "usual_moves_mm": 1.0}]}]})",
           R"({"rms_mm": 1.2, "parameters": [{"name": "breast.young_modulus_kpa", "value": 0.3011942, "unit": "kPa", )"
           R"("interval95": [0.2, 0.4]}], "worth": {"coordinates": [{"name": "breast.young_modulus_kpa", )"
           R"~("coordinate": "ln(value)", "at": -1.2, "sd": 0.1, "prior_mean": -1.2, "prior_sd": 0.5, )~"
           R"("likelihood": {"mean": -1.2, "sd": 0.1}}]}})",
           R"({"rms_mm": 1.5, "mae_study_mm": 1.1, "areas": [{"name": "upper outer", "mean_signed_mm": 0.2}]})"}));
}

}  // namespace

void write_seeds(const fs::path& folder) {
  const made::TemporaryFolder work;
  put_volumes(folder, work.path());
  put_surfaces(folder, work.path());
  put_tables(folder, work.path());
  put_tomls(folder);
  put_results(folder);
  for (const Target& target : targets())
    if (!fs::exists(folder / target.name)) throw std::runtime_error("no seed for " + target.name);
}

}  // namespace supine::fuzz

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  try {
    supine::fuzz::write_seeds(argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}

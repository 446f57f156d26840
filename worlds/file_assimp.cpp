#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string_view>

#include "config/text.h"
#include "worlds/file_readers.h"

namespace arex::worlds {
namespace {

using Transform = Eigen::Matrix<double, 3, 4>;

Transform transform_of(const aiMatrix4x4& m) {
  Transform out;
  for (unsigned row = 0; row < 3; ++row) {
    for (unsigned column = 0; column < 4; ++column) {
      out(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column)) =
          static_cast<double>(m[row][column]);
    }
  }
  return out;
}

Transform chain(const Transform& a, const Transform& b) {
  Transform out;
  out.leftCols<3>() = a.leftCols<3>() * b.leftCols<3>();
  out.col(3) = a.leftCols<3>() * b.col(3) + a.col(3);
  return out;
}

class Flattener {
 public:
  Flattener(const aiScene& scene, std::filesystem::path folder)
      : scene_(scene), folder_(std::move(folder)) {}

  FileScene flatten() {
    Transform identity = Transform::Zero();
    identity.leftCols<3>().setIdentity();
    if (scene_.mRootNode != nullptr) visit(*scene_.mRootNode, identity, 0);
    if (left_out_ > 0) {
      out_.notes.push_back(std::to_string(left_out_) + " points and lines left out");
    }
    note_textures();
    return std::move(out_);
  }

 private:
  void visit(const aiNode& node, const Transform& X_FParent, int depth) {
    constexpr int kDeepest = 500;
    if (depth > kDeepest) throw std::runtime_error("nests its nodes too deeply");
    const Transform X_FN = chain(X_FParent, transform_of(node.mTransformation));
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      if (node.mMeshes[i] >= scene_.mNumMeshes) throw std::runtime_error("names a mesh it lacks");
      add(*scene_.mMeshes[node.mMeshes[i]], node.mName.C_Str(), X_FN);
    }
    for (unsigned i = 0; i < node.mNumChildren; ++i) visit(*node.mChildren[i], X_FN, depth + 1);
  }

  void add(const aiMesh& mesh, const std::string& node_name, const Transform& X_FN) {
    FileGroup group;
    group.name = node_name.empty() ? mesh.mName.C_Str() : node_name;
    group.shape = "mesh";
    if (mesh.mMaterialIndex < scene_.mNumMaterials) {
      group.material = scene_.mMaterials[mesh.mMaterialIndex]->GetName().C_Str();
    }
    const auto group_id = static_cast<std::uint32_t>(out_.groups.size());
    out_.groups.push_back(std::move(group));
    const auto first = static_cast<std::uint32_t>(out_.vertices.size());
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
      const aiVector3D& v = mesh.mVertices[i];
      out_.vertices.push_back(X_FN.leftCols<3>() * Vec3(v.x, v.y, v.z) + X_FN.col(3));
    }
    for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
      const aiFace& face = mesh.mFaces[i];
      if (face.mNumIndices != 3) {
        ++left_out_;
        continue;
      }
      out_.triangles.push_back(
          {first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
      out_.group_of_triangle.push_back(group_id);
    }
  }

  /// Nothing here draws textures, so that a missing one is no error; but it is said.
  void note_textures() {
    std::set<std::string> missing;
    for (unsigned i = 0; i < scene_.mNumMaterials; ++i) {
      aiString name;
      if (scene_.mMaterials[i]->GetTexture(aiTextureType_DIFFUSE, 0, &name) != aiReturn_SUCCESS) {
        continue;
      }
      const std::string text = name.C_Str();
      std::error_code none;
      if (!text.empty() && text.front() != '*' && !std::filesystem::exists(folder_ / text, none)) {
        missing.insert(text);
      }
    }
    if (!missing.empty()) {
      out_.notes.push_back(std::to_string(missing.size()) + " textures absent (" +
                           *missing.begin() + ")");
    }
  }

  const aiScene& scene_;
  std::filesystem::path folder_;
  FileScene out_;
  std::size_t left_out_ = 0;
};

/// What stands in an attribute or between tags of the head of a COLLADA file; empty: nothing.
std::string after(const std::string& head, std::string_view tag, char from, char to) {
  const std::size_t at = head.find(tag);
  if (at == std::string::npos) return {};
  const std::size_t begin = head.find(from, at + tag.size() - 1);
  if (begin == std::string::npos) return {};
  const std::size_t end = head.find(to, begin + 1);
  return end == std::string::npos ? "" : head.substr(begin + 1, end - begin - 1);
}

/// The asset's up axis and unit: Assimp applies the unit and tells neither.
void read_asset(const std::filesystem::path& file, FileScene& scene) {
  constexpr std::size_t kHead = 1 << 20;
  const std::string head = read_bytes(file).substr(0, kHead);
  const std::string up = after(head, "<up_axis>", '>', '<');
  scene.up = up.find("Z_UP") != std::string::npos   ? FileUp::kZ
             : up.find("X_UP") != std::string::npos ? FileUp::kX
                                                    : FileUp::kY;  // COLLADA's default
  const std::size_t unit = head.find("<unit");
  if (unit == std::string::npos) return;
  const std::string tag = head.substr(unit, head.find('>', unit) - unit);
  const auto metres = parse_double(after(tag, "meter=", '"', '"'));
  if (metres) scene.unit_m = *metres;
}

}  // namespace

FileScene read_assimp(const std::filesystem::path& file) {
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_USE_COLLADA_NAMES, true);
  const aiScene* scene =
      importer.ReadFile(file.string(), aiProcess_Triangulate | aiProcess_ValidateDataStructure);
  if (scene == nullptr) {
    const std::string reason = importer.GetErrorString();
    for (const char* empty : {"contains no faces", "mNumMeshes is 0", "no facets defined"}) {
      if (reason.find(empty) != std::string::npos) throw std::runtime_error("holds no faces");
    }
    throw std::runtime_error("cannot be read" + (reason.empty() ? "" : ": " + reason));
  }
  FileScene out = Flattener(*scene, file.parent_path()).flatten();
  const std::string ending = file.extension().string();
  if (ending == ".dae" || ending == ".DAE") read_asset(file, out);
  if (ending.starts_with(".gl") || ending.starts_with(".GL")) out.up = FileUp::kY;
  return out;
}

}  // namespace arex::worlds

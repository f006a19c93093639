#include "avatar/io/mesh_scene.h"

#include "avatar/io/file_error.h"

#include <assimp/Importer.hpp>
#include <assimp/mesh.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>
#include <vector>

namespace avatar {
namespace {

/// A mesh where a node of the scene shows it.
struct Instance {
  const aiMesh* mesh = nullptr;
  aiMatrix4x4 transform;  // from the mesh to the scene
};

template <typename T>
std::span<T> array(T* first, unsigned int count) {
  return first == nullptr ? std::span<T>() : std::span<T>(first, count);
}

/// Walks the nodes depth first, so in the order in which the file lists them.
class InstanceList {
 public:
  explicit InstanceList(const aiScene& scene) : scene_(scene) {
    if (scene.mRootNode != nullptr) {
      pending_.push_back({scene.mRootNode, scene.mRootNode->mTransformation});
    }
    while (!pending_.empty()) {
      const Entry entry = pending_.back();
      pending_.pop_back();
      appendMeshes(entry);
      pushChildren(entry);
    }
  }

  const std::vector<Instance>& instances() const { return instances_; }

 private:
  struct Entry {
    const aiNode* node = nullptr;
    aiMatrix4x4 transform;  // from the node to the scene
  };

  void appendMeshes(const Entry& entry) {
    for (const unsigned int mesh : array(entry.node->mMeshes, entry.node->mNumMeshes)) {
      if (mesh < scene_.mNumMeshes && scene_.mMeshes[mesh] != nullptr) {
        instances_.push_back({scene_.mMeshes[mesh], entry.transform});
      }
    }
  }

  void pushChildren(const Entry& entry) {
    const std::span<aiNode*> children = array(entry.node->mChildren, entry.node->mNumChildren);
    for (auto child = children.rbegin(); child != children.rend(); ++child) {
      pending_.push_back({*child, entry.transform * (*child)->mTransformation});
    }
  }

  const aiScene& scene_;
  std::vector<Entry> pending_;
  std::vector<Instance> instances_;
};

class SceneJoiner {
 public:
  explicit SceneJoiner(const std::vector<Instance>& instances) {
    for (const Instance& instance : instances) {
      hasColors_ = hasColors_ || instance.mesh->HasVertexColors(0);
    }
    for (const Instance& instance : instances) {
      append(instance);
    }
  }

  MeshScene result() const {
    MeshScene scene;
    scene.vertices = columns(vertices_);
    scene.faces.resize(3, static_cast<Eigen::Index>(faces_.size()));
    for (std::size_t f = 0; f < faces_.size(); ++f) {
      scene.faces.col(static_cast<Eigen::Index>(f)) = faces_[f];
    }
    scene.colors = columns(colors_);
    scene.points = points_;
    scene.lines = lines_;
    return scene;
  }

 private:
  static Eigen::Matrix3Xd columns(const std::vector<Eigen::Vector3d>& points) {
    Eigen::Matrix3Xd result(3, static_cast<Eigen::Index>(points.size()));
    for (std::size_t i = 0; i < points.size(); ++i) {
      result.col(static_cast<Eigen::Index>(i)) = points[i];
    }
    return result;
  }

  void append(const Instance& instance) {
    const aiMesh& mesh = *instance.mesh;
    const auto first = static_cast<int>(vertices_.size());
    const bool mirrored = instance.transform.Determinant() < 0.0F;
    for (const aiFace& face : array(mesh.mFaces, mesh.mNumFaces)) {
      appendFace(face, mesh.mNumVertices, first, mirrored);
    }
    for (const aiVector3D& vertex : array(mesh.mVertices, mesh.mNumVertices)) {
      const aiVector3D moved = instance.transform * vertex;
      vertices_.emplace_back(moved.x, moved.y, moved.z);
    }
    if (hasColors_) {
      appendColors(mesh);
    }
  }

  /// Meshes without colours are white beside those that have some.
  void appendColors(const aiMesh& mesh) {
    const std::span<aiColor4D> colors = array(mesh.mColors[0], mesh.mNumVertices);
    for (const aiColor4D& color : colors) {
      colors_.emplace_back(color.r, color.g, color.b);
    }
    colors_.resize(vertices_.size(), Eigen::Vector3d::Ones());
  }

  void appendFace(const aiFace& face, unsigned int numVertices, int first, bool mirrored) {
    const std::span<unsigned int> corners = array(face.mIndices, face.mNumIndices);
    points_ += corners.size() == 1 ? 1 : 0;
    lines_ += corners.size() == 2 ? 1 : 0;
    const bool inRange = std::all_of(
        corners.begin(), corners.end(), [&](unsigned int corner) { return corner < numVertices; });
    if (corners.size() != 3 || !inRange) {
      return;
    }
    Eigen::Vector3i triangle(
        static_cast<int>(corners[0]), static_cast<int>(corners[1]), static_cast<int>(corners[2]));
    if (mirrored) {
      std::swap(triangle[1], triangle[2]);
    }
    faces_.emplace_back(triangle.array() + first);
  }

  bool hasColors_ = false;
  std::vector<Eigen::Vector3d> vertices_, colors_;
  std::vector<Eigen::Vector3i> faces_;
  int points_ = 0;
  int lines_ = 0;
};

std::string firstLine(const std::string& text) {
  return text.substr(0, text.find_first_of("\r\n"));
}

/// Debian's assimp ends the program with an assertion when it triangulates a face without corners,
/// as it makes of truncated files.
void requireCorners(const std::string& path, const aiScene& scene) {
  for (const aiMesh* mesh : array(scene.mMeshes, scene.mNumMeshes)) {
    const std::span<aiFace> faces = array(mesh->mFaces, mesh->mNumFaces);
    if (std::any_of(
            faces.begin(), faces.end(), [](const aiFace& f) { return f.mNumIndices == 0; })) {
      throw FileError(path, "", "has faces without corners; export or copy the file again");
    }
  }
}

/// A few nodes that show a large mesh again and again fill any memory.
void requireSensibleSize(const std::string& path, const std::vector<Instance>& instances) {
  constexpr std::size_t kMaxVertices = 20'000'000;
  std::size_t vertices = 0;
  for (const Instance& instance : instances) {
    vertices += instance.mesh->mNumVertices;
  }
  if (vertices > kMaxVertices) {
    throw FileError(path, "", "shows more than 20 million vertices; reduce the mesh first");
  }
}

MeshScene joined(const std::string& path, const aiScene& scene) {
  const InstanceList list(scene);
  const std::vector<Instance>& instances = list.instances();
  requireSensibleSize(path, instances);
  return SceneJoiner(instances).result();
}

}  // namespace

MeshScene readMeshScene(const std::string& path) {
  const std::string remedy = "; export it again, best as .obj or .glb";
  try {
    Assimp::Importer importer;
    const aiScene* scene = importer.ReadFile(path, aiProcess_ValidateDataStructure);
    if (scene != nullptr) {
      requireCorners(path, *scene);
      scene = importer.ApplyPostProcessing(aiProcess_Triangulate);
    }
    if (scene == nullptr) {
      throw FileError(
          path,
          "",
          "cannot be read as a mesh (" + firstLine(importer.GetErrorString()) + ")" + remedy);
    }
    return joined(path, *scene);
  } catch (const FileError&) {
    throw;
  } catch (const std::exception& error) {
    throw FileError(
        path, "", "cannot be read as a mesh (" + firstLine(error.what()) + ")" + remedy);
  }
}

}  // namespace avatar

#include "bullet_ext/core/layer_untangling.h"

#include "bullet_ext/core/contact_response.h"
#include "bullet_ext/core/crossing_check.h"
#include "bullet_ext/core/element_index.h"
#include "bullet_ext/core/moving_box_tree.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <map>
#include <utility>

namespace bullet_ext {
namespace {

std::vector<TriangleSurface> surfacesOf(
    const ContactElements& elements, const Eigen::Matrix4Xf& positions) {
  std::vector<TriangleSurface> surfaces(elements.layers.size());
  for (std::size_t g = 0; g < surfaces.size(); ++g) {
    const int first = elements.firstVertices[g];
    const int firstFace = elements.firstFaces[g];
    surfaces[g].vertices = positions.middleCols(first, elements.firstVertices[g + 1] - first)
                               .topRows<3>()
                               .cast<double>();
    surfaces[g].faces =
        elements.faces.middleCols(firstFace, elements.firstFaces[g + 1] - firstFace).array() -
        first;
  }
  return surfaces;
}

void markCrossings(
    LayerUntangling& result,
    const ContactElements& elements,
    const Eigen::Matrix4Xf& positions,
    const UntanglingOptions& options) {
  const auto mark = [&](int surface, int face) {
    for (const int v : elements.faces.col(elements.firstFaces[at(surface)] + face)) {
      result.tangled[at(v)] = true;
    }
  };
  for (const Crossing& crossing : findCrossings(
           surfacesOf(elements, positions), {.within = options.self, .between = options.between})) {
    mark(crossing.surface1, crossing.face1);
    mark(crossing.surface2, crossing.face2);
  }
}

/// Vertices on open borders, and a normal for each vertex: that of its triangles by area.
struct VertexFrames {
  std::vector<bool> border;
  Eigen::Matrix3Xf normals;
};

VertexFrames vertexFrames(const ContactElements& elements, const Eigen::Matrix4Xf& x) {
  VertexFrames frames;
  frames.border.resize(at(elements.numVertices()), false);
  frames.normals.setZero(3, elements.numVertices());
  std::map<std::pair<int, int>, int> edgeFaces;
  for (const auto& face : elements.faces.colwise()) {
    const Eigen::Vector3f a = x.col(face[0]).head<3>();
    const Eigen::Vector3f b = x.col(face[1]).head<3>();
    const Eigen::Vector3f c = x.col(face[2]).head<3>();
    const Eigen::Vector3f normal = (b - a).cross(c - a);
    for (int k = 0; k < 3; ++k) {
      frames.normals.col(face[k]) += normal;
      ++edgeFaces[std::minmax(int{face[k]}, int{face[(k + 1) % 3]})];
    }
  }
  for (const auto& [edge, count] : edgeFaces) {
    if (count == 1) {
      frames.border[at(edge.first)] = true;
      frames.border[at(edge.second)] = true;
    }
  }
  return frames;
}

/// Of the triangles of one garment, the one nearest to a point.
class NearestTriangle {
 public:
  NearestTriangle(const ContactElements& elements, const Eigen::Matrix4Xf& x, std::size_t garment)
      : elements_(elements), x_(x), garment_(garment), tree_(boxesOf(elements, x, garment)) {}

  std::size_t garment() const { return garment_; }

  /// The nearest one within a depth; closest.distance is infinite when there is none.
  MisplacedVertex find(int vertex, float depth) const {
    MisplacedVertex nearest;
    nearest.closest.distance = std::numeric_limits<float>::infinity();
    const auto visit = [&](int face, float bound) {
      const Eigen::Vector3i v = elements_.faces.col(elements_.firstFaces[garment_] + face);
      const std::array<int, 4> vertices = {vertex, v[0], v[1], v[2]};
      const ClosestPoints<float> closest =
          closestPoints(PairKind::kVertexTriangle, cornersAt(x_, vertices));
      if (!(closest.distance < bound)) {
        return bound;
      }
      nearest.vertices = vertices;
      nearest.closest = closest;
      return closest.distance;
    };
    tree_.visitNear(x_.col(vertex).head<3>(), 0.0F, depth, visit);
    return nearest;
  }

 private:
  static std::vector<MovingBox> boxesOf(
      const ContactElements& elements, const Eigen::Matrix4Xf& x, std::size_t garment) {
    std::vector<MovingBox> boxes;
    for (int f = elements.firstFaces[garment]; f < elements.firstFaces[garment + 1]; ++f) {
      const Eigen::Vector3i v = elements.faces.col(f);
      const Eigen::Array4f a = x.col(v[0]).array();
      const Eigen::Array4f b = x.col(v[1]).array();
      const Eigen::Array4f c = x.col(v[2]).array();
      const Eigen::Array4f low = a.min(b).min(c);
      const Eigen::Array4f high = a.max(b).max(c);
      boxes.push_back({low, high, low, high});
    }
    return boxes;
  }

  const ContactElements& elements_;
  const Eigen::Matrix4Xf& x_;
  std::size_t garment_;
  MovingBoxTree tree_;
};

/// In front (+1), behind (−1), or 0 when the nearest point is on an open border. The normal is that
/// of the feature that is nearest: of the triangle inside of it, else the mean of its corners that
/// have a weight, which (unlike the triangle's) gives the right sign at folds.
float sideOf(const MisplacedVertex& nearest, const VertexFrames& frames) {
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  bool border = true;
  for (int k = 1; k < 4; ++k) {
    if (nearest.closest.weights[k] < -1e-6F) {
      const int v = nearest.vertices[at(k)];
      normal += frames.normals.col(v).normalized();
      border = border && frames.border[at(v)];
    }
  }
  return border ? 0.0F : (normal.dot(nearest.closest.normal) > 0.0F ? 1.0F : -1.0F);
}

class MisplacedSearch {
 public:
  MisplacedSearch(
      const ContactElements& elements,
      const Eigen::Matrix4Xf& positions,
      float depth,
      ThreadTeam& team)
      : team_(team),
        elements_(elements),
        positions_(positions),
        frames_(vertexFrames(elements, positions)),
        depth_(depth) {}

  /// Vertices of a garment on the wrong side of others.
  void addTo(LayerUntangling& result, std::size_t garment) const {
    for (std::size_t other = 0; other < elements_.layers.size(); ++other) {
      if (elements_.layers[garment] != elements_.layers[other]) {
        addTo(result, garment, NearestTriangle(elements_, positions_, other));
      }
    }
  }

 private:
  void addTo(LayerUntangling& result, std::size_t garment, const NearestTriangle& triangles) const {
    const int first = elements_.firstVertices[garment];
    const auto count = static_cast<std::size_t>(elements_.firstVertices[garment + 1] - first);
    std::vector<std::vector<MisplacedVertex>> shares(at(team_.size()));
    team_.runShares(count, [&](std::size_t begin, std::size_t end, int thread) {
      shares[at(thread)] =
          misplacedOf(first + static_cast<int>(begin), first + static_cast<int>(end), triangles);
    });
    for (const std::vector<MisplacedVertex>& share : shares) {
      for (const MisplacedVertex& misplaced : share) {
        result.tangled[at(misplaced.vertices[0])] = true;
        result.misplaced.push_back(misplaced);
      }
    }
  }

  /// Of the vertices begin … end − 1 of one garment.
  std::vector<MisplacedVertex> misplacedOf(
      int begin, int end, const NearestTriangle& triangles) const {
    std::vector<MisplacedVertex> misplaced;
    for (int v = begin; v < end; ++v) {
      const int layer = elements_.layers[at(elements_.garments[at(v)])];
      const float side = layer > elements_.layers[triangles.garment()] ? 1.0F : -1.0F;
      MisplacedVertex nearest = triangles.find(v, depth_);
      if (nearest.closest.distance <= depth_ && sideOf(nearest, frames_) == -side) {
        nearest.side = side;
        misplaced.push_back(nearest);
      }
    }
    return misplaced;
  }

  ThreadTeam& team_;
  const ContactElements& elements_;
  const Eigen::Matrix4Xf& positions_;
  VertexFrames frames_;
  float depth_;
};

}  // namespace

LayerUntangling findTangles(
    const ContactElements& elements,
    const Eigen::Matrix4Xf& positions,
    const UntanglingOptions& options,
    ThreadTeam& team) {
  LayerUntangling result;
  result.tangled.resize(at(elements.numVertices()), false);
  markCrossings(result, elements, positions, options);
  const MisplacedSearch search(elements, positions, options.depth, team);
  for (std::size_t g = 0; options.between && g < elements.layers.size(); ++g) {
    search.addTo(result, g);
  }
  if (std::find(result.tangled.begin(), result.tangled.end(), true) == result.tangled.end()) {
    result.tangled.clear();
  }
  return result;
}

}  // namespace bullet_ext

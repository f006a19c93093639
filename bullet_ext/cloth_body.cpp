#include "bullet_ext/cloth_body.h"

#include "bullet_ext/bullet_vector.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>
#include <Eigen/Geometry>

#include <cmath>
#include <stdexcept>

namespace bullet_ext {
namespace {

bool isSame(const btVector3& a, const btVector3& b) {
  return a.x() == b.x() && a.y() == b.y() && a.z() == b.z();
}

bool isFinite(const btVector3& v) {
  return fromBullet(v).allFinite();
}

void write(Eigen::Matrix4Xf& columns, std::size_t column, const btVector3& v) {
  columns.col(static_cast<Eigen::Index>(column)).head<3>() = fromBullet(v);
}

btVector3 read(const Eigen::Matrix4Xf& columns, std::size_t column) {
  return toBullet(Eigen::Vector3f(columns.col(static_cast<Eigen::Index>(column)).head<3>()));
}

btDbvtVolume volumeOf(const btSoftBody::Face& face) {
  const btVector3* corners[3] = {&face.m_n[0]->m_x, &face.m_n[1]->m_x, &face.m_n[2]->m_x};
  return btDbvtVolume::FromPoints(corners, 3);
}

/// As btDbvt makes its nodes, which it will free.
btDbvtNode* newTreeNode(btDbvtNode* parent) {
  auto* node = new (btAlignedAlloc(sizeof(btDbvtNode), 16)) btDbvtNode();
  node->parent = parent;
  node->childs[0] = node->childs[1] = nullptr;
  return node;
}

/// Möller and Trumbore, Fast, Minimum Storage Ray/Triangle Intersection, 1997; both sides count.
class NearestHit final : public btDbvt::ICollide {
 public:
  NearestHit(const ClothBody& body, const Eigen::Vector3d& from, const Eigen::Vector3d& way)
      : body_(body), from_(from), way_(way) {}

  void Process(const btDbvtNode* leaf) override {
    const auto& face = *static_cast<const btSoftBody::Face*>(leaf->data);
    const Eigen::Vector3d a = corner(face, 0);
    const Eigen::Vector3d ab = corner(face, 1) - a;
    const Eigen::Vector3d ac = corner(face, 2) - a;
    const Eigen::Vector3d doubleArea = ab.cross(ac);
    const double descent = -way_.dot(doubleArea);
    if (descent == 0.0)
      return;
    const Eigen::Vector3d offset = from_ - a;
    const Eigen::Vector3d moment = offset.cross(way_);
    const double fraction = offset.dot(doubleArea) / descent;
    const double u = ac.dot(moment) / descent;
    const double v = -ab.dot(moment) / descent;
    if (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && fraction >= 0.0 && fraction <= 1.0 &&
        (hit.face < 0 || fraction < hit.fraction))
      keep(face, fraction, doubleArea.normalized());
  }

  ClothRayHit hit;

 private:
  static Eigen::Vector3d corner(const btSoftBody::Face& face, int index) {
    return fromBullet(face.m_n[index]->m_x).cast<double>();
  }

  void keep(const btSoftBody::Face& face, double fraction, const Eigen::Vector3d& normal) {
    hit = {
        .fraction = fraction,
        .face = static_cast<int>(&face - &body_.m_faces[0]),
        .vertices = {face.m_n[0]->index, face.m_n[1]->index, face.m_n[2]->index},
        .normal = normal};
  }

  const ClothBody& body_;
  Eigen::Vector3d from_, way_;
};

}  // namespace

ClothBody::ClothBody(
    const ClothMesh& mesh, btSoftBodyWorldInfo& worldInfo, FaceTreeUpdate treeUpdate)
    : btSoftBody(&worldInfo),
      solverFromInput_(mesh.solverFromInput),
      positions_(solverFromInput_.size(), btVector3(0, 0, 0)),
      velocities_(positions_),
      treeUpdate_(treeUpdate) {
  getCollisionShape()->setMargin(static_cast<btScalar>(mesh.material.thickness));
  setFriction(static_cast<btScalar>(mesh.material.friction));
  m_cfg.collisions = 0;
  addElements(mesh);
  buildFaceTree();
  mirror(restState(mesh));
  // Otherwise Bullet would take the rest lengths from the shape that it meets first.
  m_bUpdateRtCst = false;
}

void ClothBody::addElements(const ClothMesh& mesh) {
  const auto inputIndex = [&mesh](int vertex) {
    return mesh.inputFromSolver[static_cast<std::size_t>(vertex)];
  };
  Material* material = appendMaterial();  // of all elements
  material->m_kLST = material->m_kAST = material->m_kVST = 1;
  material->m_flags = fMaterial::Default;
  const Eigen::Matrix3Xd rest = toInputOrder(mesh, mesh.restPositions);
  m_nodes.reserve(static_cast<int>(rest.cols()));
  m_links.reserve(static_cast<int>(mesh.springs.cols()));
  m_faces.reserve(static_cast<int>(mesh.faces.cols()));
  for (int i = 0; i < static_cast<int>(rest.cols()); ++i) {
    appendNode(toBullet(Eigen::Vector3d(rest.col(i))), 0);
    const auto vertex = static_cast<Eigen::Index>(solverIndex(i));
    m_nodes[i].m_im = static_cast<btScalar>(mesh.inverseMasses[vertex]);
    m_nodes[i].index = i;
  }
  for (Eigen::Index s = 0; s < mesh.springs.cols(); ++s) {
    appendLink(inputIndex(mesh.springs(0, s)), inputIndex(mesh.springs(1, s)));
    m_links[static_cast<int>(s)].m_rl = static_cast<btScalar>(mesh.springRestLengths[s]);
  }
  for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f)
    appendFace(
        inputIndex(mesh.faces(0, f)), inputIndex(mesh.faces(1, f)), inputIndex(mesh.faces(2, f)));
  updateLinkConstants();
}

void ClothBody::mirror(const ClothState& state) {
  for (int i = 0; i < m_nodes.size(); ++i) {
    Node& node = m_nodes[i];
    const std::size_t vertex = solverIndex(i);
    const auto slot = static_cast<std::size_t>(i);
    node.m_q = node.m_x;
    node.m_vn = node.m_v;
    node.m_x = positions_[slot] = read(state.positions, vertex);
    node.m_v = velocities_[slot] = read(state.velocities, vertex);
  }
  updateNormals();
  updateBox();
  if (treeUpdate_ == FaceTreeUpdate::kEveryFrame)
    fitFaceTree();
  else
    loosenFaceTree();
}

int ClothBody::adoptChanges(ClothState& state) const {
  std::vector<int> changed;
  for (int i = 0; i < m_nodes.size(); ++i) {
    const Node& node = m_nodes[i];
    const auto slot = static_cast<std::size_t>(i);
    if (isSame(node.m_x, positions_[slot]) && isSame(node.m_v, velocities_[slot]))
      continue;
    if (!isFinite(node.m_x) || !isFinite(node.m_v))
      throw std::invalid_argument("ClothBody: a node was given a value that is not finite");
    changed.push_back(i);
  }
  for (const int i : changed) {
    write(state.positions, solverIndex(i), m_nodes[i].m_x);
    write(state.velocities, solverIndex(i), m_nodes[i].m_v);
  }
  return static_cast<int>(changed.size());
}

bool ClothBody::takeForces(Eigen::Matrix4Xf& forces) {
  bool any = false;
  for (int i = 0; i < m_nodes.size(); ++i) {
    if (!isFinite(m_nodes[i].m_f))
      throw std::invalid_argument("ClothBody: a node was given a force that is not finite");
    any = any || !m_nodes[i].m_f.isZero();
  }
  if (!any)
    return false;
  forces.setZero(4, m_nodes.size());
  for (int i = 0; i < m_nodes.size(); ++i) {
    write(forces, solverIndex(i), m_nodes[i].m_f);
    m_nodes[i].m_f.setZero();
  }
  return true;
}

/// A binary tree over the faces in their order, in which neighbours are close already. Bullet's own
/// builder doesn't end on a garment of several pieces, and Bullet calls it on a ray's first visit
/// if there is no tree.
void ClothBody::buildFaceTree() {
  m_fdbvt.clear();
  treeNodes_.reserve(2 * static_cast<std::size_t>(m_faces.size()));
  m_fdbvt.m_root = buildFaceTree(0, m_faces.size(), nullptr);
  m_fdbvt.m_leaves = m_faces.size();
  treeIsFitted_ = true;  // nothing is in the nodes yet: the first mirror() fills them
}

// NOLINTNEXTLINE(misc-no-recursion): depth is the logarithm of the number of faces
btDbvtNode* ClothBody::buildFaceTree(int begin, int end, btDbvtNode* parent) {
  btDbvtNode* node = newTreeNode(parent);
  treeNodes_.push_back(node);
  if (end - begin == 1) {
    node->data = &m_faces[begin];
    m_faces[begin].m_leaf = node;
  } else {
    const int middle = begin + (end - begin) / 2;
    node->childs[0] = buildFaceTree(begin, middle, node);
    node->childs[1] = buildFaceTree(middle, end, node);
  }
  return node;
}

void ClothBody::fitFaceTree() {
  for (std::size_t i = treeNodes_.size(); i-- > 0;) {
    btDbvtNode& node = *treeNodes_[i];
    if (node.isleaf())
      node.volume = volumeOf(*static_cast<const Face*>(node.data));
    else
      Merge(node.childs[0]->volume, node.childs[1]->volume, node.volume);
  }
  treeIsFitted_ = true;
}

std::optional<ClothRayHit> ClothBody::castRay(
    const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  if (!treeIsFitted_)
    fitFaceTree();
  NearestHit nearest(*this, from, to - from);
  btDbvt::rayTest(m_fdbvt.m_root, toBullet(from), toBullet(to), nearest);
  return nearest.hit.face < 0 ? std::nullopt : std::optional(nearest.hit);
}

/// All volumes of the tree a good deal larger than the cloth, so that they hold for many frames.
void ClothBody::loosenFaceTree() {
  const btDbvtVolume bounds = btDbvtVolume::FromMM(m_bounds[0], m_bounds[1]);
  if (!treeIsFitted_ && looseVolume_.Contain(bounds))
    return;
  looseVolume_ = bounds;
  looseVolume_.Expand(btScalar(0.5) * bounds.Lengths());
  for (btDbvtNode* node : treeNodes_)
    node->volume = looseVolume_;
  treeIsFitted_ = false;
}

void ClothBody::updateBox() {
  btVector3 low = m_nodes[0].m_x;
  btVector3 high = low;
  for (int i = 1; i < m_nodes.size(); ++i) {
    low.setMin(m_nodes[i].m_x);
    high.setMax(m_nodes[i].m_x);
  }
  const btScalar margin = getCollisionShape()->getMargin();
  m_bounds[0] = low - btVector3(margin, margin, margin);
  m_bounds[1] = high + btVector3(margin, margin, margin);
  if (getBroadphaseHandle() != nullptr)
    m_worldInfo->m_broadphase->setAabb(
        getBroadphaseHandle(), m_bounds[0], m_bounds[1], m_worldInfo->m_dispatcher);
}

}  // namespace bullet_ext

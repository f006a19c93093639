// plain_bullet FILE.bullet: loads soft bodies as any Bullet program does, with nothing of ours, and
// lets them hang on their pins for a second. Exit code 1 when they aren't there, or don't look like
// cloth afterwards.
#include <BulletFileLoader/btBulletFile.h>
#include <BulletSoftBody/btSoftBodyData.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <vector>

namespace {

btVector3 vectorOf(const btVector3FloatData& data) {
  btVector3 vector;
  vector.deSerializeFloat(data);
  return vector;
}

/// As Bullet's own SerializeDemo loads them.
std::unique_ptr<btSoftBody> softBodyOf(const btSoftBodyFloatData& data, btSoftBodyWorldInfo& info) {
  std::vector<btVector3> places;
  std::vector<btScalar> masses;
  for (int n = 0; n < data.m_numNodes; ++n) {
    const SoftBodyNodeData& node = data.m_nodes[n];
    places.push_back(vectorOf(node.m_position));
    masses.push_back(node.m_inverseMass > 0 ? 1 / node.m_inverseMass : 0);
  }
  auto body = std::make_unique<btSoftBody>(&info, data.m_numNodes, places.data(), masses.data());
  std::map<const SoftBodyMaterialData*, btSoftBody::Material*> materials;
  for (int m = 0; m < data.m_numMaterials; ++m) {
    btSoftBody::Material* material = body->appendMaterial();
    material->m_kLST = data.m_materials[m]->m_linearStiffness;
    material->m_kAST = data.m_materials[m]->m_angularStiffness;
    material->m_flags = data.m_materials[m]->m_flags;
    materials[data.m_materials[m]] = material;
  }
  for (int l = 0; l < data.m_numLinks; ++l) {
    const SoftBodyLinkData& link = data.m_links[l];
    body->appendLink(link.m_nodeIndices[0], link.m_nodeIndices[1], materials[link.m_material]);
    body->m_links[l].m_rl = link.m_restLength;
    body->m_links[l].m_c1 = link.m_restLength * link.m_restLength;
  }
  for (int f = 0; f < data.m_numFaces; ++f)
    body->appendFace(
        data.m_faces[f].m_nodeIndices[0],
        data.m_faces[f].m_nodeIndices[1],
        data.m_faces[f].m_nodeIndices[2]);
  body->m_cfg.piterations = data.m_config.m_positionIterations;
  body->m_cfg.kDP = data.m_config.m_damping;
  body->m_cfg.collisions = data.m_config.m_collisionFlags;
  body->m_bUpdateRtCst = false;  // or Bullet takes present lengths for those at rest
  body->updateLinkConstants();
  return body;
}

bool hangsLikeCloth(const btSoftBody& body, const std::vector<btVector3>& start) {
  std::vector<double> strains;
  for (int l = 0; l < body.m_links.size(); ++l) {
    const btSoftBody::Link& link = body.m_links[l];
    const double length = (link.m_n[0]->m_x - link.m_n[1]->m_x).length();
    strains.push_back(std::abs(length / static_cast<double>(link.m_rl) - 1.0));
  }
  double moved = 0.0;
  int pins = 0;
  bool pinsStay = true;
  for (int n = 0; n < body.m_nodes.size(); ++n) {
    const double way = (body.m_nodes[n].m_x - start[static_cast<std::size_t>(n)]).length();
    moved = way <= moved ? moved : way;  // NaN counts
    pins += body.m_nodes[n].m_im > 0 ? 0 : 1;
    pinsStay = pinsStay && (body.m_nodes[n].m_im > 0 || way == 0.0);
  }
  std::nth_element(
      strains.begin(), strains.begin() + std::ssize(strains) * 95 / 100, strains.end());
  const double strain = strains[strains.size() * 95 / 100];
  std::printf(
      "%d nodes with %d pins moved %.3f m at most, strain p95 %.3f\n",
      body.m_nodes.size(),
      pins,
      moved,
      strain);
  // Position-based links give way under the cloth's own weight by what their stiffness leaves.
  const double most = pins > 0 ? 0.5 : 5.5;  // what has no pins falls, 5 m in a second
  return pinsStay && moved > 0.002 && moved < most && strain < 0.2;
}

}  // namespace

int main(int argc, char** argv) {
  bParse::btBulletFile file(argc == 2 ? argv[1] : "");
  if (file.ok())
    file.parse(0);
  if (!file.ok() || file.m_softBodies.size() == 0) {
    std::printf("no soft bodies\n");
    return 1;
  }
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btSoftRigidDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  std::vector<std::unique_ptr<btSoftBody>> bodies;
  std::vector<std::vector<btVector3>> starts;
  for (int i = 0; i < file.m_softBodies.size(); ++i) {
    const auto* data = reinterpret_cast<const btSoftBodyFloatData*>(file.m_softBodies[i]);
    bodies.push_back(softBodyOf(*data, world.getWorldInfo()));
    world.addSoftBody(bodies.back().get());
    starts.emplace_back();
    for (int n = 0; n < bodies.back()->m_nodes.size(); ++n)
      starts.back().push_back(bodies.back()->m_nodes[n].m_x);
  }
  for (int frame = 0; frame < 60; ++frame)
    world.stepSimulation(1.0F / 60.0F, 0);
  bool passed = true;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    passed = hangsLikeCloth(*bodies[i], starts[i]) && passed;
    world.removeSoftBody(bodies[i].get());
  }
  return passed ? 0 : 1;
}

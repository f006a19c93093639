#include "bullet_ext/core/contact_response.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace bullet_ext {
namespace {

Eigen::Vector4f combine(const Contact& contact, const Eigen::Matrix4Xf& x) {
  return contact.weights[0] * x.col(contact.vertices[0]) +
         contact.weights[1] * x.col(contact.vertices[1]) +
         contact.weights[2] * x.col(contact.vertices[2]) +
         contact.weights[3] * x.col(contact.vertices[3]);
}

void apply(const Contact& contact, const Eigen::Vector4f& impulse, Eigen::Matrix4Xf& x) {
  for (int k = 0; k < 4; ++k) {
    x.col(contact.vertices[static_cast<std::size_t>(k)]) += contact.mobilities[k] * impulse;
  }
}

/// Coulomb: the drag that would stop the tangential motion, limited by friction · push.
Eigen::Vector4f frictionImpulse(Contact& contact, const Eigen::Vector4f& relativeMotion) {
  const Eigen::Vector3f motion = relativeMotion.head<3>();
  const Eigen::Vector3f tangential = motion - contact.normal.dot(motion) * contact.normal;
  Eigen::Vector3f drag = contact.drag - tangential / contact.inverseMass;
  const float most = contact.friction * contact.push;
  const float squared = drag.squaredNorm();
  if (squared > most * most) {
    drag *= most / std::sqrt(squared);
  }
  Eigen::Vector4f impulse = Eigen::Vector4f::Zero();
  impulse.head<3>() = drag - contact.drag;
  contact.drag = drag;
  return impulse;
}

/// How much to add to the push for what is missing [kg m]. Of equal corners none is moved more than
/// 1.37 times as far as the point of contact. Beside pins the free one would have to move 1/w times
/// as far, at any small weight w: so far it goes back where it came from, but isn't thrown.
float neededPush(const Contact& contact, float missing, const SubstepMotion& motion) {
  constexpr float kLargestShare = 1.5F;
  float needed = missing / contact.inverseMass;
  const float leverage = contact.mobilities.cwiseAbs().maxCoeff() / contact.inverseMass;
  if (missing <= 0.0F || leverage <= kLargestShare) {
    return needed;
  }
  for (int k = 0; k < 4; ++k) {
    const int v = contact.vertices[static_cast<std::size_t>(k)];
    const Eigen::Vector4f way = motion.end.col(v) - motion.start.col(v);
    const float mobility = std::abs(contact.mobilities[k]);
    const float side = contact.mobilities[k] > 0.0F ? 1.0F : -1.0F;
    const float back = std::max(0.0F, -side * contact.normal.dot(way.head<3>()));
    const float most = kLargestShare * missing + back;
    needed = needed * mobility > most ? most / mobility : needed;
  }
  return needed;
}

}  // namespace

Contact makeContact(
    PairKind kind,
    const std::array<int, 4>& vertices,
    const ClosestPoints<float>& closest,
    const std::vector<float>& inverseMasses) {
  Contact contact = {
      .kind = kind, .vertices = vertices, .weights = closest.weights, .normal = closest.normal};
  for (int k = 0; k < 4; ++k) {
    const auto vertex = static_cast<std::size_t>(vertices[static_cast<std::size_t>(k)]);
    contact.mobilities[k] = closest.weights[k] * inverseMasses[vertex];
  }
  contact.inverseMass = contact.mobilities.dot(contact.weights);
  return contact;
}

float sweep(std::vector<Contact>& contacts, SubstepMotion& motion) {
  float largest = 0.0F;
  for (Contact& contact : contacts) {
    if (contact.inverseMass <= 0.0F) {
      continue;
    }
    const Eigen::Vector4f end = combine(contact, motion.end);
    const float missing = contact.target - contact.normal.dot(end.head<3>());
    const float push = std::max(0.0F, contact.push + neededPush(contact, missing, motion));
    if (push == 0.0F && contact.push == 0.0F) {
      continue;
    }
    Eigen::Vector4f impulse = Eigen::Vector4f::Zero();
    impulse.head<3>() = (push - contact.push) * contact.normal;
    contact.push = push;
    impulse += frictionImpulse(contact, end - combine(contact, motion.start));
    apply(contact, impulse, motion.end);
    largest = std::max(largest, impulse.norm() * contact.inverseMass);
  }
  return largest;
}

}  // namespace bullet_ext

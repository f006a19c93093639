#include "bullet_ext/core/contact_lists.h"

#include "bullet_ext/core/contact_response.h"
#include "tests/bullet_ext/core/contact_scenes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

namespace bullet_ext {
namespace {

using test::ContactScene;

/// Kind and vertices, in an order that doesn't depend on which element or corner is named first.
using PairKey = std::array<int, 5>;

PairKey keyOf(PairKind kind, std::array<int, 4> v) {
  if (kind == PairKind::kVertexTriangle) {
    std::sort(v.begin() + 1, v.end());
  } else {
    std::sort(v.begin(), v.begin() + 2);
    std::sort(v.begin() + 2, v.end());
    if (v[2] < v[0]) {
      std::swap_ranges(v.begin(), v.begin() + 2, v.begin() + 2);
    }
  }
  return {static_cast<int>(kind), v[0], v[1], v[2], v[3]};
}

PairPoints<double> cornersOf(const Eigen::Matrix4Xf& x, const std::array<int, 4>& v) {
  return cornersAt(x, v).cast<double>();
}

/// The slow and obvious version: every pair of elements, every time, in double.
class AllPairs {
 public:
  explicit AllPairs(const ContactElements& elements) : elements_(elements) {}

  struct Found {
    std::set<PairKey> necessary;  ///< end nearer than their thickness
    std::set<PairKey> possible;   ///< the axis of their start doesn't separate them by that
  };

  Found find(const Eigen::Matrix4Xf& start, const Eigen::Matrix4Xf& end) const {
    Found found;
    forEachPair([&](PairKind kind, const std::array<int, 4>& v) {
      const PairPoints<double> x0 = cornersOf(start, v);
      const PairPoints<double> x1 = cornersOf(end, v);
      const Eigen::Vector3d size = x0.rowwise().maxCoeff() - x0.rowwise().minCoeff();
      if (size.maxCoeff() > 0.1) {
        return;  // farther apart than any edge and thickness of these scenes
      }
      constexpr double kRounding = 1e-7;
      const double thickness = thicknessOf(kind, v);
      const ClosestPoints<double> closest = closestPoints(kind, x0);
      if (closestPoints(kind, x1).distance < thickness - kRounding) {
        found.necessary.insert(keyOf(kind, v));
      }
      if (separation(kind, x1, closest.normal) < thickness + kRounding) {
        found.possible.insert(keyOf(kind, v));
      }
    });
    return found;
  }

 private:
  double thicknessOf(PairKind kind, const std::array<int, 4>& v) const {
    const int garment1 = elements_.garments[static_cast<std::size_t>(v[0])];
    const int garment2 = elements_.garments[static_cast<std::size_t>(v[3])];
    const double thickness = elements_.thickness(garment1, garment2);
    const double rest = closestPoints(kind, cornersOf(elements_.restPositions, v)).distance;
    return garment1 == garment2 ? std::min(thickness, 0.5 * rest) : thickness;
  }

  template <typename Visit>
  void forEachPair(const Visit& visit) const {
    for (int v = 0; v < elements_.numVertices(); ++v) {
      for (const auto& f : elements_.faces.colwise()) {
        if ((f.array() != v).all()) {
          visit(PairKind::kVertexTriangle, {v, f[0], f[1], f[2]});
        }
      }
    }
    for (Eigen::Index i = 0; i < elements_.edges.cols(); ++i) {
      for (Eigen::Index j = i + 1; j < elements_.edges.cols(); ++j) {
        const Eigen::Vector2i e = elements_.edges.col(i);
        const Eigen::Vector2i f = elements_.edges.col(j);
        if (e[0] != f[0] && e[0] != f[1] && e[1] != f[0] && e[1] != f[1]) {
          visit(PairKind::kEdgeEdge, {e[0], e[1], f[0], f[1]});
        }
      }
    }
  }

  const ContactElements& elements_;
};

Eigen::Matrix4Xf allPositions(ContactScene& scene) {
  Eigen::Matrix4Xf all(4, scene.numVertices());
  Eigen::Index first = 0;
  for (const ClothState& state : scene.states()) {
    all.middleCols(first, state.positions.cols()) = state.positions;
    first += state.positions.cols();
  }
  return all;
}

ContactElements elementsOf(const ContactScene& scene, std::size_t garments) {
  std::vector<ContactGarment> list;
  for (std::size_t g = 0; g < garments; ++g) {
    const ClothMaterial& material = scene.mesh(g).material;
    list.push_back({&scene.mesh(g), static_cast<int>(g), material.thickness, material.friction});
  }
  return buildContactElements(list);
}

/// Runs a scene; every few substeps the contacts must be those that all pairs say.
void compareWithAllPairs(ContactScene& scene, int frames) {
  scene.start();
  const ContactElements elements = elementsOf(scene, scene.states().size());
  const AllPairs slow(elements);
  std::size_t compared = 0;
  for (int substep = 0; substep < 100 * frames; ++substep) {
    if (substep % 100 == 0) {
      scene.beginFrame();
    }
    const Eigen::Matrix4Xf start = allPositions(scene);
    scene.integrate();
    const Eigen::Matrix4Xf end = allPositions(scene);
    scene.contact().resolve(scene.states(), substep);
    if (substep % 23 != 22) {
      continue;
    }
    const AllPairs::Found expected = slow.find(start, end);
    std::set<PairKey> contacts;
    for (const Contact& contact : scene.contact().contacts()) {
      contacts.insert(keyOf(contact.kind, contact.vertices));
    }
    ASSERT_TRUE(std::includes(
        contacts.begin(), contacts.end(), expected.necessary.begin(), expected.necessary.end()))
        << "substep " << substep;
    ASSERT_TRUE(std::includes(
        expected.possible.begin(), expected.possible.end(), contacts.begin(), contacts.end()))
        << "substep " << substep;
    compared += expected.necessary.size();
  }
  EXPECT_GT(compared, 100U);
  // Kept lists: a small part of the pairs of patches is looked through in a substep.
  const ContactCounters& counters = scene.contact().counters();
  const auto patches = static_cast<std::int64_t>(elements.patches.size());
  EXPECT_LT(counters.listBuilds, counters.substeps * patches * patches / 4);
}

TEST(ContactLists, findTheContactsOfAllPairsWhereSheetsFall) {
  ContactScene scene;
  test::fallingSheets(scene, 8);
  compareWithAllPairs(scene, 7);
}

TEST(ContactLists, findTheContactsOfAllPairsInATwistedRibbon) {
  ContactScene scene;
  test::twistedRibbon(scene, 26, 4.0, 0.25);
  compareWithAllPairs(scene, 8);
}

TEST(ContactLists, findTheContactsOfAllPairsBetweenTubes) {
  ContactScene scene;
  test::concentricTubes(scene, 16, true);
  compareWithAllPairs(scene, 7);
}

}  // namespace
}  // namespace bullet_ext

#pragma once

#include "bullet_ext/core/body_surface.h"
#include "bullet_ext/core/contact_kernels.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <vector>

namespace bullet_ext {

/// What was done, for reports.
struct ContactCounts {
  std::int64_t contacts = 0;      ///< vertices pushed
  std::int64_t nearestTests = 0;  ///< vertices tested against their nearest triangle
  std::int64_t listTests = 0;     ///< triangles tested to find or confirm the nearest one
  std::int64_t listRebuilds = 0;  ///< for eight vertices each
  std::int64_t treeQueries = 0;   ///< nearest triangles looked for in the whole surface

  ContactCounts& operator+=(const ContactCounts& other);

  bool operator==(const ContactCounts&) const = default;
};

/// What ContactSearch remembers of the eight vertices of a ContactCluster.
struct ContactGroup {
  bool stale = true;  ///< the lists are of another frame
  /// Sets of lanes, one bit each.
  std::uint32_t mobile = 0;      ///< not pinned
  std::uint32_t unproven = 0;    ///< may be inside the body without anybody having noticed
  std::uint32_t deep = 0;        ///< so far inside that lists don't reach the surface
  std::uint32_t hasNearest = 0;  ///< the cluster has the triangle to be tested
  std::uint32_t sharp = 0;       ///< whose side must be found by pseudo-normals
  std::array<std::int32_t, kContactLanes> nearest{};  ///< also a hint when it is far
  /// Lists: all triangles that are within `reach` of a vertex's place c + u t, in the meaning of
  /// ContactCluster, at any time until the end of the frame.
  Eigen::Matrix<float, 3, kContactLanes> centres;
  Eigen::Vector3f velocity = Eigen::Vector3f::Zero();
  float reach = 0.0F;               ///< [m]
  std::vector<std::int32_t> lists;  ///< one list per lane
  std::int32_t listStride = 0;      ///< from one list to the next, whole blocks of lanes
  std::array<std::int32_t, kContactLanes> listSizes{};
};

/// Finds nearest triangles and makes the certificates of ContactCluster. One object per thread.
class ContactSearch {
 public:
  struct Options {
    float thickness = 0.0F;  ///< [m]
    float release = 0.0F;    ///< [m]
    float slack = 0.0F;      ///< [m]
  };

  ContactSearch(const BodySurface& surface, const ContactKernels& kernels, const Options& options);

  /// The next vertices' positions, eight times four floats, and time [s] since the frame's start.
  void lookAt(const float* positions, float time);

  /// New certificates and nearest triangles for these lanes. Returns the lanes that changed: all
  /// mobile ones if the lists were used up.
  std::uint32_t update(ContactGroup& group, ContactCluster& cluster, std::uint32_t lanes);

  /// Signs for those nearest triangles whose normal doesn't tell.
  void findSides(const ContactGroup& group, ContactCluster& cluster, std::uint32_t lanes) const;

  ContactCounts counts;

 private:
  Eigen::Vector3f position(int lane) const;
  float reach(const ContactGroup& group, int lane) const;
  void rebuild(ContactGroup& group);
  void proveSides(ContactGroup& group);
  void findVelocity(ContactGroup& group) const;
  void fillLists(ContactGroup& group);
  bool certify(ContactGroup& group, ContactCluster& cluster, int lane);
  bool certifyDeep(ContactGroup& group, ContactCluster& cluster, int lane);
  float distance(std::int32_t listed) const;
  Eigen::Vector3f offset(std::int32_t listed) const;
  std::int32_t measureList(const ContactGroup& group, int lane);
  float targetFor(const ContactGroup& group, int lane, std::int32_t nearest) const;
  int listedSkin(const ContactGroup& group, int lane, const Eigen::Vector3f& push) const;
  /// face −1: none
  void setNearest(ContactGroup& group, ContactCluster& cluster, int lane, int face) const;
  void setRadii(const ContactGroup& group, ContactCluster& cluster, int lane, std::int32_t nearest);

  const BodySurface& surface_;
  const ContactKernels& kernels_;
  Options options_;
  float listReach_;
  const float* positions_ = nullptr;
  float time_ = 0.0F;
  std::vector<std::int32_t> candidates_;
  std::vector<float> offsets_;     ///< of the list last looked at, as triangleDistances gives them
  std::vector<float> deviations_;  ///< [m/s]
};

}  // namespace bullet_ext

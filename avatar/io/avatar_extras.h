#pragma once

#include "avatar/layered_avatar.h"

#include <nlohmann/json_fwd.hpp>

#include <string>
#include <vector>

namespace avatar {

/// What glTF has no place for travels in the `extras` of the avatar's nodes, as JSON. Numbers are
/// doubles written with the digits that bring them back exactly.
inline constexpr int kAvatarExtrasVersion = 1;
inline constexpr const char* kBodyExtrasKey = "simulcap_body";
inline constexpr const char* kClothExtrasKey = "simulcap_cloth";

/// The pose in which a file shows its avatar: that of its first garment's mesh, so that programs
/// which look at meshes and joints alone find them in one place; at rest without garments.
BodyPose filePose(const LayeredAvatar& avatar);

/// {version, model, betas, capsules [{joint: name, p0, p1 [m, with the skeleton in `pose`],
/// local_p0, local_p1 [m, the same in the joint's own frame], radius}], color}.
nlohmann::json bodyExtras(const AvatarBody& body, const BodyPose& pose);

/// {version, layer, stretch_k, torsion_w, mass_mode, vertex_mass_kg, areal_density_kg_m2,
/// damping_mode, damping, friction, thickness_m, edge_stretch_k, edge_torsion_w, vertex_masses_kg,
/// pins, max_distance, collide_with, hints, bind_pose {rotations [rad], translation [m]}, color}.
nlohmann::json clothExtras(const Garment& garment);

/// Where a text came from, for the messages of FileError.
struct ExtrasSource {
  std::string file;
  std::string node;
};

/// Fills what bodyExtras() wrote. Throws FileError naming file, node and key.
void readBodyExtras(
    const nlohmann::json& extras,
    const ExtrasSource& source,
    const std::vector<std::string>& jointNames,
    AvatarBody& body);

/// Fills what clothExtras() wrote. Throws FileError naming file, node and key.
void readClothExtras(const nlohmann::json& extras, const ExtrasSource& source, Garment& garment);

}  // namespace avatar

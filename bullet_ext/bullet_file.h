#pragma once

#include "bullet_ext/core/cloth_mesh.h"
#include "bullet_ext/core/cloth_state.h"

#include <filesystem>
#include <string>
#include <vector>

namespace bullet_ext {

/// A cloth as a file keeps it.
struct BulletFileCloth {
  std::string name;  ///< at most 1000 bytes
  ClothMesh mesh;
  ClothState state;
};

/// Writes cloths as a .bullet file, whole or not at all. It has two chunks per cloth: Bullet's own
/// soft body, for other programs, and one with everything that a soft body has no place for, in
/// full precision (rest angles, stiffness in SI units, masses under pins, damping, friction,
/// thickness). Other programs skip that chunk; readBulletFile() reads nothing else.
///
/// Who loads the soft bodies with Bullet's importer must set m_bUpdateRtCst = false on them, or
/// Bullet takes the present lengths of links for those at rest, set their m_c1 = m_rl² and call
/// updateLinkConstants(), and take m_cfg.piterations from the file; the margin is not in there.
///
/// Same cloths, same bytes. Throws std::invalid_argument for a state of another mesh or a name too
/// long, std::runtime_error that names the file if it can't be written.
void writeBulletFile(const std::filesystem::path& path, const std::vector<BulletFileCloth>& cloths);

/// What writeBulletFile() wrote. Throws std::runtime_error that names the file, what is wrong and
/// what to do, for one that is missing, damaged, of another precision, or has no cloth of ours.
std::vector<BulletFileCloth> readBulletFile(const std::filesystem::path& path);

}  // namespace bullet_ext

#pragma once

#include "avatar/layered_avatar.h"

#include <string>

namespace avatar {

/// Writes an avatar as binary glTF 2.0 (.glb) for every viewer and engine: the skeleton's joint
/// nodes (jointNames()) in filePose(), the skinned mesh node `body`, and one skinned mesh node per
/// garment, bound in the pose its mesh was made in, so that the mesh is its rest shape. What glTF
/// has no place for is in the nodes' extras (avatar_extras.h). A clip "turn" of the person on a
/// turntable, from that pose on, is for viewers and no part of the avatar.
///
/// Vertices, joints and skinning weights are float32 in the file and everything else is exact: an
/// avatar whose geometry is float32 already (makeAvatarBody(), limitedWeights()) is read back bit
/// by bit, vertex colours to 1e-6; and what was read writes the same bytes again. Written whole or
/// not at all. Throws std::invalid_argument for an avatar with a flaw (avatar_check.h), FileError
/// when the file can't be written.
void writeAvatar(const std::string& path, const LayeredAvatar& avatar);

/// Reads what writeAvatar() wrote. Throws FileError naming file and field for everything else:
/// missing, truncated or damaged files, another version, a glTF that is no avatar of simulcap,
/// parts that don't fit together (avatar_check.h).
LayeredAvatar readAvatar(const std::string& path);

}  // namespace avatar

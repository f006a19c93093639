#pragma once

#include "avatar/layered_avatar.h"

#include <optional>
#include <string>

namespace avatar {

/// Why an avatar is none.
struct AvatarFlaw {
  std::string field;    ///< such as "garment tshirt: pins"
  std::string problem;  ///< what was found and what is expected
};

/// The first thing that is wrong with an avatar: sizes that don't fit together, indices out of
/// range, values that are not finite or out of the ranges that layered_avatar.h and garment.h name,
/// names that occur twice. Nothing: every function may rely on those headers.
std::optional<AvatarFlaw> findFlaw(const LayeredAvatar& avatar);

/// Throws std::invalid_argument with the flaw, if there is one.
void requireValid(const LayeredAvatar& avatar);

}  // namespace avatar

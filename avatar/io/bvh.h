#pragma once

#include "avatar/recorded_motion.h"

#include <string>

namespace avatar {

/// Reads a Biovision hierarchy: any channel order, channels of any joint, end sites, tabs, CRLF.
/// A position channel replaces that component of the joint's OFFSET. Throws FileError naming the
/// line: wrong keyword, unbalanced braces, unknown channel, frame line of the wrong length, fewer
/// or more frames than declared, a value that is no finite number.
RecordedMotion readBvh(const std::string& path);
RecordedMotion parseBvh(const std::string& text, const std::string& nameForErrors);

}  // namespace avatar

#pragma once

#include <stdexcept>
#include <string>

namespace avatar {

/// A file that cannot be used. what() is one line: "FILE: FIELD: what is wrong and what to do".
/// `field` names a key, a line or a frame; leave it empty when the whole file is meant.
class FileError : public std::runtime_error {
 public:
  FileError(const std::string& file, const std::string& field, const std::string& problem)
      : std::runtime_error(file + ": " + (field.empty() ? "" : field + ": ") + problem) {}
};

}  // namespace avatar

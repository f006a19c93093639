#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace simulcap {

/// Counts what was wrong by kind and keeps the first place concerned.
class InputWarnings {
 public:
  /// `kind` reads well before "(3 times, first in FILE)".
  void add(std::string_view kind, std::string_view where);

  /// One line per kind, in the order of appearance.
  std::vector<std::string> lines() const;

  bool empty() const { return entries_.empty(); }

 private:
  struct Entry {
    std::string kind;
    std::string first;
    long count = 0;
  };

  std::vector<Entry> entries_;
};

}  // namespace simulcap

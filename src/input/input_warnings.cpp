#include "src/input/input_warnings.h"

#include <algorithm>

namespace simulcap {

void InputWarnings::add(std::string_view kind, std::string_view where) {
  auto entry = std::find_if(
      entries_.begin(), entries_.end(), [&](const Entry& e) { return e.kind == kind; });
  if (entry == entries_.end())
    entry = entries_.insert(entry, {std::string(kind), std::string(where), 0});
  ++entry->count;
}

std::vector<std::string> InputWarnings::lines() const {
  std::vector<std::string> result;
  for (const Entry& entry : entries_) {
    const bool once = entry.count == 1;
    result.push_back(
        entry.kind + (once ? " (" : " (" + std::to_string(entry.count) + " times, first in ") +
        entry.first + ")");
  }
  return result;
}

}  // namespace simulcap

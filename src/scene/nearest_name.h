#pragma once

#include <string>
#include <vector>

namespace simulcap {

/// "; did you mean stretch_k?" when one of the names is a typing mistake away from `name` (edits of
/// single characters and swaps of neighbours, one for every three characters), else "".
std::string didYouMean(const std::string& name, const std::vector<std::string>& names);

}  // namespace simulcap

#include "src/scene/nearest_name.h"

#include <algorithm>
#include <cstddef>

namespace simulcap {
namespace {

/// Optimal string alignment distance (Damerau 1964): insertions, deletions, substitutions and swaps
/// of neighbours.
int editDistance(const std::string& a, const std::string& b) {
  std::vector<std::vector<int>> d(a.size() + 1, std::vector<int>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i)
    d[i][0] = static_cast<int>(i);
  for (std::size_t j = 0; j <= b.size(); ++j)
    d[0][j] = static_cast<int>(j);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const int substitution = d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, substitution});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  }
  return d[a.size()][b.size()];
}

}  // namespace

std::string didYouMean(const std::string& name, const std::vector<std::string>& names) {
  constexpr std::size_t kLongestName = 64;
  if (name.empty() || name.size() > kLongestName)
    return "";
  int nearest = static_cast<int>(std::max<std::size_t>(1, name.size() / 3)) + 1;
  std::string answer;
  for (const std::string& candidate : names) {
    const int distance = editDistance(name, candidate);
    if (distance < nearest) {
      nearest = distance;
      answer = "; did you mean " + candidate + "?";
    }
  }
  return answer;
}

}  // namespace simulcap

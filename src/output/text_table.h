#pragma once

#include <string>
#include <vector>

namespace simulcap {

/// Rows of equally many cells as lines of text, columns as wide as their widest cell; the first to
/// the left, the others to the right.
std::string alignedColumns(const std::vector<std::vector<std::string>>& rows);

/// printf's %.<decimals>f and %.<digits>g.
std::string fixedText(double value, int decimals);
std::string roundedText(double value, int digits);

}  // namespace simulcap

#include "src/evaluation/jitter.h"

#include <cmath>
#include <cstddef>

namespace simulcap {

void Jitter::add(
    int number, const Eigen::Matrix3Xd& vertices, const std::vector<bool>& visible, bool still) {
  const bool follows = last_.cols() == vertices.cols() && number == lastNumber_ + 1;
  stillFrames_ = follows && still ? stillFrames_ + 1 : 0;
  if (stillFrames_ >= 2) {
    const Eigen::Matrix3Xd difference = vertices - 2.0 * last_ + beforeLast_;
    for (Eigen::Index v = 0; v < difference.cols(); ++v) {
      Sum& sum = lastVisible_[static_cast<std::size_t>(v)] ? visible_ : hidden_;
      sum.squares += difference.col(v).squaredNorm();
      ++sum.count;
    }
  }
  beforeLast_ = last_;
  last_ = vertices;
  lastVisible_ = visible;
  lastNumber_ = number;
}

double Jitter::visible() const {
  return visible_.count == 0 ? 0.0
                             : std::sqrt(visible_.squares / static_cast<double>(visible_.count));
}

double Jitter::hidden() const {
  return hidden_.count == 0 ? 0.0 : std::sqrt(hidden_.squares / static_cast<double>(hidden_.count));
}

Jitter& Jitter::operator+=(const Jitter& other) {
  visible_.squares += other.visible_.squares;
  visible_.count += other.visible_.count;
  hidden_.squares += other.hidden_.squares;
  hidden_.count += other.hidden_.count;
  return *this;
}

}  // namespace simulcap

#pragma once

#include "avatar/geometry/shading.h"
#include "src/digitization/parsing_description.h"

#include <memory>
#include <string>
#include <vector>

namespace simulcap {

/// A neural network that tells what the pixels of a picture of one person show (paper section 3;
/// formulation A7), run by OpenCV's dnn on the CPU: ONNX (.onnx), Caffe (.caffemodel with a
/// .prototxt of the same name beside it) or TensorFlow (.pb). One picture in, 1 × C × h × w scores
/// of C classes out, of any h and w; the last output counts when there are several.
class HumanParser {
 public:
  /// Tries the network on an empty picture. Throws avatar::FileError when there is none, it can't
  /// be read, or its input or output aren't as its description says.
  explicit HumanParser(const std::string& model);
  ~HumanParser();
  HumanParser(const HumanParser&) = delete;
  HumanParser& operator=(const HumanParser&) = delete;
  HumanParser(HumanParser&&) noexcept;
  HumanParser& operator=(HumanParser&&) noexcept;

  /// The class with the highest score in each pixel, row-major, of a picture of any size that a
  /// person about fills. Throws avatar::FileError when the network fails on it.
  std::vector<ParsingClass> operator()(const avatar::ColorImage& picture);

 private:
  class Network;
  std::unique_ptr<Network> network_;
};

}  // namespace simulcap

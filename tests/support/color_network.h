#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

namespace simulcap::test {

/// The few kinds of fields that ONNX's messages are made of (Protocol Buffers' wire format).
class ProtobufMessage {
 public:
  ProtobufMessage& number(unsigned field, std::uint64_t value) {
    varint(field << 3U);
    varint(value);
    return *this;
  }

  ProtobufMessage& bytes(unsigned field, const std::string& value) {
    varint(field << 3U | 2U);
    varint(value.size());
    data_ += value;
    return *this;
  }

  ProtobufMessage& message(unsigned field, const ProtobufMessage& value) {
    return bytes(field, value.data_);
  }

  const std::string& data() const { return data_; }

 private:
  void varint(std::uint64_t value) {
    for (; value >= 0x80U; value >>= 7U)
      data_ += static_cast<char>(value | 0x80U);
    data_ += static_cast<char>(value);
  }

  std::string data_;
};

/// TensorProto of floats.
inline ProtobufMessage onnxTensor(
    const std::string& name, const std::vector<int>& shape, const std::vector<float>& values) {
  ProtobufMessage tensor;
  for (const int size : shape)
    tensor.number(1, static_cast<std::uint64_t>(size));
  std::string raw(sizeof(float) * values.size(), '\0');
  std::memcpy(raw.data(), values.data(), raw.size());
  return tensor.number(2, 1).bytes(8, name).bytes(9, raw);
}

/// ValueInfoProto of a tensor of floats.
inline ProtobufMessage onnxValue(const std::string& name, const std::vector<int>& shape) {
  ProtobufMessage sizes;
  for (const int size : shape)
    sizes.message(1, ProtobufMessage().number(1, static_cast<std::uint64_t>(size)));
  const ProtobufMessage tensor = ProtobufMessage().number(1, 1).message(2, sizes);
  return ProtobufMessage().bytes(1, name).message(2, ProtobufMessage().message(1, tensor));
}

/// An ONNX network of one 1 × 1 convolution that scores pixels x by how near they are to each of N
/// colours c: −|x − c|² + |x|² = 2 c·x − |c|². 1 × 3 × S × S in, 1 × N × S × S out.
inline std::string nearestColorNetwork(const std::vector<Eigen::Vector3d>& colors, int size) {
  const auto count = static_cast<int>(colors.size());
  std::vector<float> weights, biases;
  for (const Eigen::Vector3d& color : colors) {
    for (const double channel : color)
      weights.push_back(static_cast<float>(2.0 * channel));
    biases.push_back(static_cast<float>(-color.squaredNorm()));
  }
  ProtobufMessage kernel;
  kernel.bytes(1, "kernel_shape").number(8, 1).number(8, 1).number(20, 7);
  ProtobufMessage convolution;
  convolution.bytes(1, "picture").bytes(1, "weights").bytes(1, "biases").bytes(2, "scores");
  convolution.bytes(3, "nearest").bytes(4, "Conv").message(5, kernel);
  ProtobufMessage graph;
  graph.message(1, convolution).bytes(2, "nearest_color");
  graph.message(5, onnxTensor("weights", {count, 3, 1, 1}, weights));
  graph.message(5, onnxTensor("biases", {count}, biases));
  graph.message(11, onnxValue("picture", {1, 3, size, size}));
  graph.message(12, onnxValue("scores", {1, count, size, size}));
  constexpr unsigned kOperators = 11;  // version of their set
  ProtobufMessage model;
  model.number(1, 6).message(7, graph).message(8, ProtobufMessage().number(2, kOperators));
  return model.data();
}

inline void writeBytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

}  // namespace simulcap::test

#include "bullet_ext/cloth_record.h"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <type_traits>
#include <utility>

namespace bullet_ext {
namespace {

constexpr std::int32_t kVersion = 2;
constexpr std::size_t kLongestName = 1000;

/// What a mesh is made from, and what of it can be changed after that.
struct Record {
  std::int32_t version = kVersion;
  std::string name;
  ClothMaterial material;
  Eigen::Matrix3Xd vertices;  ///< order of the input
  Eigen::Matrix3Xi faces;     ///< with the input's vertices, in the order of the mesh
  std::int32_t inputOrder = 0;
  std::vector<int> pins;   ///< the input's
  Eigen::VectorXd masses;  ///< order of the input
  Eigen::VectorXd springRestLengths, springStiffness, hingeRestAngles, hingeStiffness;
  Eigen::Matrix4Xf positions, velocities;  ///< solver order
};

/// FNV-1a, 64 bits.
std::uint64_t checksum(std::string_view bytes) {
  std::uint64_t sum = 14695981039346656037U;
  for (const char byte : bytes)
    sum = (sum ^ static_cast<unsigned char>(byte)) * 1099511628211U;
  return sum;
}

class Writer {
 public:
  template <typename T>

  requires(std::is_arithmetic_v<T> || std::is_enum_v<T>) void operator()(const T& value) {
    append(&value, sizeof value);
  }

  void operator()(const std::string& text) { array(text.data(), text.size()); }

  void operator()(const std::vector<int>& values) { array(values.data(), values.size()); }

  template <typename T, int Rows, int Columns>
  void operator()(const Eigen::Matrix<T, Rows, Columns>& matrix) {
    array(matrix.data(), static_cast<std::size_t>(matrix.size()));
  }

  std::string bytes;

 private:
  template <typename T>
  void array(const T* values, std::size_t count) {
    (*this)(static_cast<std::uint64_t>(count));
    append(values, count * sizeof(T));
  }

  void append(const void* data, std::size_t size) {
    bytes.append(static_cast<const char*>(data), size);
  }
};

class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}

  template <typename T>

  requires(std::is_arithmetic_v<T> || std::is_enum_v<T>) void operator()(T& value) {
    take(&value, sizeof value);
  }

  void operator()(std::string& text) {
    text.resize(count(1));
    take(text.data(), text.size());
  }

  void operator()(std::vector<int>& values) {
    values.resize(count(sizeof(int)));
    take(values.data(), values.size() * sizeof(int));
  }

  template <typename T, int Rows, int Columns>
  void operator()(Eigen::Matrix<T, Rows, Columns>& matrix) {
    const std::size_t size = count(sizeof(T));
    const std::size_t rows = Columns == 1 ? size : static_cast<std::size_t>(Rows);
    if (size % rows != 0 && size > 0)
      throw std::runtime_error("an array has an odd length");
    matrix.resize(
        static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(rows > 0 ? size / rows : 1));
    take(matrix.data(), size * sizeof(T));
  }

 private:
  std::size_t count(std::size_t elementSize) {
    std::uint64_t value = 0;
    (*this)(value);
    if (value > rest_.size() / elementSize)
      throw std::runtime_error("an array is cut off");
    return static_cast<std::size_t>(value);
  }

  void take(void* data, std::size_t size) {
    if (size > rest_.size())
      throw std::runtime_error("the data is cut off");
    if (size > 0)
      std::memcpy(data, rest_.data(), size);
    rest_.remove_prefix(size);
  }

  std::string_view rest_;
};

/// The order of things in the bytes, for both directions.
template <typename Archive, typename AnyRecord>
void visit(Archive& archive, AnyRecord& record) {
  archive(record.version);
  if (record.version != kVersion)
    throw std::runtime_error("it was written by another version of the program");
  archive(record.name);
  auto& material = record.material;
  archive(material.stretchStiffness);
  archive(material.torsionStiffness);
  archive(material.massMode);
  archive(material.vertexMass);
  archive(material.arealDensity);
  archive(material.dampingMode);
  archive(material.damping);
  archive(material.friction);
  archive(material.thickness);
  archive(material.limitCompressedTorsion);
  archive(record.vertices);
  archive(record.faces);
  archive(record.inputOrder);
  archive(record.pins);
  archive(record.masses);
  archive(record.springRestLengths);
  archive(record.springStiffness);
  archive(record.hingeRestAngles);
  archive(record.hingeStiffness);
  archive(record.positions);
  archive(record.velocities);
}

Record recordOf(const BulletFileCloth& cloth) {
  const ClothMesh& mesh = cloth.mesh;
  Record record;
  record.name = cloth.name;
  record.material = mesh.material;
  record.vertices = toInputOrder(mesh, mesh.restPositions);
  record.faces = mesh.faces.unaryExpr(
      [&mesh](int v) { return mesh.inputFromSolver[static_cast<std::size_t>(v)]; });
  record.inputOrder = 1;
  for (std::size_t i = 0; i < mesh.inputFromSolver.size(); ++i) {
    if (mesh.inputFromSolver[i] != static_cast<int>(i))
      record.inputOrder = 0;
  }
  for (const int pin : mesh.pins)
    record.pins.push_back(mesh.inputFromSolver[static_cast<std::size_t>(pin)]);
  record.masses = toInputOrder(mesh, Eigen::RowVectorXd(mesh.masses.transpose())).transpose();
  record.springRestLengths = mesh.springRestLengths;
  record.springStiffness = mesh.springStiffness;
  record.hingeRestAngles = mesh.hingeRestAngles;
  record.hingeStiffness = mesh.hingeStiffness;
  record.positions = cloth.state.positions;
  record.velocities = cloth.state.velocities;
  return record;
}

template <typename Matrix>
void restore(Matrix& target, const Matrix& values, const char* what) {
  if (values.size() != target.size() || !values.allFinite())
    throw std::runtime_error(std::string("its ") + what + " don't fit its mesh");
  target = values;
}

void requireEnumerators(const ClothMaterial& material) {
  if (material.massMode > MassMode::kAreal || material.massMode < MassMode::kPerVertex ||
      material.dampingMode > DampingMode::kPerSubstep ||
      material.dampingMode < DampingMode::kPerSecond)
    throw std::runtime_error("its material has an unknown mode");
}

BulletFileCloth clothOf(const Record& record) {
  requireEnumerators(record.material);
  ClothMeshOptions options;
  options.pins = record.pins;
  options.vertexMasses.assign(record.masses.data(), record.masses.data() + record.masses.size());
  options.vertexOrder = record.inputOrder != 0 ? VertexOrder::kInput : VertexOrder::kMorton;
  BulletFileCloth cloth;
  cloth.name = record.name;
  cloth.mesh = buildClothMesh(record.vertices, record.faces, record.material, options);
  restore(cloth.mesh.springRestLengths, record.springRestLengths, "rest lengths");
  restore(cloth.mesh.springStiffness, record.springStiffness, "stretch stiffnesses");
  restore(cloth.mesh.hingeRestAngles, record.hingeRestAngles, "rest angles");
  restore(cloth.mesh.hingeStiffness, record.hingeStiffness, "torsion stiffnesses");
  cloth.state = restState(cloth.mesh);
  restore(cloth.state.positions, record.positions, "positions");
  restore(cloth.state.velocities, record.velocities, "velocities");
  return cloth;
}

}  // namespace

std::string packCloth(const BulletFileCloth& cloth) {
  const Eigen::Index count = cloth.mesh.numVertices();
  if (cloth.state.positions.cols() != count || cloth.state.velocities.cols() != count ||
      !isFinite(cloth.state))
    throw std::invalid_argument("cloth " + cloth.name + ": the state doesn't fit the mesh");
  if (cloth.name.size() > kLongestName)
    throw std::invalid_argument("cloth: a name has at most 1000 bytes");
  Writer content;
  const Record record = recordOf(cloth);
  visit(content, record);
  Writer packed;
  packed(checksum(content.bytes));
  packed(content.bytes);
  packed.bytes.resize((packed.bytes.size() + 3) / 4 * 4, '\0');
  return std::move(packed.bytes);
}

BulletFileCloth unpackCloth(std::string_view bytes) {
  Reader packed(bytes);
  std::uint64_t expected = 0;
  std::string content;
  packed(expected);
  packed(content);
  if (checksum(content) != expected)
    throw std::runtime_error("its checksum is wrong");
  Reader reader(content);
  Record record;
  visit(reader, record);
  return clothOf(record);
}

}  // namespace bullet_ext

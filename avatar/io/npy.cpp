#include "avatar/io/npy.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>
#include <type_traits>

namespace avatar {
namespace {

static_assert(
    std::endian::native == std::endian::little,
    "arrays are kept as the file's little-endian bytes");

using Type = NpyArray::Type;

struct TypeInfo {
  Type type;
  std::string_view code;  ///< numpy's kind and size without the byte order
  std::int64_t itemSize;  ///< [bytes]; 0 for text, whose size is per array
};

constexpr std::int64_t kMaxEmptyItems = 1 << 10;

constexpr std::array<TypeInfo, 11> kNumberTypes = {{
    {Type::kFloat32, "f4", 4},
    {Type::kFloat64, "f8", 8},
    {Type::kInt8, "i1", 1},
    {Type::kInt16, "i2", 2},
    {Type::kInt32, "i4", 4},
    {Type::kInt64, "i8", 8},
    {Type::kUint8, "u1", 1},
    {Type::kUint16, "u2", 2},
    {Type::kUint32, "u4", 4},
    {Type::kUint64, "u8", 8},
    {Type::kBool, "b1", 1},
}};

const TypeInfo& numberInfo(Type type) {
  for (const TypeInfo& info : kNumberTypes) {
    if (info.type == type) {
      return info;
    }
  }
  throw std::invalid_argument("a text array has no numbers");
}

/// Calls `use` with a value of the C++ type that stands behind `type`.
template <typename Use>
auto withNumberType(Type type, Use use) {
  switch (type) {
    case Type::kFloat32:
      return use(float{});
    case Type::kFloat64:
      return use(double{});
    case Type::kInt8:
      return use(std::int8_t{});
    case Type::kInt16:
      return use(std::int16_t{});
    case Type::kInt32:
      return use(std::int32_t{});
    case Type::kInt64:
      return use(std::int64_t{});
    case Type::kUint8:
    case Type::kBool:
      return use(std::uint8_t{});
    case Type::kUint16:
      return use(std::uint16_t{});
    case Type::kUint32:
      return use(std::uint32_t{});
    case Type::kUint64:
      return use(std::uint64_t{});
    case Type::kText:
      break;
  }
  throw std::invalid_argument("a text array has no numbers");
}

template <typename Scalar>
double loadAs(const std::uint8_t* bytes) {
  Scalar value;
  std::memcpy(&value, bytes, sizeof(Scalar));
  return static_cast<double>(value);
}

template <typename Scalar>
void storeAs(double value, std::uint8_t* bytes) {
  Scalar stored{};
  if constexpr (std::is_floating_point_v<Scalar>) {
    stored = static_cast<Scalar>(value);
  } else if (!std::isnan(value)) {
    constexpr auto kLowest = static_cast<double>(std::numeric_limits<Scalar>::lowest());
    constexpr auto kHighest = static_cast<double>(std::numeric_limits<Scalar>::max());
    const double rounded = std::nearbyint(value);
    // kHighest of 64-bit types rounds up to 2^63 or 2^64, which doesn't fit: hence ≥.
    stored = rounded >= kHighest  ? std::numeric_limits<Scalar>::max()
             : rounded <= kLowest ? std::numeric_limits<Scalar>::lowest()
                                  : static_cast<Scalar>(rounded);
  }
  std::memcpy(bytes, &stored, sizeof(Scalar));
}

/// Product of the shape, or −1 when it doesn't fit 63 bits.
std::int64_t checkedProduct(const std::vector<std::int64_t>& shape) {
  std::int64_t product = 1;
  bool overflow = false;
  for (const std::int64_t extent : shape) {
    overflow = overflow || extent < 0 || __builtin_mul_overflow(product, extent, &product);
  }
  return overflow ? -1 : product;
}

/// Where the header's text begins [bytes]: after mark, version and its length.
std::size_t headerTextOffset(std::span<const std::uint8_t> start) {
  constexpr std::array<std::uint8_t, 6> kMagic = {0x93, 'N', 'U', 'M', 'P', 'Y'};
  if (start.size() < 10 || !std::equal(kMagic.begin(), kMagic.end(), start.begin())) {
    throw NpyFormatError("is no .npy array (the NUMPY mark at its start is missing)");
  }
  const int version = start[6];
  if (version < 1 || version > 3) {
    throw NpyFormatError(
        "has .npy format version " + std::to_string(version) + "; supported are 1, 2 and 3");
  }
  return version == 1 ? 10 : 12;
}

/// Walks the items of a Fortran-ordered array (first axis fastest) in C order.
class FortranWalk {
 public:
  explicit FortranWalk(const std::vector<std::int64_t>& shape)
      : shape_(shape), index_(shape.size(), 0), strides_(shape.size(), 1) {
    for (std::size_t axis = 1; axis < shape.size(); ++axis) {
      strides_[axis] = strides_[axis - 1] * shape[axis - 1];
    }
  }

  std::int64_t item() const { return item_; }

  void advance() {
    for (std::size_t axis = shape_.size(); axis-- > 0;) {
      item_ += strides_[axis];
      if (++index_[axis] < shape_[axis]) {
        return;
      }
      item_ -= strides_[axis] * shape_[axis];
      index_[axis] = 0;
    }
  }

 private:
  std::vector<std::int64_t> shape_;
  std::vector<std::int64_t> index_;
  std::vector<std::int64_t> strides_;
  std::int64_t item_ = 0;
};

std::vector<std::uint8_t> fortranToC(
    const std::vector<std::uint8_t>& data,
    const std::vector<std::int64_t>& shape,
    std::int64_t itemSize) {
  std::vector<std::uint8_t> result;
  result.reserve(data.size());
  FortranWalk walk(shape);
  while (result.size() < data.size()) {
    const auto item = data.begin() + walk.item() * itemSize;
    result.insert(result.end(), item, item + itemSize);
    walk.advance();
  }
  return result;
}

void appendUtf8(char32_t point, std::vector<std::uint8_t>& text) {
  const auto byte = [&](char32_t value) { text.push_back(static_cast<std::uint8_t>(value)); };
  if (point < 0x80) {
    byte(point);
  } else if (point < 0x800) {
    byte(0xC0 | (point >> 6));
    byte(0x80 | (point & 0x3F));
  } else if (point < 0x10000) {
    byte(0xE0 | (point >> 12));
    byte(0x80 | ((point >> 6) & 0x3F));
    byte(0x80 | (point & 0x3F));
  } else if (point < 0x110000) {
    byte(0xF0 | (point >> 18));
    byte(0x80 | ((point >> 12) & 0x3F));
    byte(0x80 | ((point >> 6) & 0x3F));
    byte(0x80 | (point & 0x3F));
  } else {
    throw NpyFormatError("holds a character outside Unicode; the file is damaged");
  }
}

std::vector<char32_t> decodeUtf8(const std::uint8_t* begin, const std::uint8_t* end) {
  std::vector<char32_t> points;
  while (begin < end) {
    const std::uint8_t lead = *begin++;
    const int following = lead < 0xC0 ? 0 : lead < 0xE0 ? 1 : lead < 0xF0 ? 2 : 3;
    char32_t point = following == 0 ? lead : lead & (0x3F >> following);
    for (int i = 0; i < following && begin < end; ++i) {
      point = (point << 6) | (*begin++ & 0x3F);
    }
    points.push_back(point);
  }
  return points;
}

/// numpy pads fixed-length strings with zeros; ours end at the first one.
std::vector<std::uint8_t> textBytes(
    const std::vector<std::uint8_t>& data, std::int64_t count, std::int64_t itemSize, char kind) {
  const std::int64_t width = kind == 'U' ? 4 : 1;
  const auto pointAt = [&](std::int64_t offset) {
    std::uint32_t point = 0;
    std::copy_n(data.begin() + offset, width, reinterpret_cast<std::uint8_t*>(&point));
    return point;
  };
  std::vector<std::uint8_t> text;
  for (std::int64_t item = 0; item < count; ++item) {
    const std::int64_t end = (item + 1) * itemSize;
    for (std::int64_t at = item * itemSize; at < end && pointAt(at) != 0; at += width) {
      appendUtf8(pointAt(at), text);
    }
    text.push_back(0);
  }
  return text;
}

struct Dtype {
  Type type = Type::kFloat64;
  std::int64_t itemSize = 0;  ///< [bytes]
  std::int64_t wordSize = 1;  ///< [bytes] that a big-endian file swaps
  bool bigEndian = false;
  char kind = ' ';
};

std::int64_t textItemSize(std::string_view digits, std::int64_t width) {
  std::int64_t length = 0;
  constexpr std::int64_t kMaxLength = 1 << 24;
  for (const char digit : digits) {
    if (digit < '0' || digit > '9' || length > kMaxLength) {
      throw NpyFormatError("has a damaged text dtype");
    }
    length = 10 * length + (digit - '0');
  }
  return length * width;
}

Dtype parseDtype(const std::string& descr) {
  const bool hasOrder = std::string_view("<>|=").find(descr[0]) != std::string_view::npos;
  const std::string code = hasOrder ? descr.substr(1) : descr;
  Dtype dtype;
  dtype.bigEndian = descr[0] == '>';
  dtype.kind = code.empty() ? ' ' : code[0];
  if (dtype.kind == 'O') {
    throw NpyFormatError(
        "holds Python objects (dtype object), which only Python can load; convert it in Python to "
        "an array of numbers (numpy.asarray(x, dtype=float)) and save again");
  }
  if (dtype.kind == 'U' || dtype.kind == 'S') {
    dtype.type = Type::kText;
    dtype.wordSize = dtype.kind == 'U' ? 4 : 1;
    dtype.itemSize = textItemSize(std::string_view(code).substr(1), dtype.wordSize);
    return dtype;
  }
  for (const TypeInfo& info : kNumberTypes) {
    if (info.code == code) {
      dtype.type = info.type;
      dtype.itemSize = dtype.wordSize = info.itemSize;
      return dtype;
    }
  }
  throw NpyFormatError(
      "has the dtype '" + descr +
      "'; expected a float of 32 or 64 bits, an integer, a bool or text: convert with astype()");
}

void swapWords(std::vector<std::uint8_t>& data, std::int64_t wordSize) {
  for (auto word = data.begin(); word != data.end(); word += wordSize) {
    std::reverse(word, word + wordSize);
  }
}

}  // namespace

std::int64_t NpyArray::size() const {
  const std::int64_t product = checkedProduct(shape);
  if (product < 0) {
    throw std::invalid_argument("NpyArray: impossible shape " + shapeText());
  }
  return product;
}

std::string NpyArray::shapeText() const {
  std::string text = "(";
  for (std::size_t axis = 0; axis < shape.size(); ++axis) {
    text += (axis > 0 ? ", " : "") + std::to_string(shape[axis]);
  }
  return text + (shape.size() == 1 ? ",)" : ")");
}

double NpyArray::at(std::int64_t i) const {
  const std::int64_t itemSize = numberInfo(type).itemSize;
  if (i < 0 || i >= static_cast<std::int64_t>(bytes.size()) / itemSize) {
    throw std::out_of_range("NpyArray::at: " + std::to_string(i) + " of " + shapeText());
  }
  return withNumberType(
      type, [&](auto number) { return loadAs<decltype(number)>(bytes.data() + i * itemSize); });
}

Eigen::MatrixXd NpyArray::asMatrix() const {
  const std::int64_t count = size();
  const std::int64_t itemSize = numberInfo(type).itemSize;
  if (count * itemSize != static_cast<std::int64_t>(bytes.size())) {
    throw std::invalid_argument("NpyArray: bytes don't fit the shape " + shapeText());
  }
  const std::int64_t rows = shape.empty() ? 1 : shape[0];
  // An array without elements keeps its other extents: (0, 3) is 0 × 3.
  const std::int64_t columns = shape.empty() ? 1 : checkedProduct({shape.begin() + 1, shape.end()});
  Eigen::MatrixXd matrix(rows, std::max<std::int64_t>(columns, 0));
  withNumberType(type, [&](auto number) {
    for (std::int64_t i = 0; i < count; ++i) {
      const auto value = loadAs<decltype(number)>(bytes.data() + i * itemSize);
      matrix(i / matrix.cols(), i % matrix.cols()) = value;
    }
  });
  return matrix;
}

std::string NpyArray::asText() const {
  if (type != Type::kText || size() != 1 || bytes.empty()) {
    throw std::invalid_argument("NpyArray: one text expected, found shape " + shapeText());
  }
  return {bytes.begin(), bytes.end() - 1};
}

NpyArray NpyArray::fromMatrix(const Eigen::MatrixXd& matrix, Type type) {
  const std::int64_t itemSize = numberInfo(type).itemSize;
  NpyArray array;
  array.type = type;
  array.shape = {matrix.rows(), matrix.cols()};
  array.bytes.resize(static_cast<std::size_t>(matrix.size() * itemSize));
  withNumberType(type, [&](auto number) {
    for (Eigen::Index i = 0; i < matrix.size(); ++i) {
      const double value = matrix(i / matrix.cols(), i % matrix.cols());
      storeAs<decltype(number)>(value, array.bytes.data() + i * itemSize);
    }
  });
  return array;
}

NpyArray NpyArray::fromText(const std::string& text) {
  NpyArray array;
  array.type = Type::kText;
  array.bytes.assign(text.begin(), text.end());
  array.bytes.push_back(0);
  return array;
}

std::size_t npyDataOffset(std::span<const std::uint8_t> start) {
  const std::size_t textOffset = headerTextOffset(start);
  std::size_t length = 0;
  for (std::size_t i = 8; i < std::min(textOffset, start.size()); ++i) {
    length |= static_cast<std::size_t>(start[i]) << (8 * (i - 8));
  }
  return textOffset + length;
}

NpyHeader npyHeader(std::span<const std::uint8_t> start) {
  const std::size_t begin = headerTextOffset(start);
  const std::size_t end = npyDataOffset(start);
  if (end > start.size()) {
    throw NpyFormatError("is truncated inside the array header");
  }
  return parseNpyHeader({reinterpret_cast<const char*>(start.data()) + begin, end - begin});
}

NpyArray npyArray(const NpyHeader& header, std::vector<std::uint8_t> data) {
  const Dtype dtype = parseDtype(header.descr);
  NpyArray array;
  array.type = dtype.type;
  array.shape = header.shape;
  const std::int64_t count = checkedProduct(header.shape);
  std::int64_t numBytes = 0;
  const auto available = static_cast<std::int64_t>(data.size());
  // Text of no characters has no bytes: its count must not outgrow the file either.
  if (count < 0 || __builtin_mul_overflow(count, dtype.itemSize, &numBytes) ||
      numBytes != available || (dtype.itemSize == 0 && count > kMaxEmptyItems)) {
    throw NpyFormatError(
        "says shape " + array.shapeText() + " of '" + header.descr + "' but holds " +
        std::to_string(available) + " bytes; the file is truncated or damaged");
  }
  array.bytes = std::move(data);
  if (header.fortranOrder) {
    array.bytes = fortranToC(array.bytes, array.shape, dtype.itemSize);
  }
  if (dtype.bigEndian) {
    swapWords(array.bytes, dtype.wordSize);
  }
  if (dtype.type == Type::kText) {
    array.bytes = textBytes(array.bytes, count, dtype.itemSize, dtype.kind);
  }
  return array;
}

NpyArray parseNpy(const std::vector<std::uint8_t>& file) {
  const NpyHeader header = npyHeader(file);
  return npyArray(header, {file.begin() + npyDataOffset(file), file.end()});
}

namespace {

struct TextItems {
  std::int64_t length = 1;  ///< characters per item
  std::vector<std::uint8_t> bytes;
};

/// Zero-terminated UTF-8 back to numpy's fixed-length UCS-4 items.
TextItems ucs4Items(const NpyArray& array) {
  std::vector<std::vector<char32_t>> items;
  TextItems result;
  auto begin = array.bytes.begin();
  for (auto end = array.bytes.begin(); end != array.bytes.end(); ++end) {
    if (*end == 0) {
      items.push_back(decodeUtf8(&*begin, &*end));
      begin = end + 1;
      result.length = std::max<std::int64_t>(result.length, items.back().size());
    }
  }
  if (static_cast<std::int64_t>(items.size()) != array.size()) {
    throw std::invalid_argument("NpyArray: texts don't fit the shape " + array.shapeText());
  }
  result.bytes.resize(items.size() * result.length * sizeof(char32_t));
  for (std::size_t i = 0; i < items.size(); ++i) {
    const auto* characters = reinterpret_cast<const std::uint8_t*>(items[i].data());
    std::copy_n(
        characters,
        items[i].size() * sizeof(char32_t),
        result.bytes.begin() + i * result.length * sizeof(char32_t));
  }
  return result;
}

std::vector<std::uint8_t> headerBytes(
    const std::string& descr, const std::string& shapeText, std::size_t minBytes = 0) {
  // numpy aligns the data to 64 bytes and ends the header with a newline.
  constexpr std::size_t kAlignment = 64;
  std::string text =
      "{'descr': '" + descr + "', 'fortran_order': False, 'shape': " + shapeText + ", }";
  text.append(kAlignment - (10 + text.size() + 1) % kAlignment, ' ');
  while (10 + text.size() + 1 < minBytes)
    text.append(kAlignment, ' ');
  text += '\n';
  std::vector<std::uint8_t> bytes = {0x93, 'N', 'U', 'M', 'P', 'Y', 1, 0};
  bytes.push_back(static_cast<std::uint8_t>(text.size() & 0xFF));
  bytes.push_back(static_cast<std::uint8_t>(text.size() >> 8));
  bytes.insert(bytes.end(), text.begin(), text.end());
  return bytes;
}

}  // namespace

std::vector<std::uint8_t> formatNpy(const NpyArray& array) {
  constexpr std::size_t kMaxAxes = 32;
  if (array.shape.size() > kMaxAxes) {
    throw std::invalid_argument("NpyArray: more than 32 axes");
  }
  if (array.type == Type::kText) {
    const TextItems items = ucs4Items(array);
    auto file = headerBytes("<U" + std::to_string(items.length), array.shapeText());
    file.insert(file.end(), items.bytes.begin(), items.bytes.end());
    return file;
  }
  if (array.size() * numberInfo(array.type).itemSize !=
      static_cast<std::int64_t>(array.bytes.size())) {
    throw std::invalid_argument("NpyArray: bytes don't fit the shape " + array.shapeText());
  }
  auto file = formatNpyHeader(array);
  file.insert(file.end(), array.bytes.begin(), array.bytes.end());
  return file;
}

std::size_t itemBytes(NpyArray::Type type) {
  return static_cast<std::size_t>(numberInfo(type).itemSize);
}

std::vector<std::uint8_t> formatNpyHeader(const NpyArray& array, std::size_t minBytes) {
  const TypeInfo& info = numberInfo(array.type);
  const std::string order = info.itemSize == 1 ? "|" : "<";
  return headerBytes(order + std::string(info.code), array.shapeText(), minBytes);
}

}  // namespace avatar

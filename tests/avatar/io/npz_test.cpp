#include "avatar/io/npz.h"

#include "avatar/io/file_error.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>
#include <zip.h>

#include <cstring>
#include <fstream>
#include <sstream>

namespace avatar {
namespace {

using test::TemporaryFolder;
using Type = NpyArray::Type;

std::string readBytes(const std::string& path) {
  std::ostringstream bytes;
  bytes << std::ifstream(path, std::ios::binary).rdbuf();
  return bytes.str();
}

/// A .npy file of version 1 with this header and these data.
std::string npyFile(const std::string& header, const std::string& data) {
  std::string file = std::string("\x93NUMPY\x01\x00", 8);
  file += static_cast<char>(header.size() & 0xFF);
  file += static_cast<char>(header.size() >> 8);
  return file + header + data;
}

std::string headerText(
    const std::string& descr, const std::string& order, const std::string& shape) {
  return "{'descr': " + descr + ", 'fortran_order': " + order + ", 'shape': " + shape + ", }   \n";
}

/// Puts raw files into a zip archive, as another program would.
void writeZip(const std::string& path, const std::map<std::string, std::string>& files) {
  int code = 0;
  zip_t* archive = zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &code);
  ASSERT_NE(archive, nullptr);
  for (const auto& [name, bytes] : files) {
    zip_source_t* source = zip_source_buffer(archive, bytes.data(), bytes.size(), 0);
    ASSERT_GE(zip_file_add(archive, name.c_str(), source, 0), 0);
  }
  ASSERT_EQ(zip_close(archive), 0);
}

template <typename T>
std::string rawBytes(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

/// The message of the FileError that reading the file must throw.
std::string readingError(const std::string& path) {
  try {
    readNpz(path);
  } catch (const FileError& error) {
    return error.what();
  }
  return "";
}

/// Reads an archive whose one array "x" is this .npy file.
NpyArray readOne(const std::string& npy) {
  const TemporaryFolder folder;
  const std::string path = folder.path("x.npz");
  writeZip(path, {{"x.npy", npy}});
  return readNpz(path).at("x");
}

std::string errorOfOne(const std::string& npy) {
  const TemporaryFolder folder;
  const std::string path = folder.path("x.npz");
  writeZip(path, {{"x.npy", npy}});
  std::string message = readingError(path);
  EXPECT_EQ(message.rfind(path + ": x: ", 0), 0U) << "must name file and key: " << message;
  return message;
}

constexpr Type kNumberTypes[] = {
    Type::kFloat32,
    Type::kFloat64,
    Type::kInt8,
    Type::kInt16,
    Type::kInt32,
    Type::kInt64,
    Type::kUint8,
    Type::kUint16,
    Type::kUint32,
    Type::kUint64,
    Type::kBool};

TEST(Npz, EveryNumberTypeSurvivesTheRoundTrip) {
  const TemporaryFolder folder;
  Eigen::MatrixXd matrix(2, 3);
  matrix << 0, 1, 2, 3, 100, 127;
  NpzArrays written;
  for (const Type type : kNumberTypes) {
    written[std::to_string(static_cast<int>(type))] = NpyArray::fromMatrix(matrix, type);
  }
  writeNpz(folder.path("a.npz"), written);
  const NpzArrays read = readNpz(folder.path("a.npz"));
  ASSERT_EQ(read.size(), written.size());
  for (const auto& [key, array] : written) {
    EXPECT_EQ(read.at(key).type, array.type) << key;
    EXPECT_EQ(read.at(key).shape, array.shape) << key;
    EXPECT_EQ(read.at(key).asMatrix(), matrix) << key;
    EXPECT_EQ(read.at(key).at(3), 3.0) << key;
  }
}

TEST(Npz, TextSurvivesTheRoundTripWithItsAccents) {
  const TemporaryFolder folder;
  writeNpz(
      folder.path("a.npz"),
      {{"empty", NpyArray::fromText("")}, {"text", NpyArray::fromText("Zoë ≤ 𝄞")}});
  const NpzArrays read = readNpz(folder.path("a.npz"));
  EXPECT_EQ(read.at("text").asText(), "Zoë ≤ 𝄞");
  EXPECT_EQ(read.at("empty").asText(), "");
}

TEST(Npz, ScalarVectorAndEmptyShapesAreKept) {
  const TemporaryFolder folder;
  NpyArray scalar = NpyArray::fromMatrix(Eigen::MatrixXd::Constant(1, 1, 30.0));
  scalar.shape = {};
  NpyArray vector = NpyArray::fromMatrix(Eigen::MatrixXd::Constant(4, 1, 2.0), Type::kFloat32);
  vector.shape = {4};
  writeNpz(
      folder.path("a.npz"),
      {{"s", scalar}, {"v", vector}, {"e", NpyArray::fromMatrix(Eigen::MatrixXd(0, 3))}});
  const NpzArrays read = readNpz(folder.path("a.npz"));
  EXPECT_TRUE(read.at("s").shape.empty());
  EXPECT_EQ(read.at("s").asMatrix()(0, 0), 30.0);
  EXPECT_EQ(read.at("s").shapeText(), "()");
  EXPECT_EQ(read.at("v").shapeText(), "(4,)");
  EXPECT_EQ(read.at("v").asMatrix(), Eigen::MatrixXd::Constant(4, 1, 2.0));
  EXPECT_EQ(read.at("e").asMatrix().cols(), 3);
}

TEST(Npz, SameArraysGiveSameBytes) {
  const TemporaryFolder folder;
  const NpzArrays arrays = {
      {"b", NpyArray::fromMatrix(Eigen::MatrixXd::Random(20, 3))}, {"a", NpyArray::fromText("x")}};
  writeNpz(folder.path("1.npz"), arrays);
  // A zip entry's date has a resolution of 2 s; the fixed date is checked directly below.
  writeNpz(folder.path("2.npz"), arrays);
  const std::string bytes = readBytes(folder.path("1.npz"));
  EXPECT_EQ(bytes, readBytes(folder.path("2.npz")));
  // Local header: time at offset 10, date at offset 12; 1980-01-01 is day 1 of month 1 of year 0.
  EXPECT_EQ(bytes.substr(10, 4), std::string("\x00\x00\x21\x00", 4));
}

TEST(Npz, FortranOrderIsConvertedForAnyNumberOfAxes) {
  const std::vector<std::int16_t> columns = {0, 10, 1, 11, 2, 12};
  const NpyArray flat = readOne(npyFile(headerText("'<i2'", "True", "(2, 3)"), rawBytes(columns)));
  Eigen::MatrixXd expected(2, 3);
  expected << 0, 1, 2, 10, 11, 12;
  EXPECT_EQ(flat.asMatrix(), expected);

  // Element (i, j, k) holds 100 i + 10 j + k.
  std::vector<std::int32_t> values(24);
  for (int n = 0; n < 24; ++n) {
    values[n] = (100 * (n % 2) + 10 * (n / 2 % 3) + n / 6);
  }
  const NpyArray cube =
      readOne(npyFile(headerText("'<i4'", "True", "(2, 3, 4)"), rawBytes(values)));
  EXPECT_EQ(cube.at(0), 0.0);
  EXPECT_EQ(cube.at(3), 3.0);
  EXPECT_EQ(cube.at(4), 10.0);
  EXPECT_EQ(cube.at(12), 100.0);
  EXPECT_EQ(cube.at(23), 123.0);
}

TEST(Npz, BigEndianIsConverted) {
  const std::string data("\x01\x02\xFF\xFE", 4);
  const NpyArray array = readOne(npyFile(headerText("'>i2'", "False", "(2,)"), data));
  EXPECT_EQ(array.at(0), 258.0);
  EXPECT_EQ(array.at(1), -2.0);
}

TEST(Npz, ReadsWhatOtherVersionsOfNumpyWrite) {
  // Python 2's long extents, double quotes, another order of entries.
  const std::string header = "{\"shape\": (2L,), \"fortran_order\": False, \"descr\": \"|b1\"}\n";
  EXPECT_EQ(readOne(npyFile(header, std::string("\x01\x00", 2))).at(0), 1.0);
  // Versions 2 and 3 have a header length of 4 bytes.
  const std::string text = headerText("'|S4'", "False", "()");
  for (const char version : {'\x02', '\x03'}) {
    std::string file = std::string("\x93NUMPY", 6) + version + '\0';
    file += static_cast<char>(text.size());
    file += std::string("\0\0\0", 3) + text + "male";
    EXPECT_EQ(readOne(file).asText(), "male");
  }
}

TEST(Npz, RefusesWhatItCannotReadAndSaysWhatToDo) {
  const std::string data(24, '\1');
  const auto error = [&](const std::string& descr, const std::string& shape) {
    return errorOfOne(npyFile(headerText(descr, "False", shape), data));
  };
  EXPECT_NE(error("'|O'", "(3,)").find("Python objects"), std::string::npos);
  EXPECT_NE(error("'<c16'", "(1,)").find("astype"), std::string::npos);
  EXPECT_NE(error("'<f2'", "(12,)").find("astype"), std::string::npos);
  EXPECT_NE(error("''", "(3,)").find("header"), std::string::npos);
  EXPECT_NE(error("'<'", "(3,)").find("dtype"), std::string::npos);
  EXPECT_NE(error("[('a', '<f8')]", "(3,)").find("structured"), std::string::npos);
  EXPECT_NE(error("'<f8'", "(4,)").find("holds 24 bytes"), std::string::npos);
  EXPECT_NE(error("'<f8'", "(2,)").find("holds 24 bytes"), std::string::npos);
  EXPECT_NE(error("'<f8'", "(-3,)").find("extent"), std::string::npos);
  EXPECT_NE(error("'<f8'", "(3").find("damaged"), std::string::npos);
}

TEST(Npz, RefusesAbsurdShapesWithoutAllocatingThem) {
  // 2^62 elements of 8 bytes, a product that overflows 64 bits to 0, and text of no length.
  for (const char* shape :
       {"(4611686018427387904,)", "(4294967296, 4294967296)", "(99999999999999999999,)"}) {
    for (const char* descr : {"'<f8'", "'|u1'", "'<U0'", "'|S0'", "'<U99999999999'"}) {
      EXPECT_FALSE(errorOfOne(npyFile(headerText(descr, "True", shape), "")).empty()) << shape;
    }
  }
}

TEST(Npz, RefusesFilesThatAreNoNpz) {
  const TemporaryFolder folder;
  EXPECT_NE(readingError(folder.path("none.npz")).find("none.npz"), std::string::npos);
  EXPECT_FALSE(readingError(folder.path()).empty());
  std::ofstream(folder.path("empty.npz")).flush();
  EXPECT_FALSE(readingError(folder.path("empty.npz")).empty());
  std::ofstream(folder.path("text.npz")) << std::string(500, 'x');
  EXPECT_NE(readingError(folder.path("text.npz")).find("zip"), std::string::npos);
  writeZip(folder.path("other.npz"), {{"readme.txt", "hello"}});
  EXPECT_NE(readingError(folder.path("other.npz")).find("no arrays"), std::string::npos);
  EXPECT_NE(errorOfOne("hello world, I am no array").find("NUMPY"), std::string::npos);
}

TEST(Npz, KeysSelectArraysSoThatObjectsBesideThemDoNotMatter) {
  const TemporaryFolder folder;
  const std::string path = folder.path("a.npz");
  writeZip(
      path,
      {{"good.npy", npyFile(headerText("'<f4'", "False", "()"), std::string(4, '\0'))},
       {"pickle.npy", npyFile(headerText("'|O'", "False", "()"), "....")}});
  EXPECT_EQ(readNpz(path, {"good", "absent"}).size(), 1U);
  EXPECT_THROW(readNpz(path, {"pickle"}), FileError);
  EXPECT_THROW(readNpz(path), FileError);
}

TEST(Npz, WritingIsRefusedOrWhole) {
  const TemporaryFolder folder;
  const NpzArrays arrays = {{"a", NpyArray::fromText("x")}};
  EXPECT_THROW(writeNpz(folder.path("absent/a.npz"), arrays), FileError);
  EXPECT_THROW(writeNpz(folder.path("a.npz"), {}), std::invalid_argument);
  NpyArray wrong = NpyArray::fromMatrix(Eigen::MatrixXd::Zero(2, 2));
  wrong.shape = {3, 3};
  writeNpz(folder.path("a.npz"), arrays);
  EXPECT_THROW(writeNpz(folder.path("a.npz"), {{"w", wrong}}), std::invalid_argument);
  EXPECT_EQ(readNpz(folder.path("a.npz")).at("a").asText(), "x") << "the old file must survive";
}

TEST(Npz, IntegersSaturateInsteadOfOverflowing) {
  Eigen::MatrixXd values(1, 4);
  values << -1e30, 1e30, 2.6, std::nan("");
  for (const Type type : {Type::kInt8, Type::kUint32, Type::kInt64, Type::kUint64}) {
    const NpyArray array = NpyArray::fromMatrix(values, type);
    EXPECT_LE(array.at(0), 0.0);
    EXPECT_GE(array.at(1), 127.0);
    EXPECT_EQ(array.at(2), 3.0);
    EXPECT_EQ(array.at(3), 0.0);
  }
}

TEST(Npz, ElementsOutOfRangeAndTextAsNumbersThrow) {
  const NpyArray array = NpyArray::fromMatrix(Eigen::MatrixXd::Zero(2, 2));
  EXPECT_THROW(array.at(4), std::out_of_range);
  EXPECT_THROW(array.at(-1), std::out_of_range);
  EXPECT_THROW(array.asText(), std::invalid_argument);
  EXPECT_THROW(NpyArray::fromText("x").asMatrix(), std::invalid_argument);
  EXPECT_THROW(NpyArray::fromText("x").at(0), std::invalid_argument);
}

/// Reading damaged bytes must give arrays or a FileError, nothing else.
void expectArraysOrFileError(const std::string& bytes, const std::vector<std::string>& keys = {}) {
  try {
    for (const auto& [key, array] : readNpzFromMemory(bytes.data(), bytes.size(), "x", keys)) {
      EXPECT_EQ(array.type == Type::kText ? array.size() : array.asMatrix().size(), array.size());
    }
  } catch (const FileError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }
}

TEST(Npz, DamagedBytesNeverCrash) {
  const TemporaryFolder folder;
  const std::string path = folder.path("a.npz");
  // Stored beside deflated entries: flips in stored ones reach the array parser unharmed.
  writeNpz(
      path,
      {{"matrix", NpyArray::fromMatrix(Eigen::MatrixXd::Identity(5, 4))},
       {"text", NpyArray::fromText("neutral")},
       {"index", NpyArray::fromMatrix(Eigen::MatrixXd::Ones(3, 3), Type::kUint32)}});
  const std::string valid = readBytes(path);
  for (std::size_t length = 0; length < valid.size(); ++length) {
    EXPECT_THROW(readNpzFromMemory(valid.data(), length, "cut"), FileError) << length;
  }
  for (std::size_t i = 0; i < valid.size(); ++i) {
    for (const int flip : {0x01, 0x80, 0xFF}) {
      std::string damaged = valid;
      damaged[i] = static_cast<char>(damaged[i] ^ flip);
      expectArraysOrFileError(damaged);
    }
  }
}

/// The file cut at byte i, and with that byte changed in several ways, by name.
std::map<std::string, std::string> damagedVersions(const std::string& valid, std::size_t i) {
  std::map<std::string, std::string> versions = {{" cut.npy", valid.substr(0, i)}};
  for (const int flip : {0x01, 0x02, 0x04, 0x10, 0x80}) {
    std::string damaged = valid;
    damaged[i] = static_cast<char>(valid[i] ^ flip);
    versions[std::to_string(flip) + ".npy"] = damaged;
  }
  return versions;
}

void expectDamageIsHandled(const std::string& validNpy, const std::string& path) {
  for (std::size_t i = 0; i < validNpy.size(); ++i) {
    // Inside a sound zip, so that the array parser sees every change.
    writeZip(path, damagedVersions(validNpy, i));
    const std::string archive = readBytes(path);
    EXPECT_NE(readingError(path).find(":  cut: "), std::string::npos) << i;
    for (const char* key : {"1", "2", "4", "16", "128"}) {
      expectArraysOrFileError(archive, {key});
    }
  }
}

TEST(Npz, DamagedArrayHeadersNeverCrash) {
  const TemporaryFolder folder;
  expectDamageIsHandled(
      npyFile(headerText("'<f4'", "True", "(2, 3)"), std::string(24, '\1')), folder.path("x.npz"));
  expectDamageIsHandled(
      npyFile(headerText("'<U2'", "True", "(2, 3)"), std::string(48, '\1')), folder.path("y.npz"));
}

}  // namespace
}  // namespace avatar

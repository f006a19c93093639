#include "bullet_ext/bullet_file.h"

#include "bullet_ext/cloth_body.h"
#include "bullet_ext/cloth_record.h"

#include <LinearMath/btSerializer.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <system_error>

namespace bullet_ext {
namespace {

constexpr int kClothCode = BT_MAKE_ID('S', 'C', 'L', 'O');
/// Of a file with floats, pointers of 64 bits and the low byte first; a version follows.
constexpr std::string_view kHeader = "BULLETf-v";

/// Of Bullet's own solver per step. One carries a correction about an edge further, and from the
/// waist of a skirt to its hem there are some 40 edges; Bullet's default of 1 lets cloth stretch
/// tenfold.
constexpr int kStockIterations = 60;

/// Bullet leaves gaps of its structures as they happen to be in memory.
class CleanSerializer final : public btDefaultSerializer {
 public:
  unsigned char* internalAlloc(size_t size) override {
    unsigned char* memory = btDefaultSerializer::internalAlloc(size);
    std::memset(memory, 0, size);
    return memory;
  }
};

/// As btSoftRigidDynamicsWorld does.
void addSoftBodyChunk(btSerializer& serializer, ClothBody& body) {
  const int size = body.calculateSerializeBufferSize();
  btChunk* chunk = serializer.allocate(static_cast<std::size_t>(size), 1);
  const char* type = body.serialize(chunk->m_oldPtr, &serializer);
  serializer.finalizeChunk(chunk, type, BT_SOFTBODY_CODE, &body);
}

/// As an array of int, which every reader of .bullet files can skip.
void addClothChunk(btSerializer& serializer, std::string& bytes) {
  btChunk* chunk = serializer.allocate(sizeof(int), static_cast<int>(bytes.size() / sizeof(int)));
  std::memcpy(chunk->m_oldPtr, bytes.data(), bytes.size());
  serializer.finalizeChunk(chunk, "btIntIndexData", kClothCode, bytes.data());
}

std::string serialized(const std::vector<BulletFileCloth>& cloths) {
  btSoftBodyWorldInfo worldInfo;
  std::vector<std::string> records;  // at different addresses: Bullet tells chunks apart by them
  records.reserve(cloths.size());
  for (const BulletFileCloth& cloth : cloths)
    records.push_back(packCloth(cloth));
  std::vector<std::unique_ptr<ClothBody>> bodies;
  CleanSerializer serializer;
  serializer.startSerialization();
  for (std::size_t i = 0; i < cloths.size(); ++i) {
    bodies.push_back(
        std::make_unique<ClothBody>(cloths[i].mesh, worldInfo, FaceTreeUpdate::kOnDemand));
    bodies.back()->mirror(cloths[i].state);
    bodies.back()->m_cfg.piterations = kStockIterations;
    addSoftBodyChunk(serializer, *bodies.back());
    addClothChunk(serializer, records[i]);
  }
  serializer.finishSerialization();
  return std::string(
      reinterpret_cast<const char*>(serializer.getBufferPointer()),
      static_cast<std::size_t>(serializer.getCurrentBufferSize()));
}

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& problem) {
  throw std::runtime_error(path.string() + ": " + problem);
}

std::string contentOf(const std::filesystem::path& path) {
  std::error_code problem;
  const std::uintmax_t size = std::filesystem::file_size(path, problem);
  if (problem)
    fail(path, "can't be read: " + problem.message());
  std::string content(static_cast<std::size_t>(size), '\0');
  std::ifstream file(path, std::ios::binary);
  if (!file.read(content.data(), static_cast<std::streamsize>(size)))
    fail(path, "can't be read");
  return content;
}

/// The contents of our chunks.
std::vector<std::string_view> clothChunks(
    const std::filesystem::path& path, std::string_view content) {
  if (content.size() < BT_HEADER_LENGTH || content.substr(0, 6) != kHeader.substr(0, 6))
    fail(path, "is not a .bullet file");
  if (content.substr(0, kHeader.size()) != kHeader)
    fail(path, "was written by Bullet with doubles or on another kind of machine; write it again");
  content.remove_prefix(BT_HEADER_LENGTH);
  std::vector<std::string_view> found;
  while (content.size() >= sizeof(btChunk)) {
    btChunk chunk{};
    std::memcpy(&chunk, content.data(), sizeof chunk);
    content.remove_prefix(sizeof chunk);
    if (chunk.m_chunkCode == BT_DNA_CODE)
      return found;
    if (chunk.m_length < 0 || static_cast<std::size_t>(chunk.m_length) > content.size())
      break;
    if (chunk.m_chunkCode == kClothCode)
      found.push_back(content.substr(0, static_cast<std::size_t>(chunk.m_length)));
    content.remove_prefix(static_cast<std::size_t>(chunk.m_length));
  }
  fail(path, "ends too early or is damaged; write it again");
}

}  // namespace

void writeBulletFile(
    const std::filesystem::path& path, const std::vector<BulletFileCloth>& cloths) {
  const std::string content = serialized(cloths);
  std::filesystem::path temporary = path;
  temporary += ".tmp";
  std::error_code problem;
  {
    std::ofstream file(temporary, std::ios::binary);
    file.write(content.data(), static_cast<std::streamsize>(content.size()));
    file.close();
    if (!file)
      problem = std::make_error_code(std::errc::io_error);
  }
  if (!problem)
    std::filesystem::rename(temporary, path, problem);
  if (problem) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    fail(path, "can't be written: " + problem.message());
  }
}

std::vector<BulletFileCloth> readBulletFile(const std::filesystem::path& path) {
  const std::string content = contentOf(path);
  std::vector<BulletFileCloth> cloths;
  for (const std::string_view chunk : clothChunks(path, content)) {
    try {
      cloths.push_back(unpackCloth(chunk));
    } catch (const std::exception& error) {
      fail(
          path,
          "cloth " + std::to_string(cloths.size()) + " is damaged: " + error.what() +
              "; write it again");
    }
  }
  if (cloths.empty())
    fail(
        path,
        "has no cloth with its parameters: expected a file that writeBulletFile() wrote, as soft "
        "bodies alone have no stiffness in N/m and no rest angles");
  return cloths;
}

}  // namespace bullet_ext

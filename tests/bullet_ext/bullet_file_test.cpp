#include "bullet_ext/bullet_file.h"

#include "bullet_ext/cloth_solver.h"
#include "tests/bullet_ext/bullet_world.h"
#include "tests/bullet_ext/core/cloth_shapes.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>

namespace bullet_ext {
namespace {

using test::equilateralSheet;
using test::Sheet;

std::string contentOf(const std::string& path) {
  std::string content(std::filesystem::file_size(path), '\0');
  std::ifstream(path, std::ios::binary)
      .read(content.data(), static_cast<std::streamsize>(content.size()));
  return content;
}

void writeContent(const std::string& path, const std::string& content) {
  std::ofstream(path, std::ios::binary) << content;
}

/// Nothing about it is the default.
BulletFileCloth unusualCloth(VertexOrder order = VertexOrder::kMorton) {
  Sheet sheet = equilateralSheet(7, 6, 0.02);
  sheet.vertices = test::jiggled(sheet.vertices, 0.002);
  ClothMaterial material;
  material.stretchStiffness = 321.0;
  material.torsionStiffness = 0.0123;
  material.massMode = MassMode::kAreal;
  material.arealDensity = 0.15;
  material.dampingMode = DampingMode::kPerSubstep;
  material.damping = 0.07;
  material.friction = 0.45;
  material.thickness = 0.0031;
  material.limitCompressedTorsion = false;
  BulletFileCloth cloth;
  cloth.name = "upper";
  cloth.mesh = test::clothOf(sheet, material, {.pins = {3, 11, 40}, .vertexOrder = order});
  for (Eigen::Index h = 0; h < cloth.mesh.hingeRestAngles.size(); ++h)
    cloth.mesh.hingeRestAngles[h] += 0.01 * static_cast<double>(h);  // as if it was de-sagged
  cloth.mesh.springStiffness[5] = 77.0;
  cloth.state = restState(cloth.mesh);
  cloth.state.positions.row(1).array() += 0.7F;
  cloth.state.velocities.row(0).setLinSpaced(0.0F, 1.0F);
  return cloth;
}

void expectSame(const BulletFileCloth& a, const BulletFileCloth& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.mesh.material, b.mesh.material);
  EXPECT_EQ(a.mesh.inputFromSolver, b.mesh.inputFromSolver);
  EXPECT_EQ(a.mesh.restPositions, b.mesh.restPositions);
  EXPECT_EQ(a.mesh.masses, b.mesh.masses);
  EXPECT_EQ(a.mesh.inverseMasses, b.mesh.inverseMasses);
  EXPECT_EQ(a.mesh.pins, b.mesh.pins);
  EXPECT_EQ(a.mesh.faces, b.mesh.faces);
  EXPECT_EQ(a.mesh.faceSprings, b.mesh.faceSprings);
  EXPECT_EQ(a.mesh.springs, b.mesh.springs);
  EXPECT_EQ(a.mesh.springRestLengths, b.mesh.springRestLengths);
  EXPECT_EQ(a.mesh.springStiffness, b.mesh.springStiffness);
  EXPECT_EQ(a.mesh.hinges, b.mesh.hinges);
  EXPECT_EQ(a.mesh.hingeRestAngles, b.mesh.hingeRestAngles);
  EXPECT_EQ(a.mesh.hingeStiffness, b.mesh.hingeStiffness);
  EXPECT_EQ(a.state.positions, b.state.positions);
  EXPECT_EQ(a.state.velocities, b.state.velocities);
}

TEST(BulletFile, GivesBackWhatItWasGiven) {
  const avatar::test::TemporaryFolder folder;
  std::vector<BulletFileCloth> cloths = {unusualCloth(), unusualCloth(VertexOrder::kInput)};
  cloths[1].name = "";
  writeBulletFile(folder.path("a.bullet"), cloths);
  const std::vector<BulletFileCloth> read = readBulletFile(folder.path("a.bullet"));
  ASSERT_EQ(read.size(), 2U);
  expectSame(read[0], cloths[0]);
  expectSame(read[1], cloths[1]);
}

/// Where a cloth is after some steps of a game's world that has our solver.
Eigen::Matrix4Xf simulated(const BulletFileCloth& cloth) {
  ClothSolver solver;
  test::BulletWorld world(&solver);
  world.setGravity({0, -9.81F, 0});
  ClothBody& body = solver.addCloth(cloth.mesh, world.world.getWorldInfo());
  solver.simulation().setState(0, cloth.state);
  solver.showStates();
  world.world.addSoftBody(&body);
  for (int step = 0; step < 10; ++step)
    world.world.stepSimulation(1.0F / 60.0F, 0);
  const Eigen::Matrix4Xf positions = solver.simulation().state(0).positions;
  world.world.removeSoftBody(&body);
  return positions;
}

TEST(BulletFile, ItsClothSimulatesInAGameAsTheOneThatWasWritten) {
  const avatar::test::TemporaryFolder folder;
  const BulletFileCloth cloth = unusualCloth();
  writeBulletFile(folder.path("a.bullet"), {cloth});
  const Eigen::Matrix4Xf positions = simulated(readBulletFile(folder.path("a.bullet")).front());
  EXPECT_EQ(positions, simulated(cloth));
  EXPECT_GT((positions - cloth.state.positions).norm(), 0.1F);  // it moved
}

TEST(BulletFile, WritesTheSameBytesForTheSameCloth) {
  const avatar::test::TemporaryFolder folder;
  writeBulletFile(folder.path("a.bullet"), {unusualCloth()});
  writeBulletFile(folder.path("b.bullet"), {unusualCloth()});
  EXPECT_EQ(contentOf(folder.path("a.bullet")), contentOf(folder.path("b.bullet")));
  EXPECT_EQ(contentOf(folder.path("a.bullet")).substr(0, 12), "BULLETf-v324");
  EXPECT_FALSE(std::filesystem::exists(folder.path("a.bullet.tmp")));
}

TEST(BulletFile, HasASoftBodyForOthers) {
  const avatar::test::TemporaryFolder folder;
  writeBulletFile(folder.path("a.bullet"), {unusualCloth(), unusualCloth()});
  const std::string content = contentOf(folder.path("a.bullet"));
  EXPECT_NE(content.find("SBDY"), std::string::npos);
  EXPECT_NE(content.find("DNA1"), std::string::npos);
}

/// One line that names the file and says what to do.
void expectRefused(const std::string& path, const std::string& reason) {
  try {
    readBulletFile(path);
    FAIL() << "accepted";
  } catch (const std::runtime_error& error) {
    const std::string message = error.what();
    EXPECT_EQ(message.rfind(path + ": ", 0), 0U) << message;
    EXPECT_NE(message.find(reason), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

TEST(BulletFile, RefusesWhatIsNoFileOfOurs) {
  const avatar::test::TemporaryFolder folder;
  expectRefused(folder.path("missing.bullet"), "can't be read");
  expectRefused(folder.path(), "can't be read");
  writeContent(folder.path("text.bullet"), "hello, this is no cloth");
  expectRefused(folder.path("text.bullet"), "not a .bullet file");
  writeContent(folder.path("empty.bullet"), "");
  expectRefused(folder.path("empty.bullet"), "not a .bullet file");
  writeBulletFile(folder.path("none.bullet"), {});
  expectRefused(folder.path("none.bullet"), "no cloth");
  std::string content = contentOf(folder.path("none.bullet"));
  content[6] = 'd';
  writeContent(folder.path("double.bullet"), content);
  expectRefused(folder.path("double.bullet"), "doubles");
}

TEST(BulletFile, RefusesEveryTruncation) {
  const avatar::test::TemporaryFolder folder;
  writeBulletFile(folder.path("whole.bullet"), {unusualCloth()});
  const std::string content = contentOf(folder.path("whole.bullet"));
  const std::size_t dna = content.find("DNA1");
  for (std::size_t length = 12; length < dna; length += 97) {
    writeContent(folder.path("part.bullet"), content.substr(0, length));
    expectRefused(folder.path("part.bullet"), "write it again");
  }
}

TEST(BulletFile, RefusesAChangedByteInOurChunk) {
  const avatar::test::TemporaryFolder folder;
  writeBulletFile(folder.path("whole.bullet"), {unusualCloth()});
  const std::string content = contentOf(folder.path("whole.bullet"));
  const std::size_t chunk = content.find("SCLO") + 24;
  for (std::size_t i = 0; i < 1500; i += 61) {
    std::string changed = content;
    changed[chunk + i] = static_cast<char>(changed[chunk + i] ^ 0x40);
    writeContent(folder.path("changed.bullet"), changed);
    expectRefused(folder.path("changed.bullet"), "cloth 0 is damaged");
  }
}

TEST(BulletFile, RefusesToWriteWhatItCouldNotRead) {
  const avatar::test::TemporaryFolder folder;
  BulletFileCloth cloth = unusualCloth();
  cloth.state.positions(0, 3) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(writeBulletFile(folder.path("a.bullet"), {cloth}), std::invalid_argument);
  EXPECT_FALSE(std::filesystem::exists(folder.path("a.bullet")));
  EXPECT_THROW(
      writeBulletFile(folder.path("no/such/folder.bullet"), {unusualCloth()}), std::runtime_error);
}

}  // namespace
}  // namespace bullet_ext

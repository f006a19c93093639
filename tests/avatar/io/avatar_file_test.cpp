#include "avatar/io/avatar_file.h"

#include "avatar/avatar_check.h"
#include "avatar/io/file_error.h"
#include "tests/support/capsule_figure.h"
#include "tests/support/glb_editing.h"
#include "tests/support/sample_avatar.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

namespace avatar {
namespace {

using nlohmann::json;
using test::GlbParts;
using test::TemporaryFolder;

const LayeredAvatar& sample() {
  static const LayeredAvatar kAvatar =
      test::dressedAvatar(test::capsuleFigure(), Eigen::Vector3d(0.5, -1.0, 1.0 / 3.0));
  return kAvatar;
}

std::string sampleBytes() {
  static const std::string kBytes = [] {
    const TemporaryFolder folder;
    writeAvatar(folder.path("a.glb"), sample());
    return test::fileBytes(folder.path("a.glb"));
  }();
  return kBytes;
}

/// What readAvatar() says about a file with these bytes; empty when it takes it.
std::string complaintAbout(const TemporaryFolder& folder, const std::string& bytes) {
  test::writeBytes(folder.path("bad.glb"), bytes);
  try {
    readAvatar(folder.path("bad.glb"));
  } catch (const FileError& error) {
    EXPECT_NE(std::string(error.what()).find("bad.glb"), std::string::npos);
    return error.what();
  }
  return "";
}

void expectEqual(const AvatarBody& a, const AvatarBody& b) {
  EXPECT_EQ(a.model, b.model);
  EXPECT_EQ(a.betas, b.betas);
  EXPECT_EQ(a.mesh.vertices, b.mesh.vertices);
  EXPECT_EQ(a.mesh.faces, b.mesh.faces);
  EXPECT_EQ(a.joints, b.joints);
  EXPECT_EQ(a.parents, b.parents);
  EXPECT_EQ(Eigen::MatrixXd(a.skinningWeights), Eigen::MatrixXd(b.skinningWeights));
  EXPECT_EQ(a.color, b.color);
  ASSERT_EQ(a.capsules.size(), b.capsules.size());
  for (std::size_t i = 0; i < a.capsules.size(); ++i) {
    EXPECT_EQ(a.capsules[i].joint, b.capsules[i].joint);
    EXPECT_EQ(a.capsules[i].start, b.capsules[i].start);
    EXPECT_EQ(a.capsules[i].end, b.capsules[i].end);
    EXPECT_EQ(a.capsules[i].radius, b.capsules[i].radius);
  }
}

void expectEqual(const Garment& a, const Garment& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.layer, b.layer);
  EXPECT_EQ(a.asWorn, b.asWorn);
  EXPECT_EQ(a.mesh.vertices, b.mesh.vertices);
  EXPECT_EQ(a.mesh.faces, b.mesh.faces);
  EXPECT_EQ(a.bindPose.jointRotations, b.bindPose.jointRotations);
  EXPECT_EQ(a.bindPose.translation, b.bindPose.translation);
  EXPECT_EQ(Eigen::MatrixXd(a.skinningWeights), Eigen::MatrixXd(b.skinningWeights));
  EXPECT_EQ(a.cloth, b.cloth);
  EXPECT_EQ(a.pins, b.pins);
  EXPECT_EQ(a.maxDistance, b.maxDistance);
  EXPECT_EQ(a.collideWith, b.collideWith);
  EXPECT_EQ(a.hints, b.hints);
  EXPECT_EQ(a.color, b.color);
  ASSERT_EQ(a.vertexColors.cols(), b.vertexColors.cols());
  // float32 of the light's intensity; the display's curve is at most 13 times as steep. rms:
  EXPECT_LT((a.vertexColors - b.vertexColors).norm(), 1e-6 * std::sqrt(3.0 * 416));
}

void expectEqual(const LayeredAvatar& a, const LayeredAvatar& b) {
  expectEqual(a.body, b.body);
  ASSERT_EQ(a.garments.size(), b.garments.size());
  for (std::size_t i = 0; i < a.garments.size(); ++i)
    expectEqual(a.garments[i], b.garments[i]);
}

TEST(AvatarFile, ComesBackBitByBit) {
  const TemporaryFolder folder;
  writeAvatar(folder.path("a.glb"), sample());
  expectEqual(readAvatar(folder.path("a.glb")), sample());
}

TEST(AvatarFile, WritesTheSameBytesAgain) {
  const TemporaryFolder folder;
  writeAvatar(folder.path("a.glb"), sample());
  writeAvatar(folder.path("b.glb"), readAvatar(folder.path("a.glb")));
  EXPECT_EQ(test::fileBytes(folder.path("a.glb")), test::fileBytes(folder.path("b.glb")));
}

TEST(AvatarFile, GeometryInDoubleIsRoundedOnceAndThenStays) {
  const TemporaryFolder folder;
  LayeredAvatar avatar = sample();
  avatar.body.mesh.vertices *= 1.0 / 3.0;
  avatar.body.joints *= -1.0 / 3.0;
  avatar.body.joints.row(0).setConstant(-0.0);  // which matrices turn into 0
  avatar.garments[0].mesh.vertices *= 1.0 / 7.0;
  writeAvatar(folder.path("a.glb"), avatar);
  const LayeredAvatar back = readAvatar(folder.path("a.glb"));
  EXPECT_EQ(back.body.mesh.vertices, roundedToFloat(avatar.body.mesh.vertices));
  EXPECT_EQ(back.body.joints, roundedToFloat(avatar.body.joints));
  writeAvatar(folder.path("b.glb"), back);
  EXPECT_EQ(test::fileBytes(folder.path("a.glb")), test::fileBytes(folder.path("b.glb")));
}

TEST(AvatarFile, EmptyListsAndNonUniformClothComeBack) {
  const TemporaryFolder folder;
  LayeredAvatar avatar = sample();
  avatar.body.capsules.clear();
  avatar.body.betas.resize(0);
  avatar.body.vertexColors = Eigen::Matrix3Xd::Constant(3, avatar.body.mesh.numVertices(), 0.5);
  Garment& shirt = avatar.garments[0];
  shirt.pins.clear();
  shirt.asWorn = true;
  shirt.collideWith.clear();
  shirt.hints.clear();
  shirt.bindPose.jointRotations = aPose().jointRotations.head(60);
  const auto numColumns = std::ptrdiff_t{32};
  const auto numRows = std::ptrdiff_t{12};
  // Of a tube: around each of the rows + 1 rings, along and across each of the columns × rows.
  const auto numEdges = numColumns * (numRows + 1) + 2 * numColumns * numRows;
  shirt.cloth.edgeStretchStiffness.assign(static_cast<std::size_t>(numEdges), 0.1);
  const auto numInner = static_cast<std::size_t>(numEdges - 2 * numColumns);
  shirt.cloth.edgeTorsionStiffness.assign(numInner, 1.0 / 3.0);
  writeAvatar(folder.path("a.glb"), avatar);
  expectEqual(readAvatar(folder.path("a.glb")), avatar);
  // Programs of others look for `pins` and would stumble if there were none.
  const GlbParts parts(test::fileBytes(folder.path("a.glb")));
  EXPECT_EQ(parts.extras("shirt", "simulcap_cloth")["pins"], json::array());
  avatar.garments.clear();
  writeAvatar(folder.path("a.glb"), avatar);
  expectEqual(readAvatar(folder.path("a.glb")), avatar);
}

TEST(AvatarFile, ManyJointsNeedTwoBytesEach) {
  const TemporaryFolder folder;
  LayeredAvatar avatar;
  avatar.body.mesh = test::cube();
  const int numJoints = 300;
  avatar.body.joints = Eigen::Matrix3Xd::Zero(3, numJoints);
  avatar.body.parents.assign(numJoints, 0);
  avatar.body.parents[0] = -1;
  avatar.body.skinningWeights.resize(8, numJoints);
  for (int v = 0; v < 8; ++v)
    avatar.body.skinningWeights.insert(v, numJoints - 1 - v) = 1.0;
  writeAvatar(folder.path("a.glb"), avatar);
  expectEqual(readAvatar(folder.path("a.glb")), avatar);
}

/// World from each node, by its place in the document.
std::vector<Eigen::Isometry3d> nodeFrames(const json& document) {
  const json& nodes = document["nodes"];
  std::vector<Eigen::Isometry3d> frames(nodes.size(), Eigen::Isometry3d::Identity());
  std::vector<std::size_t> parents(nodes.size(), nodes.size());
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    for (const json& child : nodes[n].value("children", json::array()))
      parents[child.get<std::size_t>()] = n;
    const auto place = nodes[n].value("translation", std::vector<double>{0.0, 0.0, 0.0});
    const auto turn = nodes[n].value("rotation", std::vector<double>{0.0, 0.0, 0.0, 1.0});
    const Eigen::Isometry3d own = Eigen::Translation3d(place[0], place[1], place[2]) *
                                  Eigen::Quaterniond(turn[3], turn[0], turn[1], turn[2]);
    // Parents are written before their children.
    frames[n] = parents[n] < n ? frames[parents[n]] * own : own;
  }
  return frames;
}

TEST(AvatarFile, SkeletonAndCapsulesAreWhereTheGarmentsMeshesAre) {
  const json document = GlbParts(sampleBytes()).document;
  const std::vector<Eigen::Isometry3d> nodes = nodeFrames(document);
  const LayeredAvatar& avatar = sample();
  const std::vector<Eigen::Isometry3d> expected =
      worldFromJoints(avatar.body, avatar.garments[0].bindPose);
  const json& joints = document["skins"][0]["joints"];
  for (std::size_t j = 0; j < expected.size(); ++j)
    EXPECT_TRUE(nodes[joints[j].get<std::size_t>()].isApprox(expected[j], 1e-6)) << j;
  const json body =
      *std::find_if(document["nodes"].begin(), document["nodes"].end(), [](const json& node) {
        return node["name"] == "body";
      });
  for (std::size_t c = 0; c < avatar.body.capsules.size(); ++c) {
    const BodyCapsule& capsule = avatar.body.capsules[c];
    const auto p0 = body["extras"]["simulcap_body"]["capsules"][c]["p0"].get<std::vector<double>>();
    const Eigen::Vector3d place = expected[static_cast<std::size_t>(capsule.joint)] * capsule.start;
    EXPECT_LT((Eigen::Vector3d(p0[0], p0[1], p0[2]) - place).norm(), 1e-12);
  }
}

TEST(AvatarFile, IsWhatOtherProgramsExpect) {
  const json document = GlbParts(sampleBytes()).document;
  EXPECT_FALSE(document.contains("extensionsUsed"));
  const json& nodes = document["nodes"];
  EXPECT_EQ(nodes[kLeftElbow]["name"], "left_elbow");
  const auto named = [&](const std::string& name) {
    return *std::find_if(
        nodes.begin(), nodes.end(), [&](const json& node) { return node["name"] == name; });
  };
  const json body = named("body")["extras"]["simulcap_body"];
  EXPECT_EQ(body["model"], "capsule figure");
  EXPECT_EQ(body["betas"][2].get<double>(), 1.0 / 3.0);
  EXPECT_TRUE(body["capsules"][0]["joint"].is_string());
  EXPECT_EQ(body["capsules"][0]["local_p0"].size(), 3u);
  const json cloth = named("shirt")["extras"]["simulcap_cloth"];
  for (const char* key :
       {"version",
        "layer",
        "stretch_k",
        "torsion_w",
        "vertex_mass_kg",
        "damping",
        "friction",
        "thickness_m",
        "pins",
        "max_distance",
        "collide_with",
        "hints",
        "damping_mode",
        "mass_mode"})
    EXPECT_TRUE(cloth.contains(key)) << key;
  EXPECT_EQ(cloth["stretch_k"].get<double>(), 512.3);
  // Every garment has a skin of its own; all share the body's joints.
  EXPECT_EQ(document["skins"].size(), 3u);
  EXPECT_EQ(document["skins"][0]["joints"], document["skins"][2]["joints"]);
  EXPECT_NE(
      document["skins"][0]["inverseBindMatrices"], document["skins"][1]["inverseBindMatrices"]);
  EXPECT_EQ(document["animations"].size(), 1u);
}

TEST(AvatarFile, FlawedAvatarsAreNotWritten) {
  const TemporaryFolder folder;
  const auto expectRefused = [&](const char* field, const auto& spoil) {
    LayeredAvatar avatar = sample();
    spoil(avatar);
    const std::optional<AvatarFlaw> flaw = findFlaw(avatar);
    ASSERT_TRUE(flaw.has_value()) << field;
    EXPECT_NE(flaw->field.find(field), std::string::npos) << flaw->field;
    EXPECT_THROW(writeAvatar(folder.path("a.glb"), avatar), std::invalid_argument) << field;
  };
  EXPECT_FALSE(findFlaw(sample()).has_value());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expectRefused("mesh", [&](auto& a) { a.body.mesh.vertices(0, 0) = nan; });
  expectRefused("mesh", [](auto& a) { a.garments[0].mesh.faces(0, 0) = -1; });
  expectRefused("joints", [](auto& a) { a.body.parents[3] = 7; });
  expectRefused("weights", [](auto& a) { a.garments[1].skinningWeights.coeffs()[0] = 0.4; });
  expectRefused("capsules", [](auto& a) { a.body.capsules[0].joint = 24; });
  expectRefused("radius", [](auto& a) { a.body.capsules[0].radius = 0.0; });
  expectRefused("color", [](auto& a) { a.body.color[0] = 1.5; });
  expectRefused("name", [](auto& a) { a.garments[1].name = "shirt"; });
  expectRefused("name", [](auto& a) { a.garments[1].name = "left_knee"; });
  expectRefused("collide_with", [](auto& a) { a.garments[0].collideWith = {"coat"}; });
  expectRefused("pins", [](auto& a) { a.garments[0].pins = {3, 3}; });
  expectRefused("pins", [](auto& a) { a.garments[0].pins = {416}; });
  expectRefused("max_distance", [](auto& a) { a.garments[0].maxDistance.resize(3); });
  expectRefused("stretch_k", [&](auto& a) { a.garments[0].cloth.stretchStiffness = nan; });
  expectRefused("thickness_m", [](auto& a) { a.garments[0].cloth.thickness = 0.0; });
  expectRefused("damping", [](auto& a) { a.garments[0].cloth.damping = 1.5; });
  expectRefused("edge_stretch_k", [](auto& a) { a.garments[0].cloth.edgeStretchStiffness = {1}; });
  expectRefused("bind_pose", [&](auto& a) { a.garments[0].bindPose.translation[1] = nan; });
  EXPECT_FALSE(std::filesystem::exists(folder.path("a.glb")));
}

TEST(AvatarFile, AnythingCutOffIsRefused) {
  const TemporaryFolder folder;
  const std::string bytes = sampleBytes();
  for (std::size_t length = 0; length < bytes.size(); length += length < 100 ? 1 : 9973)
    EXPECT_NE(complaintAbout(folder, bytes.substr(0, length)), "") << length;
  // Also with a header that says what is left.
  for (std::size_t length = 24; length < bytes.size(); length += 29989) {
    std::string cut = bytes.substr(0, length / 4 * 4);
    test::setUnsigned(cut, 8, static_cast<std::uint32_t>(cut.size()));
    EXPECT_NE(complaintAbout(folder, cut), "") << length;
  }
}

TEST(AvatarFile, RandomDamageNeverCrashes) {
  const TemporaryFolder folder;
  const GlbParts parts(sampleBytes());
  const std::string text = parts.document.dump();
  test::Noise noise(5);
  const auto below = [&](std::size_t limit) {
    const auto place =
        static_cast<std::size_t>(0.5 * (noise.next() + 1.0) * static_cast<double>(limit));
    return std::min(place, limit - 1);
  };
  const std::vector<std::string> tokens = {
      "-1", "0", "1e9", "null", "true", "[]", "{}", "\"x\"", "4294967296", "1e308", "0.5"};
  for (int trial = 0; trial < 600; ++trial) {
    std::string damaged = text;
    if (trial % 3 == 0) {
      damaged[below(text.size())] = static_cast<char>(below(256));
    } else if (trial % 3 == 1) {
      damaged.erase(below(text.size()), below(60));
    } else {
      const std::size_t number = text.find_first_of("0123456789", below(text.size() - 100));
      const std::size_t end = text.find_first_not_of("0123456789.-e", number);
      damaged.replace(number, end - number, tokens[below(tokens.size())]);
    }
    complaintAbout(folder, parts.bytes(damaged));  // may be harmless; the sanitizers watch
  }
}

TEST(AvatarFile, EveryKeyOfTheExtrasIsLookedAt) {
  const TemporaryFolder folder;
  const GlbParts parts(sampleBytes());
  const auto expectNamed = [&](const std::string& name, const std::function<void(json&)>& spoil) {
    GlbParts spoiled = parts;
    spoil(spoiled.document);
    const std::string complaint = complaintAbout(folder, spoiled.bytes());
    EXPECT_NE(complaint.find(name), std::string::npos) << name << ": " << complaint;
  };
  const json cloth = parts.extras("shirt", "simulcap_cloth");
  for (const auto& [key, value] : cloth.items()) {
    const std::string name = key;
    for (const json& wrong : {json(true), json("x"), json::array({json::object()})}) {
      if (key == "hints" || wrong.is_string() != value.is_string() || key.ends_with("_mode"))
        expectNamed(
            name, [&](json& d) { test::extras(d, "shirt", "simulcap_cloth")[name] = wrong; });
    }
    const bool mayBeAbsent = key == "hints" || key == "shape";
    if (!value.is_array() && !mayBeAbsent)
      expectNamed(name, [&](json& d) { test::extras(d, "shirt", "simulcap_cloth").erase(name); });
  }
  for (const char* key : {"model", "version", "color"})
    expectNamed(key, [&](json& d) { test::extras(d, "body", "simulcap_body").erase(key); });
  const auto setCloth = [](const char* key, const json& value) {
    return [=](json& d) { test::extras(d, "shirt", "simulcap_cloth")[key] = value; };
  };
  expectNamed("version", setCloth("version", 2));
  expectNamed("pins", setCloth("pins", {5, 100000}));
  expectNamed("pins", setCloth("pins", {-1}));
  expectNamed("shape", setCloth("shape", "as_folded"));
  expectNamed("pins", setCloth("pins", {4294967296LL}));
  expectNamed("max_distance", setCloth("max_distance", {0.1, 0.2}));
  expectNamed("stretch_k", setCloth("stretch_k", -1.0));
  expectNamed("collide_with", setCloth("collide_with", {"coat"}));
  expectNamed("bind_pose", [&](json& d) {
    test::extras(d, "shirt", "simulcap_cloth")["bind_pose"]["translation"] = {0.0, 1.0, 0.0};
  });
  expectNamed("capsules[1].joint", [&](json& d) {
    test::extras(d, "body", "simulcap_body")["capsules"][1]["joint"] = "tail";
  });
}

TEST(AvatarFile, GeometryThatDoesNotFitIsNamed) {
  const TemporaryFolder folder;
  const GlbParts parts(sampleBytes());
  const auto expectNamed = [&](const std::string& name,
                               const std::function<void(GlbParts&)>& spoil) {
    GlbParts spoiled = parts;
    spoil(spoiled);
    const std::string complaint = complaintAbout(folder, spoiled.bytes());
    EXPECT_NE(complaint.find(name), std::string::npos) << name << ": " << complaint;
  };
  const json primitive = parts.document["meshes"][1]["primitives"][0];
  const auto accessor = [&](const char* attribute) {
    return primitive["attributes"][attribute].get<std::size_t>();
  };
  const std::size_t positions = accessor("POSITION");
  expectNamed("shirt: POSITION", [&](GlbParts& p) {
    p.document["accessors"][positions]["count"] = 100000000;
  });
  expectNamed("shirt", [&](GlbParts& p) { p.document["accessors"][positions]["count"] = 415; });
  expectNamed("shirt: mesh", [&](GlbParts& p) {
    p.document["meshes"][1]["primitives"][0]["attributes"].erase("POSITION");
  });
  expectNamed("shirt: indices", [&](GlbParts& p) {
    p.document["meshes"][1]["primitives"][0]["indices"] = -1;
  });
  expectNamed("shirt: WEIGHTS_0", [&](GlbParts& p) {
    p.document["accessors"][accessor("WEIGHTS_0")]["componentType"] = 5121;
  });
  expectNamed("shirt: JOINTS_0", [&](GlbParts& p) {
    p.document["accessors"][accessor("JOINTS_0")]["count"] = 10;
  });
  expectNamed("shirt: indices", [&](GlbParts& p) {
    p.document["accessors"][primitive["indices"].get<std::size_t>()]["count"] = 10;
  });
  expectNamed("shirt: mesh", [&](GlbParts& p) {
    p.document["meshes"].erase(2);
    p.document["nodes"][25]["mesh"] = 9;
  });
  expectNamed("shirt: skin", [&](GlbParts& p) { p.document["nodes"][25].erase("skin"); });
  const float nan = std::numeric_limits<float>::quiet_NaN();
  expectNamed("garment shirt: mesh", [&](GlbParts& p) { p.setFloat(positions, 7, nan); });
  expectNamed(
      "garment shirt: weights", [&](GlbParts& p) { p.setFloat(accessor("WEIGHTS_0"), 0, 0.9F); });
  expectNamed(
      "garment shirt: weights", [&](GlbParts& p) { p.setFloat(accessor("WEIGHTS_0"), 0, nan); });
  expectNamed("garment shirt: mesh", [&](GlbParts& p) {
    p.setFloat(primitive["indices"].get<std::size_t>(), 0, -1.0F);
  });
  expectNamed("body: inverseBindMatrices", [&](GlbParts& p) {
    p.setFloat(p.document["skins"][0]["inverseBindMatrices"].get<std::size_t>(), 0, 2.0F);
  });
}

TEST(AvatarFile, OtherFilesAreRefusedWithARemedy) {
  const TemporaryFolder folder;
  GlbParts parts(sampleBytes());
  for (json& node : parts.document["nodes"])
    node.erase("extras");
  EXPECT_NE(complaintAbout(folder, parts.bytes()).find("simulcap dress"), std::string::npos);
  EXPECT_NE(complaintAbout(folder, "ply\nformat ascii 1.0\nend_header\n\n\n"), "");
  EXPECT_NE(
      complaintAbout(folder, parts.bytes(std::string(200000, '['))).find("nested"),
      std::string::npos);
  EXPECT_THROW(readAvatar(folder.path("nothing.glb")), FileError);
  EXPECT_THROW(readAvatar(folder.path()), FileError);
}

}  // namespace
}  // namespace avatar

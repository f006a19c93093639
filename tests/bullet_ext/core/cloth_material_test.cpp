#include "bullet_ext/core/cloth_material.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>

namespace bullet_ext {
namespace {

TEST(ClothMaterial, hasThePapersPresets) {
  EXPECT_EQ(paperMaterial("soft").stretchStiffness, 300.0);
  EXPECT_EQ(paperMaterial("soft").torsionStiffness, 0.01);
  EXPECT_EQ(paperMaterial("hard").stretchStiffness, 1300.0);
  EXPECT_EQ(paperMaterial("hard").torsionStiffness, 0.1);
  EXPECT_EQ(paperMaterial("middle"), ClothMaterial{});
  for (const std::string_view name : kPaperMaterials) {
    EXPECT_NO_THROW(paperMaterial(name).validate());
    EXPECT_EQ(paperMaterial(name).vertexMass, 0.001);
  }
  EXPECT_THROW(paperMaterial("silk"), std::invalid_argument);
}

TEST(ClothMaterial, namesTheFieldOutsideItsRange) {
  const auto message = [](const ClothMaterial& material) -> std::string {
    try {
      material.validate();
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message({}), "");
  EXPECT_NE(message({.stretchStiffness = -1.0}).find("stretchStiffness"), std::string::npos);
  EXPECT_NE(message({.torsionStiffness = NAN}).find("torsionStiffness"), std::string::npos);
  EXPECT_NE(message({.vertexMass = 0.0}).find("vertexMass"), std::string::npos);
  EXPECT_NE(message({.arealDensity = INFINITY}).find("arealDensity"), std::string::npos);
  EXPECT_NE(message({.friction = -0.1}).find("friction"), std::string::npos);
  EXPECT_NE(message({.thickness = 0.0}).find("thickness"), std::string::npos);
}

TEST(ClothMaterial, dampingsRangeFollowsItsMode) {
  EXPECT_NO_THROW((ClothMaterial{.damping = 5.0}.validate()));
  EXPECT_THROW(
      (ClothMaterial{.dampingMode = DampingMode::kPerSubstep, .damping = 5.0}.validate()),
      std::invalid_argument);
  EXPECT_NO_THROW(
      (ClothMaterial{.dampingMode = DampingMode::kPerSubstep, .damping = 1.0}.validate()));
}

}  // namespace
}  // namespace bullet_ext

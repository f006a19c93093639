#include "src/digitization/single_view_outfit.h"

#include "avatar/digitization/body_parts.h"
#include "avatar/geometry/closest_point.h"
#include "avatar/wardrobe/outfit.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <optional>
#include <stdexcept>
#include <utility>

namespace simulcap {
namespace {

using avatar::BodyPart;
using avatar::SurfaceLabel;

constexpr std::size_t kFewPixels = 30;  // tell nothing about a part
/// What distances are measured of, evenly spread.
constexpr std::size_t kMostPoints = 2000;

double quantile(std::vector<double> values, double share) {
  const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

class SingleView {
 public:
  SingleView(
      const avatar::PosedDepthFrame& frame,
      const avatar::Skinning& skinning,
      const Eigen::VectorXd& betas)
      : frame_(frame),
        vertices_(skinning.pose(skinning.shape(betas), frame.pose).vertices),
        skin_({vertices_, skinning.model().faces}) {
    const avatar::ShapedBody shaped = skinning.shape(betas);
    parts_ =
        avatar::partImage(frame, skinning, shaped, avatar::bodyParts(skinning.model(), shaped));
  }

  bool labelled() const { return !frame_.labels.empty(); }

  /// The share of a body part's pixels that show something; none of parts that are hardly seen.
  std::optional<double> share(BodyPart part, SurfaceLabel label) const {
    std::size_t all = 0;
    std::size_t found = 0;
    for (std::size_t i = 0; i < frame_.depth.size(); ++i) {
      if (frame_.depth[i] <= 0.0F || parts_.parts[i] != part || frame_.labels[i] == 0)
        continue;
      ++all;
      found += frame_.labels[i] == label ? 1U : 0U;
    }
    if (all < kFewPixels)
      return std::nullopt;
    return static_cast<double>(found) / static_cast<double>(all);
  }

  /// Of what depth shows on some body parts, from the skin, sorted out by label where there are
  /// some [m].
  std::vector<double> distances(
      const std::vector<BodyPart>& parts, std::optional<SurfaceLabel> label) const {
    std::vector<std::size_t> pixels;
    for (std::size_t i = 0; i < frame_.depth.size(); ++i) {
      const bool isPart = std::find(parts.begin(), parts.end(), parts_.parts[i]) != parts.end();
      if (frame_.depth[i] > 0.0F && isPart && (!label || frame_.labels[i] == *label))
        pixels.push_back(i);
    }
    const std::size_t stride = pixels.size() / kMostPoints + 1;
    std::vector<double> found;
    found.reserve(pixels.size() / stride + 1);
    for (std::size_t k = 0; k < pixels.size(); k += stride)
      found.push_back(skin_(pointOf(pixels[k])).distance);
    return found;
  }

  /// Display values in the middle of those with a label; none without colours.
  std::optional<Eigen::Vector3d> color(SurfaceLabel label) const {
    std::array<std::vector<double>, 3> values;
    for (std::size_t i = 0; i < frame_.depth.size(); ++i) {
      if (frame_.color.rgb.empty() || !labelled() || frame_.labels[i] != label)
        continue;
      for (std::size_t c = 0; c < 3; ++c)
        values[c].push_back(frame_.color.rgb[3 * i + c] / 255.0);
    }
    if (values[0].size() < kFewPixels)
      return std::nullopt;
    return Eigen::Vector3d(
        quantile(values[0], 0.5), quantile(values[1], 0.5), quantile(values[2], 0.5));
  }

 private:
  Eigen::Vector3d pointOf(std::size_t pixel) const {
    const auto width = static_cast<std::size_t>(frame_.camera.width);
    const std::size_t row = pixel / width;
    return avatar::unproject(
        frame_.camera,
        {static_cast<double>(pixel - row * width),
         static_cast<double>(row),
         static_cast<double>(frame_.depth[pixel])});
  }

  const avatar::PosedDepthFrame& frame_;
  Eigen::Matrix3Xd vertices_;
  avatar::SignedDistance skin_;
  avatar::PartImage parts_;
};

class OutfitChoice {
 public:
  OutfitChoice(const SingleView& view, const SingleViewOptions& options)
      : view_(view), options_(options) {}

  std::vector<ChosenGarment> garments() const {
    std::vector<ChosenGarment> chosen;
    const auto add = [&](const char* name, SurfaceLabel label) {
      chosen.push_back(
          {{.name = name, .ease = ease(label), .edgeLength = options_.edgeLength},
           view_.color(label)});
    };
    if (!view_.labelled()) {
      add("tshirt", avatar::kUpperLabel);
      add("trousers", avatar::kLowerLabel);
      return chosen;
    }
    if (wears(BodyPart::kChest, avatar::kUpperLabel))
      add(upper(), avatar::kUpperLabel);
    // A long shirt hides the hips, shorts end above the knees.
    const std::array legs = {
        BodyPart::kHip, BodyPart::kThigh, BodyPart::kLowerThigh, BodyPart::kShank};
    if (!options_.onePiece && std::any_of(legs.begin(), legs.end(), [&](BodyPart part) {
          return wears(part, avatar::kLowerLabel);
        }))
      add(lower(), avatar::kLowerLabel);
    return chosen;
  }

 private:
  bool wears(BodyPart part, SurfaceLabel label) const {
    return view_.share(part, label).value_or(0.0) >= options_.covered;
  }

  const char* upper() const {
    if (options_.onePiece)
      return "dress";
    return wears(BodyPart::kForearm, avatar::kUpperLabel) ? "shirt" : "tshirt";
  }

  const char* lower() const {
    if (wears(BodyPart::kShank, avatar::kLowerLabel))
      return "trousers";
    // Between and beside the thighs a skirt has no leg behind it.
    const std::vector<double> free =
        view_.distances({BodyPart::kThigh, BodyPart::kLowerThigh}, avatar::kLowerLabel);
    const bool hangs = free.size() >= kFewPixels && quantile(free, 0.9) > options_.hangingFree;
    return hangs ? "skirt" : "shorts";
  }

  /// The median distance from the skin of what faces the camera, within what makeGarment() takes;
  /// none where there is little to see.
  std::optional<double> ease(SurfaceLabel label) const {
    constexpr double kLeast = 0.005;
    constexpr double kMost = 0.15;
    const std::vector<BodyPart> parts = label == avatar::kUpperLabel
                                            ? std::vector{BodyPart::kChest, BodyPart::kWaist}
                                            : std::vector{BodyPart::kHip, BodyPart::kThigh};
    const std::vector<double> seen = view_.distances(
        parts, view_.labelled() ? std::optional<SurfaceLabel>(label) : std::nullopt);
    if (seen.size() < kFewPixels)
      return std::nullopt;
    return std::clamp(quantile(seen, 0.5), kLeast, kMost);
  }

  const SingleView& view_;
  const SingleViewOptions& options_;
};

std::string describe(const std::vector<ChosenGarment>& garments) {
  std::string text;
  for (const ChosenGarment& garment : garments) {
    char ease[40] = "";
    if (garment.order.ease)
      std::snprintf(ease, sizeof ease, " (%.0f mm of ease)", 1000.0 * *garment.order.ease);
    text += (text.empty() ? "" : ", ") + garment.order.name + ease;
  }
  return text;
}

}  // namespace

SingleViewOutfit singleViewOutfit(
    const avatar::PosedDepthFrame& frame,
    const avatar::Skinning& skinning,
    const Eigen::VectorXd& betas,
    const SingleViewOptions& options) {
  const SingleView view(frame, skinning, betas);
  SingleViewOutfit outfit;
  outfit.garments = OutfitChoice(view, options).garments();
  outfit.skinColor = view.color(avatar::kSkinLabel);
  outfit.guessed = !view.labelled();
  if (outfit.garments.empty())
    throw std::runtime_error(
        "the labels show no garment on chest, hips or legs: give an avatar made by \"simulcap "
        "dress\"");
  return outfit;
}

BuiltInAvatar wearing(
    const SingleViewOutfit& outfit, const avatar::BodyModel& model, const Eigen::VectorXd& betas) {
  avatar::Outfit pieces;
  for (const ChosenGarment& garment : outfit.garments)
    pieces.pieces.emplace_back(garment.order);
  avatar::DressedAvatar dressed = avatar::dressed(model, betas, pieces);
  BuiltInAvatar result{std::move(dressed.avatar), std::move(dressed.notes)};
  for (avatar::Garment& worn : result.avatar.garments) {
    for (const ChosenGarment& garment : outfit.garments) {
      if (garment.order.name == worn.name)
        worn.color = garment.color.value_or(worn.color);
    }
  }
  result.avatar.body.color = outfit.skinColor.value_or(result.avatar.body.color);
  result.notes.push_back(
      "built-in garments instead of digitized ones: " + describe(outfit.garments));
  if (outfit.guessed)
    result.notes.emplace_back(
        "neither labels nor colours: which garments these are is a guess; give an avatar made by "
        "\"simulcap dress\" to choose");
  return result;
}

}  // namespace simulcap

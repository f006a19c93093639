#include "avatar/digitization/frame_parsing.h"

#include "avatar/digitization/body_parts.h"
#include "avatar/digitization/color_model.h"
#include "avatar/digitization/upright_stand.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <stdexcept>

namespace avatar {
namespace {

constexpr std::size_t kFewestColors = 50;

using LabelFrequencies = std::array<double, kNumSurfaceLabels>;
using ClassColors = std::array<std::vector<Rgb>, kNumSurfaceLabels>;

Rgb colorAt(const PosedDepthFrame& frame, std::size_t pixel) {
  const std::uint8_t* rgb = &frame.color.rgb[3 * pixel];
  return {rgb[0], rgb[1], rgb[2]};
}

/// Every n-th, so that there are at most so many.
std::vector<Rgb> thinned(const std::vector<Rgb>& colors, int most) {
  const auto count = static_cast<std::size_t>(most);
  if (colors.size() <= count)
    return colors;
  std::vector<Rgb> result;
  result.reserve(count);
  for (std::size_t i = 0; i < count; ++i)
    result.push_back(colors[i * colors.size() / count]);
  return result;
}

const char* nameOf(std::size_t place) {
  constexpr std::array<const char*, kNumSurfaceLabels> kNames = {
      "skin", "upper garment", "lower garment"};
  return kNames[place];
}

class FrameParser {
 public:
  FrameParser(
      const std::vector<PosedDepthFrame>& frames,
      const Skinning& skinning,
      const Eigen::VectorXd& betas,
      const FrameParsingOptions& options)
      : frames_(frames),
        skinning_(skinning),
        options_(options),
        shaped_(skinning.shape(betas)),
        parts_(bodyParts(skinning.model(), shaped_)) {}

  FrameParsing run() {
    if (allLabelled())
      return given();
    requireColors();
    chooseSeedFrames();
    learn(fromLabels_ ? seedColors() : withoutUpperOnThighs(seedColors()));
    // What was labelled by others teaches no more the second time.
    for (int round = 0; round < (fromLabels_ ? 0 : options_.rounds); ++round) {
      const std::vector<std::vector<std::uint8_t>> labels = seedLabels();
      learnWhatIsOnTop(labels);
      learn(collected([&](std::size_t s, std::size_t i) { return labels[s][i]; }));
    }
    result_.labels.resize(frames_.size());
    options_.runLoop(static_cast<long>(frames_.size()), [&](long f) {
      const auto i = static_cast<std::size_t>(f);
      result_.labels[i] = labelsOf(frames_[i], partImageOf(frames_[i]));
    });
    return std::move(result_);
  }

 private:
  bool allLabelled() const {
    return std::all_of(
        frames_.begin(), frames_.end(), [](const auto& f) { return !f.labels.empty(); });
  }

  FrameParsing given() {
    result_.onePiece = options_.onePiece;
    for (const PosedDepthFrame& frame : frames_)
      result_.labels.push_back(givenLabels(frame));
    return std::move(result_);
  }

  std::vector<std::uint8_t> givenLabels(const PosedDepthFrame& frame) const {
    std::vector<std::uint8_t> labels = frame.labels;
    if (options_.onePiece)
      std::replace(
          labels.begin(), labels.end(), std::uint8_t{kLowerLabel}, std::uint8_t{kUpperLabel});
    return labels;
  }

  void requireColors() const {
    if (std::any_of(frames_.begin(), frames_.end(), [](const auto& f) {
          return f.color.rgb.empty() && f.labels.empty();
        }))
      throw std::runtime_error(
          "without colour nothing tells garments from skin: give label images "
          "(labels/000000.png, ...: 0 background, 1 skin, 2 upper, 3 lower garment)");
  }

  PartImage partImageOf(const PosedDepthFrame& frame) const {
    return partImage(frame, skinning_, shaped_, parts_);
  }

  /// Frames that are labelled, else some over the whole turn.
  void chooseSeedFrames() {
    for (std::size_t f = 0; f < frames_.size(); ++f) {
      if (!frames_[f].labels.empty())
        seedFrames_.push_back(f);
    }
    fromLabels_ = !seedFrames_.empty();
    const auto count =
        std::min<std::size_t>(frames_.size(), static_cast<std::size_t>(options_.seedFrames));
    for (std::size_t i = 0; !fromLabels_ && i < count; ++i)
      seedFrames_.push_back(i * frames_.size() / count);
    for (const std::size_t f : seedFrames_)
      seedParts_.push_back(partImageOf(frames_[f]));
    for (int part = 0; part < kNumBodyParts; ++part)
      priors_[static_cast<std::size_t>(part)] = labelPrior(static_cast<BodyPart>(part));
    if (fromLabels_)
      learnPriors();
  }

  /// Pixels of each part and label in the seed frames.
  std::array<LabelFrequencies, kNumBodyParts> countsOfParts(
      const std::vector<std::vector<std::uint8_t>>& labels) const {
    std::array<LabelFrequencies, kNumBodyParts> counts = {};
    for (std::size_t s = 0; s < labels.size(); ++s) {
      for (std::size_t i = 0; i < labels[s].size(); ++i) {
        if (labels[s][i] != kNoLabel)
          counts[static_cast<std::size_t>(seedParts_[s].parts[i])][labels[s][i] - 1U] += 1.0;
      }
    }
    return counts;
  }

  /// Labelled frames tell what is worn where: bare shanks need no colour unlike shorts'.
  void learnPriors() {
    constexpr double kAssumed = 20.0;  // pixels that what was likely beforehand counts as
    std::vector<std::vector<std::uint8_t>> labels;
    for (const std::size_t frame : seedFrames_)
      labels.push_back(frames_[frame].labels);
    const std::array<LabelFrequencies, kNumBodyParts> counts = countsOfParts(labels);
    for (std::size_t part = 0; part < counts.size(); ++part) {
      const double all = kAssumed + std::accumulate(counts[part].begin(), counts[part].end(), 0.0);
      for (std::size_t l = 0; l < kNumSurfaceLabels; ++l)
        priors_[part][l] = (kAssumed * priors_[part][l] + counts[part][l]) / all;
    }
  }

  template <typename Label>
  ClassColors collected(const Label& label) const {
    ClassColors colors;
    for (std::size_t s = 0; s < seedFrames_.size(); ++s) {
      const PosedDepthFrame& frame = frames_[seedFrames_[s]];
      if (frame.color.rgb.empty())
        continue;
      for (std::size_t i = 0; i < frame.depth.size(); ++i) {
        const std::uint8_t l = frame.depth[i] > 0.0F ? label(s, i) : std::uint8_t{kNoLabel};
        if (l != kNoLabel)
          colors[l - 1U].push_back(colorAt(frame, i));
      }
    }
    for (auto& ofClass : colors)
      ofClass = thinned(ofClass, options_.colorsPerClass);
    return colors;
  }

  /// Is a labelled pixel away from other labels? At their edges, colours are mixed.
  static bool isInside(const PosedDepthFrame& frame, std::size_t pixel) {
    constexpr int kReach = 2;  // [px]: what JPEG's halved chroma smears
    const int width = frame.camera.width;
    const int x = static_cast<int>(pixel) % width;
    const int y = static_cast<int>(pixel) / width;
    if (x < kReach || y < kReach || x + kReach >= width || y + kReach >= frame.camera.height)
      return false;
    for (int dy = -kReach; dy <= kReach; ++dy) {
      const auto row = frame.labels.begin() + (y + dy) * width + x;
      const auto other = [&](std::uint8_t label) { return label != frame.labels[pixel]; };
      if (std::any_of(row - kReach, row + kReach + 1, other))
        return false;
    }
    return true;
  }

  ClassColors seedColors() const {
    return collected([&](std::size_t s, std::size_t i) -> std::uint8_t {
      const PosedDepthFrame& frame = frames_[seedFrames_[s]];
      if (fromLabels_ && isInside(frame, i))
        return frame.labels[i];
      if (fromLabels_)
        return kNoLabel;
      return seedParts_[s].sure[i] != 0 ? seedLabel(seedParts_[s].parts[i]) : kNoLabel;
    });
  }

  std::vector<Rgb> sureColors(BodyPart part) const {
    const auto isSure = [&](std::size_t s, std::size_t i) {
      return seedParts_[s].sure[i] != 0 && seedParts_[s].parts[i] == part;
    };
    return collected([&](std::size_t s, std::size_t i) -> std::uint8_t {
      return isSure(s, i) ? kUpperLabel : kNoLabel;
    })[kUpperLabel - 1U];
  }

  /// A long shirt hangs over hips and thighs, but not down to the knees: where that is how the
  /// chest's colours are spread, those on the thighs are no colours of the lower garment. That one
  /// shows on a good part of the thighs, or else above the knees: a short dress leaves its shades.
  /// Where it covers the knees, what else is on the thighs and nearer to the chest's colours is
  /// shades and prints of the shirt.
  ClassColors withoutUpperOnThighs(ClassColors colors) const {
    std::vector<Rgb>& lower = colors[kLowerLabel - 1U];
    for (const auto& ofClass : colors) {
      if (ofClass.size() < kFewestColors)
        return colors;
    }
    const SimilarColors upper(colors[kUpperLabel - 1U]);
    const std::vector<Rgb> hips = sureColors(BodyPart::kHip);
    const std::vector<Rgb> aboveKnees = sureColors(BodyPart::kLowerThigh);
    const bool seesKnees = aboveKnees.size() >= kFewestColors;
    constexpr double kCovered = 0.8;
    constexpr double kFree = 0.3;
    if ((hips.size() >= kFewestColors && upper.shareOf(hips) < kCovered) ||
        (seesKnees && upper.shareOf(aboveKnees) > kFree))
      return colors;
    std::vector<Rgb> shown = upper.unlike(lower);
    constexpr double kGoodPart = 0.25;
    const bool hangsOver =
        static_cast<double>(shown.size()) < kGoodPart * static_cast<double>(lower.size());
    if (hangsOver && !seesKnees) {
      lower.clear();  // the picture ends before the hem does
      return colors;
    }
    const std::vector<Rgb> cloth =
        SimilarColors(colors[kSkinLabel - 1U]).unlike(upper.unlike(aboveKnees));
    const bool coversKnees = cloth.size() >= kFewestColors && 2 * cloth.size() >= aboveKnees.size();
    if (coversKnees) {
      const SimilarColors trousers(cloth);
      const std::vector<Rgb> shades = upper.nearerThan(trousers, trousers.unlike(shown));
      shown = trousers.like(shown);
      shown.insert(shown.end(), cloth.begin(), cloth.end());
      colors[kUpperLabel - 1U].insert(colors[kUpperLabel - 1U].end(), shades.begin(), shades.end());
    } else if (hangsOver) {
      return colors;
    }
    if (shown.size() >= kFewestColors)
      lower = thinned(shown, options_.colorsPerClass);
    return colors;
  }

  std::vector<std::vector<std::uint8_t>> seedLabels() const {
    std::vector<std::vector<std::uint8_t>> labels;
    labels.reserve(seedFrames_.size());
    for (std::size_t s = 0; s < seedFrames_.size(); ++s)
      labels.push_back(labelsOf(frames_[seedFrames_[s]], seedParts_[s]));
    return labels;
  }

  /// Which of the garments a part mostly shows, as labelled so far: a shirt that hangs over the
  /// thighs does so all around. How much of it is skin stays as assumed: hair of a shirt's colour
  /// would become shirt.
  void learnWhatIsOnTop(const std::vector<std::vector<std::uint8_t>>& labels) {
    constexpr double kAssumed = 0.5;  // share of what was likely beforehand
    const std::array<LabelFrequencies, kNumBodyParts> counts = countsOfParts(labels);
    for (std::size_t part = 0; part < counts.size(); ++part) {
      const LabelFrequencies usual = labelPrior(static_cast<BodyPart>(part));
      constexpr std::size_t kUpper = kUpperLabel - 1U;
      constexpr std::size_t kLower = kLowerLabel - 1U;
      const double seen = counts[part][kUpper] + counts[part][kLower];
      const double covered = usual[kUpper] + usual[kLower];
      for (const std::size_t garment : {kUpper, kLower}) {
        if (seen > 0.0)
          priors_[part][garment] =
              kAssumed * usual[garment] + (1.0 - kAssumed) * covered * counts[part][garment] / seen;
      }
    }
  }

  void learn(const ClassColors& colors) {
    std::vector<ColorModel> models;
    for (std::size_t l = 0; l < colors.size(); ++l) {
      worn_[l] = colors[l].size() >= kFewestColors && !(table_ && !worn_[l]);
      models.emplace_back(worn_[l] ? colors[l] : std::vector<Rgb>{Rgb{}});
    }
    if (!table_)
      compare(colors, models);
    table_.emplace(models);
  }

  /// What can't be told apart by colour is said, and taken as one.
  void compare(const ClassColors& colors, const std::vector<ColorModel>& models) {
    const auto same = [&](SurfaceLabel a, SurfaceLabel b) {
      const std::size_t i = a - 1U;
      const std::size_t j = b - 1U;
      return worn_[i] && worn_[j] &&
             separability(colors[i], models[i], colors[j], models[j]) < options_.sameColor;
    };
    for (const SurfaceLabel garment : {kUpperLabel, kLowerLabel}) {
      if (!worn_[garment - 1U]) {
        result_.warnings.push_back(
            std::string("nothing is seen where a ") + nameOf(garment - 1U) +
            " would be: none is made");
      } else if (!fromLabels_ && same(kSkinLabel, garment)) {
        worn_[garment - 1U] = false;
        result_.warnings.push_back(
            std::string("where a ") + nameOf(garment - 1U) +
            " would be, the colour is the skin's: taken as bare; if it is clothed, give label "
            "images (labels/000000.png, ...)");
      }
    }
    if (options_.onePiece)
      mergeGarments();
    else if (same(kUpperLabel, kLowerLabel))
      takeAsOnePiece();
  }

  void mergeGarments() {
    result_.onePiece = true;
    worn_[kLowerLabel - 1U] = false;
  }

  void takeAsOnePiece() {
    if (fromLabels_)
      throw std::runtime_error(
          "upper and lower garment have the same colour: nothing tells where one ends in the "
          "frames without labels; give label images for all frames of the turn, or let "
          "--parsing label them all (--parsing-frames 10000)");
    if (legsApart(frames_, skinning_, shaped_))
      throw std::runtime_error(
          "upper and lower garment have the same colour: nothing tells where one ends; give label "
          "images (labels/000000.png, ...: 0 background, 1 skin, 2 upper, 3 lower garment), or say "
          "--one-piece for an overall");
    result_.warnings.emplace_back(
        "upper and lower garment have the same colour and the legs are covered together: taken as "
        "one piece, a dress; if it is two garments, give label images (labels/000000.png, ...)");
    mergeGarments();
  }

  /// −log posterior of each class, averaged over the neighbourhood that shows the person.
  std::vector<std::uint8_t> labelsOf(const PosedDepthFrame& frame, const PartImage& parts) const {
    if (!frame.labels.empty())
      return givenLabels(frame);
    const cv::Size size(frame.camera.width, frame.camera.height);
    constexpr float kNever = 50.0F;
    constexpr int kWindow = 5;  // [px]
    std::array<cv::Mat, kNumSurfaceLabels> costs;
    for (std::size_t l = 0; l < costs.size(); ++l) {
      costs[l] = cv::Mat::zeros(size, CV_32F);
      auto* cost = costs[l].ptr<float>();
      for (std::size_t i = 0; i < frame.depth.size(); ++i) {
        if (frame.depth[i] > 0.0F)
          cost[i] = worn_[l] ? costOf(frame, parts, l, i) : kNever;
      }
      cv::blur(costs[l], costs[l], {kWindow, kWindow}, {-1, -1}, cv::BORDER_CONSTANT);
    }
    std::vector<std::uint8_t> labels(frame.depth.size(), kNoLabel);
    for (std::size_t i = 0; i < labels.size(); ++i) {
      if (frame.depth[i] <= 0.0F)
        continue;
      std::size_t best = 0;
      for (std::size_t l = 1; l < costs.size(); ++l) {
        if (costs[l].ptr<float>()[i] < costs[best].ptr<float>()[i])
          best = l;
      }
      labels[i] = static_cast<std::uint8_t>(best + 1);
    }
    takeShoes(parts, frame.camera.width, labels);
    takeShodFeet(parts, frame.camera.width, labels);
    return labels;
  }

  /// What is worn on the feet goes with the body, whatever its colour: patches of a garment that
  /// end about the ankle.
  static void takeShoes(const PartImage& parts, int width, std::vector<std::uint8_t>& labels) {
    const cv::Mat image(static_cast<int>(labels.size()) / width, width, CV_8U, labels.data());
    for (const SurfaceLabel garment : {kUpperLabel, kLowerLabel}) {
      cv::Mat patches;
      const int count = cv::connectedComponents(image == garment, patches);
      std::vector<int> pixels(static_cast<std::size_t>(count), 0);
      std::vector<int> onFeet(static_cast<std::size_t>(count), 0);
      const int* patchOf = patches.ptr<int>();
      for (std::size_t i = 0; i < labels.size(); ++i) {
        const auto patch = static_cast<std::size_t>(patchOf[i]);
        ++pixels[patch];
        onFeet[patch] += parts.parts[i] == BodyPart::kFoot ? 1 : 0;
      }
      for (std::size_t i = 0; i < labels.size(); ++i) {
        const auto patch = static_cast<std::size_t>(patchOf[i]);
        if (labels[i] == garment && 2 * onFeet[patch] > pixels[patch])
          labels[i] = kSkinLabel;
      }
    }
  }

  /// No trousers reach over all of a foot: what looks so is a shoe of their colour, though no patch
  /// of its own.
  static void takeShodFeet(const PartImage& parts, int width, std::vector<std::uint8_t>& labels) {
    constexpr double kShod = 0.7;  // of what is seen of a foot
    cv::Mat feet(static_cast<int>(labels.size()) / width, width, CV_8U);
    for (std::size_t i = 0; i < labels.size(); ++i)
      feet.data[i] = parts.parts[i] == BodyPart::kFoot && labels[i] != kNoLabel ? 1 : 0;
    cv::Mat footOf;
    const int count = cv::connectedComponents(feet, footOf);
    std::vector<int> pixels(static_cast<std::size_t>(count), 0);
    std::vector<int> cloth(static_cast<std::size_t>(count), 0);
    const int* foot = footOf.ptr<int>();
    for (std::size_t i = 0; i < labels.size(); ++i) {
      ++pixels[static_cast<std::size_t>(foot[i])];
      cloth[static_cast<std::size_t>(foot[i])] += labels[i] > kSkinLabel ? 1 : 0;
    }
    for (std::size_t i = 0; i < labels.size(); ++i) {
      const auto place = static_cast<std::size_t>(foot[i]);
      if (foot[i] > 0 && cloth[place] > kShod * pixels[place])
        labels[i] = kSkinLabel;
    }
  }

  float costOf(
      const PosedDepthFrame& frame, const PartImage& parts, std::size_t l, std::size_t i) const {
    LabelFrequencies prior = priors_[static_cast<std::size_t>(parts.parts[i])];
    if (result_.onePiece)
      prior[kUpperLabel - 1U] += prior[kLowerLabel - 1U];
    return -(*table_)(l, &frame.color.rgb[3 * i]) - static_cast<float>(std::log(prior[l]));
  }

  const std::vector<PosedDepthFrame>& frames_;
  const Skinning& skinning_;
  FrameParsingOptions options_;
  ShapedBody shaped_;
  std::vector<BodyPart> parts_;
  std::vector<std::size_t> seedFrames_;
  std::vector<PartImage> seedParts_;
  std::array<LabelFrequencies, kNumBodyParts> priors_ = {};  // of what a part shows; sum to 1
  bool fromLabels_ = false;
  std::array<bool, kNumSurfaceLabels> worn_ = {true, true, true};  // skin is always "worn"
  std::optional<ColorTable> table_;
  FrameParsing result_;
};

}  // namespace

void FrameParsingOptions::validate() const {
  const auto demand = [](bool holds, const char* what) {
    if (!holds)
      throw std::invalid_argument(std::string("FrameParsingOptions: ") + what);
  };
  demand(seedFrames >= 1, "seedFrames is expected at 1 or above");
  demand(colorsPerClass >= 100, "colorsPerClass is expected at 100 or above");
  demand(rounds >= 0 && rounds <= 10, "rounds is expected in 0 ... 10");
  demand(sameColor >= 0.5 && sameColor <= 1.0, "sameColor is expected in 0.5 ... 1");
  demand(runLoop != nullptr, "runLoop is missing");
}

FrameParsing parsedFrames(
    const std::vector<PosedDepthFrame>& frames,
    const Skinning& skinning,
    const Eigen::VectorXd& betas,
    const FrameParsingOptions& options) {
  options.validate();
  for (const PosedDepthFrame& frame : frames)
    requireValid(frame);
  return FrameParser(frames, skinning, betas, options).run();
}

}  // namespace avatar

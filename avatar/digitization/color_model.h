#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <vector>

namespace avatar {

/// 8-bit RGB.
using Rgb = std::array<std::uint8_t, 3>;

/// Colours of one kind of surface: Gaussians about the centres of K-means, in CIE L*a*b* with the
/// lightness at half its weight, since light differs from place to place.
class ColorModel {
 public:
  /// The same colours in the same order give the same model. Throws std::invalid_argument without
  /// colours, or for centres outside 1 … 16.
  explicit ColorModel(const std::vector<Rgb>& colors, int centres = 4);

  /// Log of the density at each colour, per unit of L*/2, a* and b*.
  std::vector<float> logLikelihoods(const std::vector<Rgb>& colors) const;

 private:
  struct Cluster {
    Eigen::Vector3f mean = Eigen::Vector3f::Zero();
    Eigen::Vector3f precision = Eigen::Vector3f::Zero();  // 1 / variance
    float logWeight = 0.0F;                               // with the Gaussian's norm
  };

  std::vector<Cluster> clusters_;
};

/// Tells colours like those of one kind of surface: all but the rarest of them are.
class SimilarColors {
 public:
  /// Throws std::invalid_argument without colours.
  explicit SimilarColors(const std::vector<Rgb>& colors);

  std::vector<Rgb> like(const std::vector<Rgb>& colors) const { return chosen(colors, true); }

  std::vector<Rgb> unlike(const std::vector<Rgb>& colors) const { return chosen(colors, false); }

  /// Those that are more like these than like others.
  std::vector<Rgb> nearerThan(const SimilarColors& others, const std::vector<Rgb>& colors) const;

  /// Of colours, those like these, 0 … 1.
  double shareOf(const std::vector<Rgb>& colors) const;

 private:
  std::vector<Rgb> chosen(const std::vector<Rgb>& colors, bool alike) const;

  ColorModel model_;
  float least_ = 0.0F;  // log-likelihood
};

/// Several models at once, looked up per colour in cells of 1/32 of each channel.
class ColorTable {
 public:
  explicit ColorTable(const std::vector<ColorModel>& models);

  /// Log-likelihood of model m.
  float operator()(std::size_t model, const std::uint8_t* rgb) const {
    return values_[model][cell(rgb)];
  }

 private:
  static constexpr int kBits = 5;

  static std::size_t cell(const std::uint8_t* rgb) {
    constexpr int kShift = 8 - kBits;
    return static_cast<std::size_t>(
        ((rgb[0] >> kShift) << (2 * kBits)) | ((rgb[1] >> kShift) << kBits) | (rgb[2] >> kShift));
  }

  std::vector<std::vector<float>> values_;
};

/// Share of the colours, the mean over both sets, that the models of their own set explain better
/// than the other's: 0.5 = they can't be told apart, 1 = always.
double separability(
    const std::vector<Rgb>& a,
    const ColorModel& ofA,
    const std::vector<Rgb>& b,
    const ColorModel& ofB);

}  // namespace avatar

#include "avatar/digitization/color_model.h"

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <stdexcept>

namespace avatar {
namespace {

constexpr float kLightnessWeight = 0.5F;
constexpr float kNoise = 4.0F;      // standard deviation of one surface's colour, at least
constexpr float kOutliers = 1e-8F;  // density of any colour at all: about one in 10⁶ of their space

/// N × 3 of (L*/2, a*, b*).
cv::Mat labColors(const std::vector<Rgb>& colors) {
  cv::Mat rgb(static_cast<int>(colors.size()), 1, CV_32FC3);
  for (std::size_t i = 0; i < colors.size(); ++i)
    rgb.at<cv::Vec3f>(static_cast<int>(i)) =
        cv::Vec3f(colors[i][0], colors[i][1], colors[i][2]) / 255.0F;
  cv::Mat lab;
  cv::cvtColor(rgb, lab, cv::COLOR_RGB2Lab);
  for (int i = 0; i < lab.rows; ++i)
    lab.at<cv::Vec3f>(i)[0] *= kLightnessWeight;
  return lab.reshape(1, lab.rows);
}

Eigen::Vector3f rowOf(const cv::Mat& lab, int row) {
  return {lab.at<float>(row, 0), lab.at<float>(row, 1), lab.at<float>(row, 2)};
}

}  // namespace

ColorModel::ColorModel(const std::vector<Rgb>& colors, int centres) {
  if (colors.empty() || centres < 1 || centres > 16)
    throw std::invalid_argument("ColorModel: colours and 1 ... 16 centres are expected");
  const cv::Mat lab = labColors(colors);
  const int count = std::min(centres, lab.rows);
  cv::Mat labels;
  cv::theRNG().state = 0x5eed;  // K-means++ draws from here
  cv::kmeans(
      lab,
      count,
      labels,
      cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 20, 0.1),
      1,
      cv::KMEANS_PP_CENTERS);
  std::vector<float> sizes(static_cast<std::size_t>(count), 0.0F);
  clusters_.resize(static_cast<std::size_t>(count));
  const auto clusterOf = [&](int i) { return static_cast<std::size_t>(labels.at<int>(i)); };
  for (int i = 0; i < lab.rows; ++i) {
    sizes[clusterOf(i)] += 1.0F;
    clusters_[clusterOf(i)].mean += rowOf(lab, i);
  }
  for (std::size_t k = 0; k < clusters_.size(); ++k)
    clusters_[k].mean /= std::max(1.0F, sizes[k]);
  std::vector<Eigen::Vector3f> variances(clusters_.size(), Eigen::Vector3f::Zero());
  for (int i = 0; i < lab.rows; ++i)
    variances[clusterOf(i)] += (rowOf(lab, i) - clusters_[clusterOf(i)].mean).cwiseAbs2();
  for (std::size_t k = 0; k < clusters_.size(); ++k) {
    const Eigen::Vector3f variance =
        (variances[k] / std::max(1.0F, sizes[k])).array() + kNoise * kNoise;
    clusters_[k].precision = variance.cwiseInverse();
    const float share = std::max(sizes[k], 0.5F) / static_cast<float>(lab.rows);
    clusters_[k].logWeight = std::log(share) - 0.5F * std::log(variance.prod()) -
                             1.5F * std::log(2.0F * std::numbers::pi_v<float>);
  }
}

std::vector<float> ColorModel::logLikelihoods(const std::vector<Rgb>& colors) const {
  if (colors.empty())
    return {};
  const cv::Mat lab = labColors(colors);
  std::vector<float> result;
  result.reserve(colors.size());
  for (int i = 0; i < lab.rows; ++i) {
    float density = kOutliers;
    for (const Cluster& cluster : clusters_) {
      const Eigen::Vector3f off = rowOf(lab, i) - cluster.mean;
      density += std::exp(cluster.logWeight - 0.5F * off.cwiseAbs2().dot(cluster.precision));
    }
    result.push_back(std::log(density));
  }
  return result;
}

SimilarColors::SimilarColors(const std::vector<Rgb>& colors) : model_(colors) {
  constexpr double kRare = 0.05;  // of its own colours
  std::vector<float> own = model_.logLikelihoods(colors);
  const auto place =
      own.begin() + static_cast<std::ptrdiff_t>(kRare * static_cast<double>(own.size()));
  std::nth_element(own.begin(), place, own.end());
  least_ = *place;
}

std::vector<Rgb> SimilarColors::chosen(const std::vector<Rgb>& colors, bool alike) const {
  const std::vector<float> densities = model_.logLikelihoods(colors);
  std::vector<Rgb> result;
  for (std::size_t i = 0; i < colors.size(); ++i) {
    if ((densities[i] >= least_) == alike)
      result.push_back(colors[i]);
  }
  return result;
}

std::vector<Rgb> SimilarColors::nearerThan(
    const SimilarColors& others, const std::vector<Rgb>& colors) const {
  const std::vector<float> here = model_.logLikelihoods(colors);
  const std::vector<float> there = others.model_.logLikelihoods(colors);
  std::vector<Rgb> result;
  for (std::size_t i = 0; i < colors.size(); ++i) {
    if (here[i] > there[i])
      result.push_back(colors[i]);
  }
  return result;
}

double SimilarColors::shareOf(const std::vector<Rgb>& colors) const {
  return colors.empty()
             ? 0.0
             : static_cast<double>(like(colors).size()) / static_cast<double>(colors.size());
}

ColorTable::ColorTable(const std::vector<ColorModel>& models) {
  constexpr int kCells = 1 << kBits;
  constexpr int kWidth = 256 / kCells;
  std::vector<Rgb> colors;
  colors.reserve(kCells * kCells * kCells);
  const auto middle = [](int cell) {
    return static_cast<std::uint8_t>(cell * kWidth + kWidth / 2);
  };
  for (int i = 0; i < kCells * kCells * kCells; ++i)
    colors.push_back(
        {middle(i / (kCells * kCells)), middle(i / kCells % kCells), middle(i % kCells)});
  values_.reserve(models.size());
  for (const ColorModel& model : models)
    values_.push_back(model.logLikelihoods(colors));
}

double separability(
    const std::vector<Rgb>& a,
    const ColorModel& ofA,
    const std::vector<Rgb>& b,
    const ColorModel& ofB) {
  const auto share =
      [](const std::vector<Rgb>& colors, const ColorModel& own, const ColorModel& other) {
        const std::vector<float> inOwn = own.logLikelihoods(colors);
        const std::vector<float> inOther = other.logLikelihoods(colors);
        double right = 0.0;
        for (std::size_t i = 0; i < colors.size(); ++i)
          right += inOwn[i] > inOther[i] ? 1.0 : inOwn[i] == inOther[i] ? 0.5 : 0.0;
        return colors.empty() ? 0.5 : right / static_cast<double>(colors.size());
      };
  return 0.5 * (share(a, ofA, ofB) + share(b, ofB, ofA));
}

}  // namespace avatar

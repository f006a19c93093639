#include "src/digitization/human_parser.h"

#include "avatar/io/file_error.h"

#include <opencv2/core/utils/logger.hpp>
#include <opencv2/dnn.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <utility>

namespace simulcap {
namespace {

namespace fs = std::filesystem;

/// OpenCV prints what it throws as well; our errors are one line.
class QuietOpenCv {
 public:
  QuietOpenCv() : level_(cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT)) {
    cv::redirectError([](int, const char*, const char*, const char*, int, void*) { return 0; });
  }

  ~QuietOpenCv() {
    cv::redirectError(nullptr);
    cv::utils::logging::setLogLevel(level_);
  }

  QuietOpenCv(const QuietOpenCv&) = delete;
  QuietOpenCv(QuietOpenCv&&) = delete;
  QuietOpenCv& operator=(const QuietOpenCv&) = delete;
  QuietOpenCv& operator=(QuietOpenCv&&) = delete;

 private:
  cv::utils::logging::LogLevel level_;
};

/// The first line of what OpenCV says was wrong.
std::string reason(const cv::Exception& error) {
  return error.err.substr(0, error.err.find('\n'));
}

std::string shapeText(const cv::Mat& blob) {
  std::string text;
  for (int i = 0; i < blob.dims; ++i)
    text += (i > 0 ? " x " : "") + std::to_string(blob.size[i]);
  return text;
}

cv::dnn::Net readNetwork(const std::string& model) {
  if (!fs::is_regular_file(model))
    throw avatar::FileError(model, "", "no such file; expected a human-parsing network");
  const std::string extension = fs::path(model).extension().string();
  const std::string prototxt = fs::path(model).replace_extension(".prototxt").string();
  if (extension != ".onnx" && extension != ".caffemodel" && extension != ".pb")
    throw avatar::FileError(
        model, "", "expected a human-parsing network as .onnx, .caffemodel or .pb");
  if (extension == ".caffemodel" && !fs::is_regular_file(prototxt))
    throw avatar::FileError(prototxt, "", "no such file; it describes the network beside it");
  try {
    cv::dnn::Net network = extension == ".caffemodel" ? cv::dnn::readNetFromCaffe(prototxt, model)
                           : extension == ".pb"       ? cv::dnn::readNetFromTensorflow(model)
                                                      : cv::dnn::readNetFromONNX(model);
    if (network.empty())
      throw avatar::FileError(model, "", "is a network without layers");
    network.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
    network.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
    return network;
  } catch (const cv::Exception& error) {
    throw avatar::FileError(
        model, "", "is no network that OpenCV " CV_VERSION " can read: " + reason(error));
  }
}

}  // namespace

class HumanParser::Network {
 public:
  explicit Network(const std::string& model)
      : model_(model), description_(parsingDescription(model)), network_(readNetwork(model)) {
    scores(cv::Mat::zeros(description_.height, description_.width, CV_32FC3));
  }

  std::vector<ParsingClass> classes(const avatar::ColorImage& picture) {
    const cv::Mat rgb(
        picture.height,
        picture.width,
        CV_8UC3,
        // OpenCV has no view of what is const; it is only read.
        const_cast<std::uint8_t*>(
            picture.rgb.data()));  // NOLINT(cppcoreguidelines-pro-type-const-cast)
    const cv::Rect place = placeOf(rgb.size());
    return bestClasses(scores(prepared(rgb, place)), place, rgb.size());
  }

 private:
  /// Of a picture within the input [px].
  cv::Rect placeOf(const cv::Size& size) const {
    const cv::Size input(description_.width, description_.height);
    if (!description_.keepAspect)
      return {{0, 0}, input};
    const double zoom = std::min(
        static_cast<double>(input.width) / size.width,
        static_cast<double>(input.height) / size.height);
    const cv::Size shown(
        std::clamp(static_cast<int>(std::lround(zoom * size.width)), 1, input.width),
        std::clamp(static_cast<int>(std::lround(zoom * size.height)), 1, input.height));
    return {{(input.width - shown.width) / 2, (input.height - shown.height) / 2}, shown};
  }

  /// Height × width × 3 numbers as the network wants them.
  cv::Mat prepared(const cv::Mat& rgb, const cv::Rect& place) const {
    cv::Mat ordered = rgb;
    if (!description_.rgb)
      cv::cvtColor(rgb, ordered, cv::COLOR_RGB2BGR);
    cv::Mat resized;
    const bool shrinks = place.height < rgb.rows;
    cv::resize(ordered, resized, place.size(), 0, 0, shrinks ? cv::INTER_AREA : cv::INTER_LINEAR);
    resized.convertTo(resized, CV_32F);
    const auto& [m0, m1, m2] = description_.mean;
    const auto& [s0, s1, s2] = description_.scale;
    cv::subtract(resized, cv::Scalar(m0, m1, m2), resized);
    cv::multiply(resized, cv::Scalar(s0, s1, s2), resized);
    cv::Mat input = cv::Mat::zeros(description_.height, description_.width, CV_32FC3);
    resized.copyTo(input(place));
    return input;
  }

  /// 1 × C × h × w.
  cv::Mat scores(const cv::Mat& input) {
    cv::Mat output;
    try {
      network_.setInput(cv::dnn::blobFromImage(input));
      output = network_.forward();
    } catch (const cv::Exception& error) {
      throw avatar::FileError(
          model_,
          "input",
          "the network can't take 1 x 3 x " + std::to_string(description_.height) + " x " +
              std::to_string(description_.width) + " (" + reason(error) +
              "); say its size in \"width\" and \"height\" of a .json file beside it");
    }
    const auto numClasses = static_cast<int>(description_.classes.size());
    if (output.dims != 4 || output.size[0] != 1 || output.size[1] != numClasses ||
        output.type() != CV_32F)
      throw avatar::FileError(
          model_,
          "output",
          "is " + shapeText(output) + ", expected 1 x " + std::to_string(numClasses) +
              " x height x width, the scores of the classes; if they aren't LIP's 20, name them in "
              "\"classes\" of a .json file beside it");
    if (!cv::checkRange(output))
      throw avatar::FileError(model_, "output", "has scores that are not finite numbers");
    return output;
  }

  std::vector<ParsingClass> bestClasses(
      cv::Mat scores, const cv::Rect& place, const cv::Size& size) const {
    const int rows = scores.size[2];
    const int columns = scores.size[3];
    // The picture's place within the output, whose pixels cover the input's evenly.
    const double x = static_cast<double>(columns) / description_.width;
    const double y = static_cast<double>(rows) / description_.height;
    const cv::Matx23d outputFromPicture(
        x * place.width / size.width,
        0.0,
        x * (place.x + 0.5 * place.width / size.width) - 0.5,
        0.0,
        y * place.height / size.height,
        y * (place.y + 0.5 * place.height / size.height) - 0.5);
    cv::Mat best(size, CV_32F, cv::Scalar(-std::numeric_limits<float>::max()));
    cv::Mat classes(size, CV_8U, cv::Scalar(0));
    for (std::size_t c = 0; c < description_.classes.size(); ++c) {
      const cv::Mat channel(rows, columns, CV_32F, scores.ptr<float>(0, static_cast<int>(c)));
      cv::Mat score;
      cv::warpAffine(
          channel,
          score,
          outputFromPicture,
          size,
          cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
          cv::BORDER_REPLICATE);
      const cv::Mat better = score > best;
      score.copyTo(best, better);
      classes.setTo(cv::Scalar(description_.classes[c]), better);
    }
    std::vector<ParsingClass> result;
    result.reserve(classes.total());
    std::transform(
        classes.begin<std::uint8_t>(),
        classes.end<std::uint8_t>(),
        std::back_inserter(result),
        [](std::uint8_t c) { return static_cast<ParsingClass>(c); });
    return result;
  }

  std::string model_;
  ParsingDescription description_;
  cv::dnn::Net network_;
};

HumanParser::HumanParser(const std::string& model) {
  const QuietOpenCv quiet;
  network_ = std::make_unique<Network>(model);
}

HumanParser::~HumanParser() = default;
HumanParser::HumanParser(HumanParser&&) noexcept = default;
HumanParser& HumanParser::operator=(HumanParser&&) noexcept = default;

std::vector<ParsingClass> HumanParser::operator()(const avatar::ColorImage& picture) {
  if (picture.width < 1 || picture.height < 1 ||
      picture.rgb.size() !=
          3 * static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height))
    throw std::invalid_argument("HumanParser: the picture hasn't the size it says");
  const QuietOpenCv quiet;
  return network_->classes(picture);
}

}  // namespace simulcap

#include "src/capture/capture_figures.h"

#include "src/evaluation/truth_comparison.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <vector>

namespace simulcap {
namespace {

avatar::NpyArray column(const std::vector<double>& values) {
  return avatar::NpyArray::fromMatrix(
      Eigen::Map<const Eigen::VectorXd>(values.data(), std::ssize(values)));
}

std::vector<double> numbers(const avatar::NpyArray& array) {
  std::vector<double> values(static_cast<std::size_t>(array.size()));
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = array.at(static_cast<std::int64_t>(i));
  return values;
}

}  // namespace

void CaptureFigures::add(
    const CaptureResult& frame, const avatar::Camera& camera, const DepthCloud& cloud) {
  framesLost_ += frame.status == TrackingStatus::kLost ? 1 : 0;
  framesUnstable_ += frame.stable ? 0 : 1;
  for (const CapturedGarment& garment : frame.garments) {
    addDepthErrors(garment.unfitted, garment.visible, camera, cloud, before_);
    addDepthErrors(garment.vertices, garment.visible, camera, cloud, after_);
    targets_ += std::count_if(
        garment.provenance.begin(), garment.provenance.end(), [](int p) { return p > 0; });
    noDepth_ += garment.rejected.noDepth;
    otherLayer_ += garment.rejected.otherLayer;
    tooFar_ += garment.rejected.tooFar;
    outliers_ += garment.rejected.outliers;
  }
}

nlohmann::json CaptureFigures::json() const {
  nlohmann::json figures = {{"frames_lost", framesLost_}, {"frames_unstable", framesUnstable_}};
  if (!before_.millimetres.empty()) {
    figures["depth_error_before_fit_mm"] = distributionJson(before_.millimetres);
    figures["depth_error_mm"] = distributionJson(after_.millimetres);
  }
  if (targets_ > 0)
    figures["depth_targets"] = {
        {"fitted", targets_},
        {"no_depth", noDepth_},
        {"other_layer", otherLayer_},
        {"too_far", tooFar_},
        {"outliers", outliers_}};
  return figures;
}

avatar::NpzArrays CaptureFigures::state() const {
  const std::vector<std::int64_t> counts = {
      framesLost_,
      framesUnstable_,
      targets_,
      noDepth_,
      otherLayer_,
      tooFar_,
      outliers_,
      before_.unmeasured,
      after_.unmeasured};
  return {
      {"figures_counts", column({counts.begin(), counts.end()})},
      {"figures_before", column(before_.millimetres.state())},
      {"figures_after", column(after_.millimetres.state())}};
}

void CaptureFigures::restore(const avatar::NpzArrays& state) {
  const std::vector<double> counts = numbers(state.at("figures_counts"));
  std::size_t next = 0;
  for (std::int64_t* count :
       {&framesLost_,
        &framesUnstable_,
        &targets_,
        &noDepth_,
        &otherLayer_,
        &tooFar_,
        &outliers_,
        &before_.unmeasured,
        &after_.unmeasured})
    *count = static_cast<std::int64_t>(counts.at(next++));
  before_.millimetres.restore(numbers(state.at("figures_before")));
  after_.millimetres.restore(numbers(state.at("figures_after")));
}

}  // namespace simulcap

#include "src/digitization/rest_shape.h"

#include "avatar/garment_clearance.h"
#include "avatar/geometry/closest_point.h"
#include "avatar/wardrobe/dressing_body.h"

#include <algorithm>
#include <deque>
#include <limits>
#include <stdexcept>
#include <utility>

namespace simulcap {
namespace {

/// Mean distance of corresponding columns.
double meanDistance(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  return (a - b).colwise().norm().mean();
}

/// Each vertex's value becomes the mean of its own and its neighbours'.
Eigen::Matrix3Xd smoothed(const Eigen::Matrix3Xd& values, const Eigen::Matrix3Xi& faces) {
  // An edge has two faces.
  Eigen::Matrix3Xd sum = values;
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(values.cols());
  for (const auto& face : faces.colwise()) {
    for (int corner = 0; corner < 3; ++corner) {
      const int from = face[corner];
      const int to = face[(corner + 1) % 3];
      sum.col(to) += 0.5 * values.col(from);
      sum.col(from) += 0.5 * values.col(to);
      weight[to] += 0.5;
      weight[from] += 0.5;
    }
  }
  return sum * weight.cwiseInverse().asDiagonal();
}

/// How rest shapes may differ from captured ones. Cloth that slips in a fold comes no nearer to
/// where it was captured, however its rest shape is moved, which would be moved on and on.
Eigen::Matrix3Xd plausible(Eigen::Matrix3Xd moves, const Eigen::Matrix3Xi& faces) {
  constexpr double kMost = 0.04;  // [m]
  constexpr int kSmoothing = 4;   // over some 4 cm
  for (auto move : moves.colwise())
    move *= kMost / std::max(kMost, move.norm());
  for (int i = 0; i < kSmoothing; ++i)
    moves = smoothed(moves, faces);
  return moves;
}

class RestShapeSearch {
 public:
  RestShapeSearch(const CapturePerson& person, const RestShapeOptions& options)
      : model_(person.model),
        options_(options),
        captured_(person.avatar),
        trial_(person.avatar),
        body_(avatar::standForDressing(
            person.model,
            person.avatar.body.betas,
            person.avatar.garments.empty() ? avatar::aPose()
                                           : person.avatar.garments.front().bindPose)) {
    for (avatar::Garment& garment : trial_.garments)
      garment.asWorn = false;
    bestDrift_.assign(trial_.garments.size(), std::numeric_limits<double>::infinity());
    best_.resize(trial_.garments.size());
  }

  DesaggedAvatar run() {
    DesaggedAvatar result{captured_, {}};
    for (int round = 0; round < options_.rounds; ++round) {
      if (options_.onRound)
        options_.onRound(round);
      const avatar::LayeredAvatar settled =
          draped({model_, trial_}, options_.threads, options_.seconds);
      for (std::size_t g = 0; g < trial_.garments.size(); ++g) {
        const double drift = assess(g, settled);
        if (round == 0)
          result.drift.push_back({captured_.garments[g].name, drift, drift});
      }
      for (std::size_t g = 0; g < trial_.garments.size(); ++g)
        improve(g, settled);
    }
    for (std::size_t g = 0; g < trial_.garments.size(); ++g) {
      if (!(bestDrift_[g] < result.drift[g].asWorn))
        continue;
      result.drift[g].desagged = bestDrift_[g];
      result.avatar.garments[g].mesh.vertices = best_[g];
      result.avatar.garments[g].asWorn = false;
    }
    return result;
  }

 private:
  const Eigen::Matrix3Xd& target(std::size_t g) const {
    return captured_.garments[g].mesh.vertices;
  }

  double assess(std::size_t g, const avatar::LayeredAvatar& settled) {
    const double drift = meanDistance(settled.garments[g].mesh.vertices, target(g));
    if (drift < bestDrift_[g]) {
      bestDrift_[g] = drift;
      best_[g] = trial_.garments[g].mesh.vertices;
    }
    return drift;
  }

  void improve(std::size_t g, const avatar::LayeredAvatar& settled) {
    Eigen::Matrix3Xd& rest = trial_.garments[g].mesh.vertices;
    rest = target(g) +
           plausible(
               rest - target(g) + options_.step * (target(g) - settled.garments[g].mesh.vertices),
               captured_.garments[g].mesh.faces);
    clear(g);
  }

  /// Off the skin and the rest shapes of inner layers, which come first.
  void clear(std::size_t g) {
    constexpr double kReach = 0.05;  // open surfaces have sides only near them [m]
    avatar::Garment& garment = trial_.garments[g];
    const double thickness = garment.cloth.thickness;
    std::deque<avatar::SignedDistance> surfaces;
    surfaces.emplace_back(body_.mesh());
    std::vector<avatar::ClearanceObstacle> obstacles = {
        {.surface = &surfaces.back(), .clearance = thickness}};
    for (std::size_t inner = 0; inner < g; ++inner) {
      if (trial_.garments[inner].layer >= garment.layer)
        continue;
      surfaces.emplace_back(trial_.garments[inner].mesh);
      obstacles.push_back({.surface = &surfaces.back(), .clearance = thickness, .reach = kReach});
    }
    garment.mesh.vertices = avatar::resolvePenetration(garment.mesh, obstacles).vertices;
  }

  const avatar::BodyModel& model_;
  const RestShapeOptions& options_;
  const avatar::LayeredAvatar& captured_;
  avatar::LayeredAvatar trial_;
  avatar::DressingBody body_;
  std::vector<Eigen::Matrix3Xd> best_;
  std::vector<double> bestDrift_;
};

}  // namespace

void RestShapeOptions::validate() const {
  const auto demand = [](bool holds, const char* what) {
    if (!holds)
      throw std::invalid_argument(std::string("RestShapeOptions: ") + what);
  };
  demand(rounds >= 1 && rounds <= 50, "rounds is expected in 1 ... 50");
  demand(step > 0.0 && step <= 1.0, "step is expected in (0, 1]");
  demand(seconds >= 0.1 && seconds <= 10.0, "seconds is expected in 0.1 ... 10");
  demand(threads >= 1, "threads is expected at 1 or above");
}

DesaggedAvatar desagged(const CapturePerson& person, const RestShapeOptions& options) {
  options.validate();
  return RestShapeSearch(person, options).run();
}

std::vector<Eigen::Matrix3Xd> restShapes(
    const CapturePerson& person, const RestShapeOptions& options) {
  const std::vector<avatar::Garment>& garments = person.avatar.garments;
  std::vector<Eigen::Matrix3Xd> shapes;
  if (std::none_of(
          garments.begin(), garments.end(), [](const auto& garment) { return garment.asWorn; }))
    return shapes;
  const DesaggedAvatar found = desagged(person, options);
  for (std::size_t i = 0; i < garments.size(); ++i)
    shapes.push_back((garments[i].asWorn ? found.avatar : person.avatar).garments[i].mesh.vertices);
  return shapes;
}

}  // namespace simulcap

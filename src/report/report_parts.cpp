#include "src/report/report_parts.h"

#include "avatar/geometry/adjacency.h"

#include <algorithm>
#include <cmath>

namespace simulcap {
namespace {

constexpr double kGarmentStep = 0.0002;  // [m]: finer than a screen shows
constexpr double kBodyStep = 0.0005;     // [m]: most of it is under the garments

/// Mean stretch stiffness of each vertex's edges as thousandths of its decimal logarithm.
std::vector<std::uint32_t> vertexStiffness(const avatar::Garment& garment) {
  const avatar::Adjacency adjacency =
      avatar::buildAdjacency(garment.mesh.faces, garment.mesh.numVertices());
  const auto vertices = static_cast<std::size_t>(garment.mesh.numVertices());
  std::vector<double> sum(vertices, 0.0), count(vertices, 0.0);
  for (Eigen::Index edge = 0; edge < adjacency.numEdges(); ++edge)
    for (int end = 0; end < 2; ++end) {
      const auto vertex = static_cast<std::size_t>(adjacency.edges(end, edge));
      sum[vertex] += garment.cloth.edgeStretchStiffness[static_cast<std::size_t>(edge)];
      count[vertex] += 1.0;
    }
  std::vector<std::uint32_t> values;
  values.reserve(vertices);
  for (std::size_t v = 0; v < vertices; ++v)
    values.push_back(static_cast<std::uint32_t>(
        std::lround(1000.0 * std::log10(std::max(1.0, sum[v] / std::max(1.0, count[v]))))));
  return values;
}

nlohmann::json colorJson(const Eigen::Vector3d& color) {
  return {color[0], color[1], color[2]};
}

/// 3 × V display values as a track of one frame, in bytes.
nlohmann::json colorsTrack(ReportPage& page, const Eigen::Matrix3Xd& colors) {
  std::vector<std::uint32_t> values;
  values.reserve(static_cast<std::size_t>(colors.size()));
  for (const double value : colors.reshaped())
    values.push_back(static_cast<std::uint32_t>(std::lround(255.0 * std::clamp(value, 0.0, 1.0))));
  return constantTrack(
      page,
      values,
      {.points = static_cast<int>(colors.cols()), .components = 3, .bytesPerValue = 1});
}

nlohmann::json materialJson(const avatar::ClothParameters& cloth) {
  nlohmann::json material = {
      {"stretch_k", cloth.stretchStiffness},
      {"torsion_w", cloth.torsionStiffness},
      {"damping", cloth.damping},
      {"friction", cloth.friction},
      {"thickness_m", cloth.thickness}};
  if (cloth.massMode == avatar::MassMode::kAreal)
    material["areal_density_kg_m2"] = cloth.arealDensity;
  else
    material["vertex_mass_kg"] = cloth.vertexMass;
  return material;
}

const avatar::Garment* madeGarment(const ReportInput& input, const std::string& name) {
  if (!input.avatar)
    return nullptr;
  for (const avatar::Garment& garment : input.avatar->garments)
    if (garment.name == name)
      return &garment;
  return nullptr;
}

}  // namespace

ReportParts::ReportParts(ReportPage& page, const ReportInput& input) : page_(page), input_(input) {
  if (input.body) {
    const avatar::AvatarBody& body = input.avatar->body;
    bodyLook_ = {
        {"name", "body"},
        {"kind", "body"},
        {"color", colorJson(body.color)},
        {"faces", facesTrack(page, body.mesh.faces)}};
    if (body.vertexColors.cols() > 0)
      bodyLook_["vertex_colors"] = colorsTrack(page, body.vertexColors);
    body_.emplace(page, kBodyStep);
  }
  for (const PerformanceLayout::Garment& garment : input.performance.layout().garments)
    addGarment(garment);
}

void ReportParts::addGarment(const PerformanceLayout::Garment& garment) {
  const avatar::Garment* made = madeGarment(input_, garment.name);
  nlohmann::json look = made != nullptr ? madeLook(*made) : nlohmann::json::object();
  look["name"] = garment.name;
  look["kind"] = "garment";
  look["faces"] = facesTrack(page_, garment.faces);
  garments_.push_back(
      {.look = std::move(look),
       .positions = PositionTrack(page_, kGarmentStep),
       .provenance = ValueTrack(page_, {.points = garment.numVertices, .bytesPerValue = 1}, 1),
       .strain = {}});
  if (made != nullptr)
    garments_.back().strain.emplace(made->mesh);
}

nlohmann::json ReportParts::madeLook(const avatar::Garment& made) {
  PositionTrack rest(page_, kGarmentStep);
  rest.add(made.mesh.vertices.cast<float>());
  nlohmann::json look = {
      {"color", colorJson(made.color)},
      {"layer", made.layer},
      {"material", materialJson(made.cloth)},
      {"rest", rest.finish()}};
  if (made.vertexColors.cols() > 0)
    look["vertex_colors"] = colorsTrack(page_, made.vertexColors);
  if (!made.cloth.edgeStretchStiffness.empty())
    look["stiffness"] = constantTrack(
        page_, vertexStiffness(made), {.points = static_cast<int>(made.mesh.numVertices())});
  return look;
}

ReportedFrame ReportParts::add(const PerformanceFrame& frame, FrameSeries& series) {
  ReportedFrame reported{.number = frame.recordingIndex, .body = {}, .garments = {}};
  if (body_) {
    reported.body = input_.body->vertices(frame.pose);
    body_->add(reported.body.cast<float>());
  }
  Distribution strains(1e-4);
  for (std::size_t i = 0; i < garments_.size(); ++i) {
    const PerformanceFrame::Garment& garment = frame.garments[i];
    GarmentPart& part = garments_[i];
    reported.garments.emplace_back(garment.vertices.cast<double>());
    part.positions.add(garment.vertices);
    part.provenance.add({garment.provenance.begin(), garment.provenance.end()});
    if (!part.strain)
      part.strain.emplace(avatar::TriangleMesh{
          reported.garments.back(), input_.performance.layout().garments[i].faces});
    part.strain->add(reported.garments.back(), strains);
  }
  series.add("strain_percent", strains, 100.0);
  return reported;
}

nlohmann::json ReportParts::finish() {
  nlohmann::json parts = nlohmann::json::array();
  if (body_) {
    bodyLook_["positions"] = body_->finish();
    parts.push_back(std::move(bodyLook_));
  }
  for (GarmentPart& part : garments_) {
    part.look["positions"] = part.positions.finish();
    part.look["provenance"] = part.provenance.finish();
    parts.push_back(std::move(part.look));
  }
  return parts;
}

TrackSize ReportParts::garmentSize() const {
  TrackSize size;
  for (const GarmentPart& part : garments_) {
    size += part.positions.size();
    size += part.provenance.size();
  }
  return size;
}

}  // namespace simulcap

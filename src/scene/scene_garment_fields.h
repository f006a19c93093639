#pragma once

// Part of scene_fields.h: cloth.

#include "avatar/wardrobe/wardrobe.h"
#include "bullet_ext/core/cloth_material.h"
#include "src/scene/scene_field_text.h"

namespace simulcap {

inline std::vector<std::string> wardrobeCuts() {
  std::vector<std::string> cuts;
  for (const avatar::WardrobePiece& piece : avatar::wardrobe())
    cuts.push_back(piece.name);
  return cuts;
}

/// Edges and corners of a sheet; a tube has the first two.
inline const std::vector<std::string>& pinNames() {
  static const std::vector<std::string> kNames = {
      "top", "bottom", "left", "right", "top_left", "top_right", "bottom_left", "bottom_right"};
  return kNames;
}

template <class Visitor>
void describeEdgeLength(Visitor& v, double& edgeLength) {
  v.field(
      "edge_length",
      edgeLength,
      {.unit = "m", .min = 0.001, .max = 1.0, .meaning = "Mean length of the mesh's edges."});
}

template <class Visitor>
void describe(Visitor& v, TailoredGarment& garment) {
  v.record("wear", "A garment of the built-in wardrobe, cut for the scene's body.");
  v.field(
      "cut",
      garment.cut,
      {.choices = wardrobeCuts(), .required = true, .meaning = "Which garment."});
  // The wardrobe's own limits (GarmentOrder).
  v.field(
      "ease",
      garment.ease,
      {.unit = "m",
       .min = 0.005,
       .max = 0.15,
       .defaultWords = "the cut's own",
       .meaning = "Room between skin and fabric at chest and hips."});
  v.field(
      "edge_length",
      garment.edgeLength,
      {.unit = "m", .min = 0.008, .max = 0.05, .meaning = "Mean length of the mesh's edges."});
}

template <class Visitor>
void describe(Visitor& v, ImportedGarment& garment) {
  v.record("mesh", "A garment or any other piece of cloth from a mesh file, vertices as they are.");
  v.field(
      "file",
      garment.file,
      {.example = "garment.obj", .required = true, .meaning = "Triangle mesh, Y up."});
  v.field(
      "scale",
      garment.scale,
      {.unit = "m",
       .min = 1e-6,
       .max = 1e6,
       .meaning = "Length of the file's unit: 0.01 for a file in centimetres."});
  describePlacement(v, garment.placement);
}

template <class Visitor>
void describe(Visitor& v, Twist& twist) {
  v.record(
      "twist",
      "Turns the bottom edge about the local y axis, what lies between evenly less towards the "
      "top; the rest shape stays untwisted.");
  v.field(
      "turns",
      twist.turns,
      {.min = -100.0,
       .max = 100.0,
       .required = true,
       .meaning = "Number of full turns, positive from +z towards +x."});
  v.field(
      "seconds",
      twist.seconds,
      {.unit = "s",
       .min = 0.0,
       .max = 3600.0,
       .meaning = "Time the turning takes from the start, the bottom edge being pinned; 0: the "
                  "cloth begins twisted."});
}

template <class Visitor>
void describe(Visitor& v, ClothSheet& sheet) {
  v.record(
      "sheet", "A rectangle in the local xy plane, centred, facing +z; a ribbon is a narrow one.");
  v.field(
      "width",
      sheet.width,
      {.unit = "m", .min = 0.001, .max = 100.0, .meaning = "Extent along x, left to right."});
  v.field(
      "height",
      sheet.height,
      {.unit = "m", .min = 0.001, .max = 100.0, .meaning = "Extent along y, bottom to top."});
  describeEdgeLength(v, sheet.edgeLength);
  describePlacement(v, sheet.placement);
  v.field(
      "twist",
      sheet.twist,
      {.defaultWords = "none", .meaning = "Bottom edge turned against the top edge."});
}

template <class Visitor>
void describe(Visitor& v, ClothTube& tube) {
  v.record("tube", "A cylinder about the local y axis, centred, open at both ends.");
  v.field(
      "radius",
      tube.radius,
      {.unit = "m", .min = 0.001, .max = 100.0, .meaning = "Radius of the cylinder."});
  v.field(
      "height",
      tube.height,
      {.unit = "m", .min = 0.001, .max = 100.0, .meaning = "Extent along y, bottom to top."});
  describeEdgeLength(v, tube.edgeLength);
  describePlacement(v, tube.placement);
  v.field(
      "twist",
      tube.twist,
      {.defaultWords = "none", .meaning = "Bottom edge turned against the top edge."});
}

/// "soft 300, middle 800, hard 1300".
std::string valuePerMaterial(double avatar::ClothParameters::*value);

template <class Visitor>
void describeMassAndDamping(Visitor& v, avatar::ClothParameters& values) {
  v.field(
      "mass_mode",
      values.massMode,
      {.meaning =
           "`per_vertex`: every vertex weighs the same; `areal`: as the area it stands for."});
  v.field(
      "vertex_mass_kg",
      values.vertexMass,
      {.unit = "kg", .min = 1e-7, .max = 10.0, .meaning = "Of each vertex, in mode `per_vertex`."});
  v.field(
      "areal_density_kg_m2",
      values.arealDensity,
      {.unit = "kg/m²", .min = 0.001, .max = 100.0, .meaning = "Of the fabric, in mode `areal`."});
  v.field(
      "damping_mode",
      values.dampingMode,
      {.meaning = "`per_second`: dv/dt = −damping·v; `per_substep`: v ← (1 − damping)·v in every "
                  "substep."});
  v.field(
      "damping",
      values.damping,
      {.unit = "1/s",
       .min = 0.0,
       .max = 1000.0,
       .meaning = "Damping of velocities; without unit and at most 1 in mode `per_substep`."});
}

template <class Visitor>
void describe(Visitor& v, SceneCloth& cloth) {
  v.record("cloth", "What the fabric is like: a material, and single values that differ from it.");
  v.field(
      "material",
      cloth.material,
      {.choices = {bullet_ext::kPaperMaterials.begin(), bullet_ext::kPaperMaterials.end()},
       .meaning = "Where values that are not named come from."});
  avatar::ClothParameters& values = cloth.parameters;
  values = paperCloth(cloth.material);
  v.field(
      "stretch_k",
      values.stretchStiffness,
      {.unit = "N/m",
       .min = 0.0,
       .max = 1e6,
       .defaultWords = valuePerMaterial(&avatar::ClothParameters::stretchStiffness),
       .meaning = "Stretching stiffness k, acting on half the length difference."});
  v.field(
      "torsion_w",
      values.torsionStiffness,
      {.unit = "N·m/rad",
       .min = 0.0,
       .max = 1000.0,
       .defaultWords = valuePerMaterial(&avatar::ClothParameters::torsionStiffness),
       .meaning = "Bending stiffness w of the angle between neighbouring triangles."});
  describeMassAndDamping(v, values);
  v.field(
      "friction",
      values.friction,
      {.min = 0.0, .max = 10.0, .meaning = "Coulomb coefficient against body and other cloth."});
  v.field(
      "thickness_m",
      values.thickness,
      {.unit = "m",
       .min = 0.0001,
       .max = 0.1,
       .meaning = "Distance kept from body, obstacles and other cloth."});
}

template <class Visitor>
void describe(Visitor& v, SceneGarment& garment) {
  v.record("garment", "A piece of cloth, worn or not.");
  v.field(
      "name",
      garment.name,
      {.pattern = "^[A-Za-z0-9_-]{1,64}$",
       .example = "curtain",
       .defaultWords = "the cut, the mesh file's name, `sheet` or `tube`",
       .meaning = "What results are called after, unique in the scene: letters, digits, _ and -."});
  v.oneOf(
      garment.source,
      {{{"wear", "A garment of the wardrobe."},
        {"mesh", "A mesh file."},
        {"sheet", "A rectangle or ribbon."},
        {"tube", "An open cylinder."}}});
  v.field(
      "pins",
      garment.pins,
      {.min = 0,
       .max = 1e7,
       .minItems = 0,
       .maxItems = 100000,
       .choices = pinNames(),
       .defaultWords = "the cut's own, else none",
       .meaning = "Vertices that are held: on the body if worn, else in space. Indices, or edges "
                  "and corners of a sheet or tube (only top and bottom)."});
  v.field(
      "cloth",
      garment.cloth,
      {.defaultWords = "middle material", .meaning = "What the fabric is like."});
}

}  // namespace simulcap

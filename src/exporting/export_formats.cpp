#include "src/exporting/export_formats.h"

#include <array>

namespace simulcap {

std::span<const ExportFormat> exportFormats() {
  static constexpr std::array<ExportFormat, 8> kFormats = {
      ExportFormat{
          .name = "glb",
          .extension = ".glb",
          .help = "glTF: the avatar with suggestions for engines; of a folder its performance too",
          .write = exportGlb},
      ExportFormat{
          .name = "obj",
          .extension = ".obj",
          .help = "meshes of body and garments as they start; of a folder every frame too",
          .write = exportObj},
      ExportFormat{
          .name = "pc2",
          .needsPerformance = true,
          .help = "point caches of body and garments, Z up, with the meshes they move",
          .write = exportPc2},
      ExportFormat{
          .name = "usd",
          .extension = ".usda",
          .help = "USD: the avatar skinned to its skeleton; of a folder garments as they moved",
          .write = exportUsd},
      ExportFormat{
          .name = "bullet",
          .extension = ".bullet",
          .help = "garments for Bullet, with OBJ, the body's capsules as URDF and the rest as JSON",
          .write = exportBullet},
      ExportFormat{
          .name = "godot",
          .help = "a Godot 3 project that opens and simulates",
          .write = exportGodot},
      ExportFormat{
          .name = "unity",
          .help =
              "glTF, parameters and an editor script for Unity (written by its manual, not run)",
          .write = exportUnity},
      ExportFormat{
          .name = "unreal",
          .help = "glTF, OBJ in cm and parameters for Unreal (written by its manual, not run)",
          .write = exportUnreal}};
  return kFormats;
}

}  // namespace simulcap

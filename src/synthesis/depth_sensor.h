#pragma once

#include "avatar/geometry/camera.h"
#include "src/scene/scene.h"

#include <cstdint>
#include <vector>

namespace simulcap {

/// Kinect v1's axial noise at depth z [m] of a surface tilted by `angle` [rad], [m]: 0.0012 +
/// 0.0019 (z − 0.4)² + 0.0001/√z · θ²/(π/2 − θ)² (Nguyen, Izadi and Lovell 2012, eq. 3). They
/// measured 0.4 … 2.5 m and 10° … 80° and let the last term begin at 60°, where it is 0.4 mm at
/// 1 m; here it has no step. Beyond both ranges it is extrapolated.
double kinectAxialNoise(double z, double angle);

/// Step from one depth to the next that Kinect v1 tells apart: an eighth of a pixel of disparity
/// at a baseline of 75 mm and a focal length of 580 px (Khoshelham & Elberink 2012), [m].
double kinectDepthStep(double z);

/// Axial noise of a time-of-flight camera, [m]: Kinect v2's indoors as measured by Fankhauser et
/// al. 2015 (Kinect v2 for mobile robot navigation, ICAR, doi:10.1109/ICAR.2015.7251485), 1.5 − 0.5
/// z + 0.3 z² + 0.1 z^1.5 · θ²/(π/2 − θ)² in millimetres, 1.3 mm face on at 1 m.
///
/// Why such a curve: the distance is c/(4πf) of a phase, whose error is that of the counted light
/// over its amplitude A. A falls with z²; light of the camera's own gives an error ~ √A/A ~ z (shot
/// noise), everything else, room light and electronics, one ~ 1/A ~ z² (Falie & Buzuloiu 2007,
/// Noise characteristics of 3D time-of-flight cameras). So noise grows no faster than z², nor does
/// this curve within Kinect v2's 4.5 m. Real noise depends on every surface's reflectivity too;
/// here all are alike.
double timeOfFlightNoise(double z, double angle);

/// Who measures a frame, and which one.
struct SensedFrame {
  SceneSensor sensor;
  std::uint32_t frame = 0;
};

/// Exact depth (W·H [m] along z, 0 = nothing) as a sensor measures it; 0 = no measurement. The
/// noise depends on seed, frame and pixel alone.
///
/// kKinectV1: axial noise, disparity in steps of 1/8 px, the shadow of the projector 75 mm to the
/// right of the camera, silhouettes that jitter by 0.8 px (Nguyen et al.'s lateral noise, 0.8 +
/// 0.035 θ/(π/2 − θ) px, face on), 0.4 … 8 m. Dropouts from 70° on, all at 85°, are assumed: the
/// published curves end at 80°. Noise is independent from pixel to pixel; that of real devices is
/// correlated over the matching window of some 9 px.
/// kTimeOfFlight: every pixel adds up the phases of what it covers (flying pixels at jumps), light
/// that came over another surface (multi-path, with an assumed albedo of 0.5), axial noise,
/// 0.3 … 7 m.
///
/// Throws std::invalid_argument when the depth isn't the camera's W·H pixels.
std::vector<float> applySensor(
    const std::vector<float>& depth, const avatar::Camera& camera, const SensedFrame& sensed);

// The models' parts.

/// Pixels without a point in the picture's own rows that the projector, `baseline` [m] to the
/// right, doesn't see either.
std::vector<std::uint8_t> projectorShadow(
    const std::vector<float>& depth, const avatar::Camera& camera, double baseline);

/// W·H angles between the surface and the line of sight's plane [rad]: 0 = seen face on. Taken on
/// the surface's own side of jumps.
std::vector<float> viewingAngles(const std::vector<float>& depth, const avatar::Camera& camera);

/// Depth after light has gone over other surfaces as well: the camera adds up what comes directly
/// and what comes later as phasors and takes the sum for a single return (the radiometric model of
/// Jiménez et al. 2014, Modeling and correction of multipath interference in time of flight
/// cameras, Image and Vision Computing 32:1–13). One bounce between patches of the picture, each of
/// Lambert's reflection with the given albedo; light modulated with 20 MHz. Never less than
/// `depth`.
std::vector<float> withMultiPath(
    const std::vector<float>& depth, const avatar::Camera& camera, double albedo);

}  // namespace simulcap

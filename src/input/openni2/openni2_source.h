#pragma once

#include "src/input/frame_source.h"

#include <memory>
#include <string>

namespace simulcap {

/// Opens a PrimeSense-like camera (Kinect v1, Xtion, Structure) or what one has recorded, through
/// PCL's OpenNI2 grabber. `device`: a .oni file; empty: the first camera found; "#2": the second.
/// Colour is registered to the depth where the device can do that, else left out.
///
/// Frames arrive while others are worked on. A camera's wait in a short queue, of which the oldest
/// are dropped and counted (RgbdFrame::index shows the gaps); a file's are waited for, all of them,
/// up to its end, where it would begin again. The intrinsics are the device's own nominal ones:
/// one focal length, principal point in the middle.
///
/// Not tested with a camera or a file yet: only what happens without one. In a library of its own,
/// because libpcl_io brings VTK along.
///
/// Throws avatar::FileError when there is no such file or camera, or it sends no depth in 5 s.
std::unique_ptr<FrameSource> openOpenNi2(const std::string& device);

}  // namespace simulcap

// A picture as whole messages of OpenIGTLink, version 1 of its header.
#pragma once

#include <string>

#include "runtime/igtl/watched_picture.h"

namespace palpate {

// Device names of the messages.
constexpr const char* igtl_surface_name = "Palpate surface";
constexpr const char* igtl_tool_name = "Palpate tool";
constexpr const char* igtl_force_name = "Palpate force";

// The time stamp of each message is the time of the tick since the start of the run. Coordinates are those of
// the model, in millimetres.

/// POLYDATA: the visible surface as triangles or, without any, as lines; per node the magnitude of its
/// displacement [mm], von Mises stress and contact pressure [Pa].
std::string igtl_surface(const WatchedPicture& picture);

/// TRANSFORM: pose of the tool.
std::string igtl_tool(const WatchedPicture& picture);

/// STRING: force on the hand and its torque about the tool's origin, as the JSON object
/// {"force_N":[x,y,z],"torque_Nm":[x,y,z]}.
std::string igtl_force(const WatchedPicture& picture);

}  // namespace palpate

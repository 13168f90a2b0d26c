#pragma once

#include <string>

#include "rayrep/motion/carve.h"
#include "rayrep/motion/motion_check.h"
#include "rayrep/motion/scene.h"

namespace rayrep {

/// What was found out about a scene, as JSON: docs/report.schema.json.
std::string to_json(const Scene& scene, const MotionReport& report);

/// The same for people.
std::string to_text(const Scene& scene, const MotionReport& report);

/// What a scene holds and what is wrong with it. @param name  of its file
std::string to_json(const SceneFile& file, const std::string& name);
std::string to_text(const SceneFile& file, const std::string& name);

/// What was taken out of a part, by which one, and where what is left was written.
std::string to_json(const std::string& part, const std::string& by, const std::string& output, const Carving& carving);
std::string to_text(const std::string& part, const std::string& by, const std::string& output, const Carving& carving);

}  // namespace rayrep

#pragma once

// A judge of delivered meshes that is slow, plain and knows nothing of the library's own: only where it is sure does it contradict.

#include <optional>
#include <string>

#include "rayrep/judge/verify.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/physics/spec.h"

namespace fuzz {

/// Why a mesh that `verify` accepted must not be accepted; none: nothing speaks against it.
/// @param verdict  its spec with what was open filled in
std::optional<std::string> objection(const rayrep::Mesh& delivered, const rayrep::Mesh* original, const rayrep::Spec& spec,
                                     const rayrep::Limits& limits);

}  // namespace fuzz

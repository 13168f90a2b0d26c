#pragma once

namespace rayrep::bench {

/// Adds how fast answers about parts that move come to the micro-benchmarks.
void register_motion();

}  // namespace rayrep::bench

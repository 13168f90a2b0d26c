#pragma once

namespace rayrep::bench {

/// The micro-benchmarks, with Google Benchmark's own command line.
int run_micro(int argc, char** argv);

}  // namespace rayrep::bench

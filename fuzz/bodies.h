#pragma once

// Small meshes out of the bytes of a fuzzer.

#include <cstddef>
#include <cstdint>

#include "rayrep/mesh/mesh.h"

namespace fuzz {

/// Takes a fuzzer's input apart; after its end come zeros. Never twice among a call's arguments, whose order compilers choose.
class Bytes {
public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  bool at_end() const { return next_ >= size_; }
  int byte() { return at_end() ? 0 : data_[next_++]; }
  int two_bytes() {
    const int low = byte();
    return low | byte() << 8;
  }
  int below(int limit) { return byte() % limit; }
  /// One of 256 values from lo to hi, both included; lo for a 0.
  double number(double lo, double hi) { return lo + (hi - lo) * byte() / 255; }
  bool chance(int of_256) { return byte() < of_256; }
  /// Any double of middling size, with all its bits.
  double odd_number(double lo, double hi);

private:
  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t next_ = 0;
};

/// @throws std::logic_error: what a fuzzer reports
void require(bool condition, const char* law);

/// A closed body, mostly: a box, a prism, an ellipsoid or a few cubes, its corners moved a little, some 20 to 80 mm long, with its
/// lowest point at z = 0.
rayrep::Mesh body(Bytes& bytes);

/// One to three bodies apart, touching or overlapping, sometimes with a cavity of their own.
rayrep::Mesh bodies(Bytes& bytes);

/// The mesh about the middle of its box, smaller by `factor` and moved, facing inward: a cavity.
rayrep::Mesh shrunk_inside_out(const rayrep::Mesh& mesh, double factor, const Eigen::Vector3d& move);

}  // namespace fuzz

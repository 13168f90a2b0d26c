#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "io/mesh_io_detail.h"

namespace rayrep::detail {

/// A grey PNG image, row by row: never more than one row of it is in memory.
class PngRows {
public:
  /// Keeps references. @param part  what to call it in messages
  /// @throws Error{input} if it is damaged, coloured, of more than 8 bits or interlaced
  PngRows(const FileBytes& file, const std::string& part, std::string_view bytes);
  ~PngRows();
  PngRows(const PngRows&) = delete;
  PngRows& operator=(const PngRows&) = delete;

  std::size_t width() const { return width_; }
  std::size_t height() const { return height_; }

  /// The next of height() rows, 0 ... 255; the last one checks how the image ends. @throws Error{input} if it is damaged
  const std::vector<std::uint8_t>& next();

private:
  struct State;
  [[noreturn]] void fail() const;

  const FileBytes& file_;
  const std::string& part_;
  std::unique_ptr<State> state_;
  std::size_t width_ = 0;
  std::size_t height_ = 0;
  std::size_t given_ = 0;
  std::vector<std::uint8_t> row_;
};

}  // namespace rayrep::detail

#include "io/png_rows.h"

#include <png.h>

#include <csetjmp>
#include <cstring>

namespace rayrep::detail {

struct PngRows::State {
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::string_view rest;   // of the bytes
  char message[96] = {0};  // of libpng, which jumps: nothing may have to be destroyed on the way
};

namespace {

struct Header {
  png_uint_32 width = 0;
  png_uint_32 height = 0;
  int bits = 0;
  int colour = 0;
  int interlacing = 0;
};

/// @tparam State  PngRows::State
template <class State>
void on_error(png_structp png, png_const_charp text) {
  auto* state = static_cast<State*>(png_get_error_ptr(png));
  std::strncpy(state->message, text, sizeof state->message - 1);
  png_longjmp(png, 1);
}

// Otherwise libpng prints.
void on_warning(png_structp /*png*/, png_const_charp /*text*/) {}

template <class State>
void on_read(png_structp png, png_bytep to, std::size_t length) {
  auto* state = static_cast<State*>(png_get_io_ptr(png));
  if (length > state->rest.size()) png_error(png, "it is cut off");
  std::memcpy(to, state->rest.data(), length);
  state->rest.remove_prefix(length);
}

// What calls libpng holds nothing that has a destructor, as errors jump back over it. False: an error.

bool read_header(png_structp png, png_infop info, Header& header) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_read_info(png, info);
  png_get_IHDR(png, info, &header.width, &header.height, &header.bits, &header.colour, &header.interlacing, nullptr, nullptr);
  return true;
}

bool begin_rows(png_structp png, png_infop info) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_expand_gray_1_2_4_to_8(png);
  png_read_update_info(png, info);
  return true;
}

bool read_row(png_structp png, png_bytep row) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_read_row(png, row, nullptr);
  return true;
}

bool read_end(png_structp png) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_read_end(png, nullptr);
  return true;
}

}  // namespace

PngRows::PngRows(const FileBytes& file, const std::string& part, std::string_view bytes)
    : file_(file), part_(part), state_(std::make_unique<State>()) {
  state_->rest = bytes;
  state_->png = png_create_read_struct(PNG_LIBPNG_VER_STRING, state_.get(), on_error<State>, on_warning);
  if (state_->png != nullptr) state_->info = png_create_info_struct(state_->png);
  if (state_->info == nullptr) {
    png_destroy_read_struct(&state_->png, nullptr, nullptr);
    throw std::bad_alloc();
  }
  png_set_read_fn(state_->png, state_.get(), on_read<State>);
  Header header;
  try {
    if (!read_header(state_->png, state_->info, header)) fail();
    if (header.colour != PNG_COLOR_TYPE_GRAY || header.bits > 8 || header.interlacing != PNG_INTERLACE_NONE)
      fail_read(file_, concat("part '", part_, "'"),
                "the image is not one in 8 bits of grey without interlacing, as slicers write layers. Slice it again.");
    width_ = header.width;
    height_ = header.height;
    if (!begin_rows(state_->png, state_->info)) fail();
  } catch (...) {  // the destructor does not run
    png_destroy_read_struct(&state_->png, &state_->info, nullptr);
    throw;
  }
}

PngRows::~PngRows() { png_destroy_read_struct(&state_->png, &state_->info, nullptr); }

const std::vector<std::uint8_t>& PngRows::next() {
  row_.resize(width_);
  if (!read_row(state_->png, row_.data())) fail();
  if (++given_ == height_ && !read_end(state_->png)) fail();
  return row_;
}

void PngRows::fail() const {
  fail_read(file_, concat("part '", part_, "'"),
            concat("the image cannot be read (", static_cast<const char*>(state_->message),
                   "). The file is damaged; slice or download it again."));
}

}  // namespace rayrep::detail

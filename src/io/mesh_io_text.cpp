#include "io/mesh_io_detail.h"
#include "rayrep/base/error.h"

namespace rayrep::detail {
namespace {

bool is_line_end(char c) { return c == '\n' || c == '\r'; }
bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }

}  // namespace

void fail_read(const FileBytes& file, const std::string& where, const std::string& what) {
  throw Error(ErrorCode::input, concat("Cannot read '", file.name, "'", where.empty() ? "" : ", ", where, ": ", what));
}

std::size_t line_of(std::string_view bytes, std::size_t offset) {
  std::size_t line = 1;
  for (std::size_t i = 0; i < offset; ++i)
    line += bytes[i] == '\n' || (bytes[i] == '\r' && (i + 1 == bytes.size() || bytes[i + 1] != '\n'));
  return line;
}

std::string lower_case(std::string_view text) {
  std::string result(text);
  for (char& c : result)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return result;
}

bool begins_with_word(std::string_view bytes, std::string_view word) {
  return bytes.starts_with(word) &&
         (bytes.size() == word.size() || std::string_view(" \t\r\n").find(bytes[word.size()]) != std::string_view::npos);
}

TextScanner::TextScanner(const FileBytes& file, std::size_t offset) : file_(file), position_(offset), word_start_(offset) {}

std::string_view TextScanner::word() {
  while (!at_end() && (is_blank(file_.bytes[position_]) || is_line_end(file_.bytes[position_]))) ++position_;
  return word_in_line();
}

std::string_view TextScanner::word_in_line() {
  const std::string_view bytes = file_.bytes;
  while (!at_end() && is_blank(bytes[position_])) ++position_;
  word_start_ = position_;
  while (!at_end() && !is_blank(bytes[position_]) && !is_line_end(bytes[position_])) ++position_;
  return bytes.substr(word_start_, position_ - word_start_);
}

void TextScanner::skip_line() {
  const std::string_view bytes = file_.bytes;
  while (!at_end() && !is_line_end(bytes[position_])) ++position_;
  if (!at_end() && bytes[position_++] == '\r' && !at_end() && bytes[position_] == '\n') ++position_;
}

double TextScanner::to_number(std::string_view word, std::string_view what) const {
  double value = 0;
  if (word.empty())
    fail(concat("the ", at_end() ? "file" : "line", " ends where ", what, " was expected. Export or download it again."));
  if (!parse_number(word, value))
    fail(concat("'", word.substr(0, 40), "' is not a number (", what, " was expected). Export the mesh again."));
  return value;
}

std::size_t TextScanner::line() const { return line_of(file_.bytes, word_start_); }

void TextScanner::fail(const std::string& what) const { fail_read(file_, concat("line ", line()), what); }

}  // namespace rayrep::detail

#include <charconv>

#include "io/mesh_io_detail.h"
#include "rayrep/base/error.h"

namespace rayrep::detail {
namespace {

bool is_line_end(char c) { return c == '\n' || c == '\r'; }
bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }

std::string_view without_plus(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  return text;
}

template <class Number>
bool parse_whole(std::string_view text, Number& value, std::errc& problem) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  problem = error;
  return error != std::errc::invalid_argument && end == text.data() + text.size();
}

}  // namespace

void fail_read(const FileBytes& file, const std::string& where, const std::string& what) {
  throw Error(ErrorCode::input, concat("Cannot read '", file.name, "'", where.empty() ? "" : ", ", where, ": ", what));
}

bool parse_number(std::string_view text, double& value) {
  text = without_plus(text);
  std::errc problem;
  if (!parse_whole(text, value, problem)) return false;
  if (problem != std::errc::result_out_of_range) return true;
  // Outside double's range: long double still tells too large (inf) from too small (0).
  long double wide = 0;
  if (!parse_whole(text, wide, problem) || problem != std::errc()) return false;
  value = static_cast<double>(wide);
  return true;
}

bool parse_integer(std::string_view text, long long& value) {
  std::errc problem;
  return parse_whole(without_plus(text), value, problem) && problem == std::errc();
}

void append_number(std::string& text, double value) {
  char buffer[32];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
  text.append(buffer, end);
}

void append_number(std::string& text, long long value) {
  char buffer[24];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
  text.append(buffer, end);
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

std::string counted(std::size_t count, std::string_view singular, std::string_view plural) {
  return concat(count, " ", count == 1 ? singular : plural);
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

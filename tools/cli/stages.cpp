#include "stages.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>

namespace rayrep::tool {
namespace {

double seconds(std::chrono::steady_clock::duration d) { return std::chrono::duration<double>(d).count(); }

/// A terminal that moves its cursor.
bool is_terminal() {
  const char* kind = std::getenv("TERM");
  return isatty(STDERR_FILENO) && kind != nullptr && std::string_view(kind) != "dumb";
}

/// As https://no-color.org has it: set to anything.
bool may_colour() {
  const char* none = std::getenv("NO_COLOR");
  return none == nullptr || *none == '\0';
}

/// How the time of a run that hollows is shared, in percent, as measured on the examples: much alike for all goals and sizes.
struct Share {
  const char* stage;
  double percent;
};
constexpr Share kShares[] = {{"read", 1},  {"check", 2}, {"domain", 18}, {"rays", 5},    {"waterline", 20},
                             {"solve", 1}, {"mesh", 33}, {"write", 3},   {"verify", 30}, {"draw", 5}};

bool follows_shares(const Options& options) {
  return options.command == Command::hollow && options.slicer.program.empty() && !options.deform.limit_mm && !options.each &&
         print_of(options.spec).balls.count == 0;
}

std::string duration_words(double s) {
  char text[48];
  if (s < 90)
    std::snprintf(text, sizeof text, "%.0f s", std::max(1.0, s));
  else
    std::snprintf(text, sizeof text, "%.0f min", s / 60);
  return text;
}

}  // namespace

Stages::Stages(const Options& options)
    : verbose_(options.verbose && !options.quiet),
      live_(!options.quiet && is_terminal()),
      colour_(live_ && may_colour()),
      known_(follows_shares(options)) {}

void Stages::begin(std::string_view name) {
  end();
  current_ = name;
  started_ = Clock::now();
  if (live_)
    show();
  else if (verbose_)
    std::cerr << "rayrep: " << current_ << std::endl;
}

void Stages::tick() {
  constexpr double kApart_s = 0.2;
  if (live_ && !current_.empty() && seconds(Clock::now() - shown_) > kApart_s) show();
}

std::vector<std::pair<std::string, double>> Stages::finish() {
  end();
  current_.clear();
  clear_line();
  auto result = spent_;
  result.emplace_back("total", seconds(Clock::now() - born_));
  return result;
}

void Stages::end() {
  if (current_.empty()) return;
  const double took = seconds(Clock::now() - started_);
  const auto known = std::find_if(spent_.begin(), spent_.end(), [this](const auto& s) { return s.first == current_; });
  if (known == spent_.end())
    spent_.emplace_back(current_, took);
  else
    known->second += took;
  if (!live_ || !verbose_) return;
  char text[32];
  std::snprintf(text, sizeof text, " %.2f s", took);
  clear_line();
  std::cerr << emphasised(current_) << std::string(current_.size() < 10 ? 10 - current_.size() : 0, ' ') << text << std::endl;
}

void Stages::show() {
  shown_ = Clock::now();
  clear_line();
  std::cerr << emphasised(current_) << " ...";
  const double so_far = seconds_so_far();
  if (so_far >= 1) std::cerr << " " << duration_words(so_far);
  if (const auto left = seconds_left(); left && so_far >= 2) std::cerr << ", about " << duration_words(*left) << " left";
  std::cerr << std::flush;
}

void Stages::clear_line() const {
  if (live_) std::cerr << "\r\033[K" << std::flush;
}

std::string Stages::emphasised(const std::string& text) const { return colour_ ? "\033[1m" + text + "\033[0m" : text; }

double Stages::seconds_so_far() const { return seconds(Clock::now() - born_); }

/// From what the stages before this one took, and how such runs share their time; nothing is known before some of it has passed.
std::optional<double> Stages::seconds_left() const {
  constexpr double kTelling = 15;  // percent
  if (!known_) return std::nullopt;
  const auto spent = [this](std::string_view stage) {
    const auto found = std::find_if(spent_.begin(), spent_.end(), [&](const auto& s) { return s.first == stage; });
    const double before = found == spent_.end() ? 0 : found->second;
    return before + (current_ == stage ? seconds(Clock::now() - started_) : 0);
  };
  const auto now = std::find_if(std::begin(kShares), std::end(kShares), [this](const Share& s) { return current_ == s.stage; });
  double done = 0;
  double took = 0;
  for (auto share = std::begin(kShares); share != now; ++share)
    if (const double s = spent(share->stage); s > 0) {  // not every run has every stage
      done += share->percent;
      took += s;
    }
  if (now == std::end(kShares) || done < kTelling) return std::nullopt;
  double left = 0;
  for (auto share = now; share != std::end(kShares); ++share)
    left += std::max(0.0, share->percent * took / done - spent(share->stage));
  return left;
}

}  // namespace rayrep::tool

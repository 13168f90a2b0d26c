#include "make/drain_refusal.h"

#include <vector>

namespace rayrep::detail {
namespace {

HollowOptions unsliced(HollowOptions options) {
  options.as_printed = nullptr;
  return options;
}

template <typename Make>
bool can_be_made(const HollowOptions& options, const Make& make) {
  try {
    return make().as_built_error <= options.as_built_tolerance;
  } catch (const Error& error) {
    if (error.code() != ErrorCode::goal && error.code() != ErrorCode::solver) throw;
    return false;
  }
}

/// Plans know nothing of plugs.
bool with_plugs(const Undrained& body, const Progress& progress) {
  return can_be_made(body.options, [&] {
    Plan plan = body.plan;
    print_of(plan.spec).drains.plugged = true;
    return carry_out(plan, unsliced(body.with_cones), progress);
  });
}

bool as_given(const Undrained& body, const Spec& spec, const Progress& progress) {
  return can_be_made(body.options, [&] { return hollow(body.solid, spec, unsliced(body.options), progress); });
}

bool without_cones(const Undrained& body, const Progress& progress) {
  Spec spec = body.spec;
  print_of(spec).self_supporting_deg = 0;
  return as_given(body, spec, progress);
}

bool without_holes(const Undrained& body, const Progress& progress) {
  Spec spec = body.spec;
  print_of(spec).direction = print_of(body.plan.spec).direction;  // is not looked for again
  print_of(spec).drains = {};
  return as_given(body, spec, progress);
}

std::string cause(bool holes_alone, bool cones_alone) {
  if (holes_alone && cones_alone)
    return "It is both together that cannot be: with the cones alone it can be made, and with the holes alone as well.";
  if (holes_alone) return "It is the cones that cannot be: with the holes alone it can be made.";
  if (cones_alone) return "It is the holes that cannot be, with cones or without: with the cones alone it can be made.";
  return "Neither the holes nor the cones can be made alone.";
}

}  // namespace

Error drain_refusal(const Undrained& body, const Error& why, const Progress& progress) {
  const Print& print = print_of(body.spec);
  const bool holes_alone = without_cones(body, progress);
  const bool cones_alone = without_holes(body, progress);
  std::vector<std::string> ways;
  if (!print.drains.plugged && with_plugs(body, progress)) ways.emplace_back("close the holes again (--plug)");
  if (holes_alone) ways.emplace_back("leave the cones out (--self-supporting)");
  if (cones_alone && !(print.liquid_g_cm3 > 0)) ways.emplace_back("leave the holes out (--drain)");
  std::string tried;
  for (const std::string& way : ways) tried += (tried.empty() ? " What can be done, as was tried: " : ", or ") + way;
  return {ErrorCode::goal, std::string(why.what()) + " " + cause(holes_alone, cones_alone) + (tried.empty() ? tried : tried + ".")};
}

}  // namespace rayrep::detail

#include "results.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <stdexcept>

#include "problem.h"
#include "svg.h"
#include "tables.h"

namespace rayrep::bench {
namespace {

using Records = std::vector<const Record*>;
constexpr double kEqualObjective = 0.005;

class Markdown {
public:
  void line(const std::string& text) { text_ += text + "\n"; }
  void header(const std::vector<std::string>& cells) {
    line("");
    row(cells);
    row(std::vector<std::string>(cells.size(), "---"));
  }
  void row(const std::vector<std::string>& cells) {
    for (const std::string& cell : cells) text_ += "| " + cell + " ";
    text_ += "|\n";
  }
  const std::string& text() const { return text_; }

private:
  std::string text_;
};

std::string whole(double n) { return std::isfinite(n) ? std::to_string(static_cast<long long>(std::llround(n))) : "-"; }
std::string factor(double f) { return significant(f, f < 10 ? 2 : 3); }

std::string seconds_text(const Record& r) {
  if (r.seconds.repeats == 0) return "-";
  if (r.status == "capped") return "> " + significant(r.seconds.median, 3);
  std::string text = significant(r.seconds.median, 3);
  if (r.seconds.repeats > 1) text += " (" + significant(r.seconds.smallest, 2) + " - " + significant(r.seconds.largest, 2) + ")";
  return text;
}

std::string quality_text(const Record& r, double value, int digits) {
  if (r.converged()) return significant(value, digits);
  return r.status + (r.note.empty() || r.status == "capped" ? "" : ": " + r.note);
}

const std::vector<std::string> kSolveHeader = {"shape", "goal",      "N",   "solver",   "variables",       "iterations", "seconds",
                                               "CPU s", "objective", "gap", "residual", "residual meshed", "peak MB"};

void solve_row(Markdown& out, const Record& r) {
  out.row({r.mesh, r.goal, std::to_string(r.resolution), r.solver, std::to_string(r.variables), std::to_string(r.iterations),
           seconds_text(r), significant(r.extra("processor_s"), 3), quality_text(r, r.objective, 7), significant(r.gap, 2),
           significant(r.residual, 2), significant(r.residual_meshed, 2), whole(r.peak_memory_mb)});
}

void paper_row(Markdown& out, const PaperRow& paper, bool voxels) {
  out.row({paper.model, paper.goal, paper.resolution, voxels ? "*Wu et al., voxels*" : "*Wu et al., rays*",
           "*" + std::to_string(voxels ? paper.voxel_variables : paper.ray_variables) + "*", "",
           "*" + significant(voxels ? paper.voxel_s : paper.ray_s, 3) + "*", "", "", "", "", "", ""});
}

bool stands_for(const std::string& mesh, const PaperRow& paper) {
  return std::find(paper.stand_ins.begin(), paper.stand_ins.end(), mesh) != paper.stand_ins.end();
}

/// Records of the latest measurements, by table.
class Store {
public:
  explicit Store(const std::vector<Measurements>& runs) {
    std::map<std::string, std::size_t> latest;  // a table that was measured again replaces the older one as a whole
    for (std::size_t n = 0; n < runs.size(); ++n)
      for (const Record& r : runs[n].records) latest[r.table] = n;
    for (std::size_t n = 0; n < runs.size(); ++n)
      for (const Record& r : runs[n].records)
        if (latest[r.table] == n) all_.push_back(&r);
  }
  Records table(const std::string& name) const {
    return where([&](const Record& r) { return r.table == name; });
  }
  Records where(const std::function<bool(const Record&)>& wanted) const {
    Records found;
    for (const Record* r : all_)
      if (wanted(*r)) found.push_back(r);
    return found;
  }
  const Record* one(const std::string& table, const std::string& mesh, const std::string& goal, int resolution,
                    const std::string& solver) const {
    const Records found = where([&](const Record& r) {
      return r.table == table && r.mesh == mesh && r.goal == goal && r.resolution == resolution && r.solver == solver;
    });
    return found.empty() ? nullptr : found.front();
  }

private:
  Records all_;
};

/// Distinct values in order of first occurrence.
template <typename Key>
std::vector<Key> distinct(const Records& records, const std::function<Key(const Record&)>& key) {
  std::vector<Key> found;
  for (const Record* r : records)
    if (std::find(found.begin(), found.end(), key(*r)) == found.end()) found.push_back(key(*r));
  return found;
}

Curve curve_of(const std::string& name, const Records& records, const std::function<double(const Record&)>& value) {
  Curve curve{name, {}, {}};
  for (const Record* r : records) {
    if (!r->converged()) continue;
    curve.x.push_back(r->resolution);
    curve.y.push_back(value(*r));
  }
  if (curve.x.size() >= 2) curve.name += ": N^" + significant(fit_power_law(curve.x, curve.y).exponent, 3);
  return curve;
}

double median_s(const Record& r) { return r.seconds.median; }

class Report {
public:
  Report(const std::vector<Measurements>& runs, std::filesystem::path folder)
      : runs_(runs), store_(runs), folder_(std::move(folder)) {}

  void write(const std::filesystem::path& micro) {
    std::filesystem::create_directories(folder_ / "results");
    opening();
    table1();
    table2();
    trace();
    quality();
    cavities();
    overhang();
    roofs();
    growth();
    teapot();
    sliced();
    answers();
    if (!micro.empty()) micro_benchmarks(micro);
    save(folder_ / "results.md", out_.text());
  }

private:
  static void save(const std::filesystem::path& path, const std::string& text) {
    std::ofstream file(path);
    file << text;
    if (!file.flush()) throw std::runtime_error("Cannot write '" + path.string() + "'.");
  }

  void plot(const std::string& name, const LogPlot& what) {
    save(folder_ / "results" / (name + ".svg"), to_svg(what));
    out_.line("");
    out_.line("![" + what.title + "](results/" + name + ".svg)");
  }

  void opening() {
    out_.line("# Results");
    out_.line("");
    out_.line(
        "Generated by `benchmarks/run.sh`; not to be edited. N is the number of rays along the longest side. Seconds are "
        "wall-clock");
    out_.line(
        "medians with (smallest - largest) of three repeats where a measurement takes less than 5 s, and single ones above. A "
        "time");
    out_.line(
        "without its quality does not count, hence beside it: the *objective* reached (as in `goals.h`, smaller is better), the "
        "*gap*");
    out_.line(
        "to the exact optimum on the same rays (of the quadric solver: to the bound its dual proves, where the goal is affine), "
        "the");
    out_.line(
        "*residual*, which is the largest constraint as the solver sees the body, and the same *meshed*: of the exact moments of "
        "the");
    out_.line("mesh made from this answer in one pass. The as-built passes of a whole run lower that one, to 1e-6 where they can.");
    out_.line("");
    out_.line(
        "All solvers get the same inner domain, shell, goal and scales, as the command makes them, and the Ipopt solvers the same");
    out_.line(
        "options: for spinning a start from half full and a barrier that stops at 1e-4 in the papers' tables and at 1e-5 in that "
        "of");
    out_.line(
        "shapes, which put the objective off by about as much; for voxels with Mehrotra's probing, which suits them best. Times of "
        "solvers");
    out_.line("are for building the interior and");
    out_.line(
        "solving; the inner domain is common to them and not included. *CPU s* is processor time over all threads, which other "
        "work on");
    out_.line("the machine hardly changes. Peak memory is that of the process, inner domain included.");
    out_.line("");
    out_.line(
        "*Italics: figures printed in the papers*, on their machine (ray-reps: Intel Xeon E5-1620, 8 GB) and their models, for "
        "which");
    out_.line("the examples of this repository stand in.");
    out_.header({"measured", "commit", "build", "processor", "threads", "load before", "time cap", "size"});
    std::map<std::string, std::string> machines;
    for (const Measurements& run : runs_) {
      std::set<std::string> tables;
      for (const Record& r : run.records) tables.insert(r.table);
      std::string names;
      for (const std::string& t : tables) names += (names.empty() ? "" : ", ") + t;
      out_.row({names, run.commit, run.compiler + ", " + run.build, run.processor, std::to_string(run.threads),
                significant(run.load_average, 2), significant(run.cap_s, 3) + " s", run.quick ? "**quick**" : "full"});
    }
    if (std::any_of(runs_.begin(), runs_.end(), [](const Measurements& run) { return run.quick; })) {
      out_.line("");
      out_.line("**Quick: at small resolutions and with thick walls, to try the harness. These are not results.**");
    }
  }

  void table1() {
    const Records records = store_.table("table1");
    if (records.empty()) return;
    out_.line("");
    out_.line("## The ray-reps paper's Table 1");
    out_.header(kSolveHeader);
    for (const PaperRow& paper : paper_table1()) {
      paper_row(out_, paper, false);
      std::vector<std::string> stand_ins = paper.stand_ins;
      if (std::string(paper.model) == "Duck") stand_ins.push_back("duck.obj");
      if (std::string(paper.model) == "Kitten") stand_ins.push_back("cat.obj");
      for (const std::string& mesh : stand_ins)
        for (const Record* r : records)
          if (r->mesh == mesh) solve_row(out_, *r);
    }
  }

  void table2() {
    const Records records = store_.table("table2");
    if (records.empty()) return;
    out_.line("");
    out_.line("## The ray-reps paper's Table 2, and further");
    out_.line("");
    out_.line("Speed-ups over uniform voxels in the same run. The last column is the largest difference between the objectives of");
    out_.line(
        "rays, quadric and voxels at this resolution: a speed-up counts where it is at most 0.5 %. The paper's Ellipsoid and Bird");
    out_.line(
        "are not public. The examples ellipsoid and robin stand in for them: shapes of our own with the proportions of the "
        "paper's");
    out_.line(
        "grids, off balance as solids, and sized so that about as many rays and voxels lie inside at the finest resolution; both");
    out_.line(
        "counts stand beside the paper's. The tilted ellipsoid and the bird are flatter, with fewer voxels to a ray, and their "
        "best");
    out_.line("interiors leave many rays void; they stand for no shape of the paper.");
    out_.header({"shape", "N", "ray variables", "*Wu et al.*", "voxels", "*Wu et al.*", "*Wu et al.: rays over voxels*",
                 "rays, paper's bounds", "rays", "octree", "quadric", "quadric over rays", "objectives differ by"});
    struct Counted {
      std::vector<double> rays, quadric, paper;
    };
    std::map<std::string, Counted> counted;
    const auto meshes = distinct<std::string>(records, [](const Record& r) { return r.mesh; });
    for (const std::string& mesh : meshes)
      for (const int n : distinct<int>(of_mesh(records, mesh), [](const Record& r) { return r.resolution; })) {
        const auto of = [&](Method m) { return store_.one("table2", mesh, "spin", n, name(m)); };
        const Record* voxels = of(Method::voxels);
        const auto over = [&](const Record* slow, Method m) {
          const Record* fast = of(m);
          return slow && fast && slow->converged() && fast->converged() ? slow->seconds.median / fast->seconds.median : kUnknown;
        };
        double paper = kUnknown;
        std::string paper_rays;
        std::string paper_voxels;
        for (const PaperRow& row : paper_table2())
          if (stands_for(mesh, row) && row.longest == n) {
            paper = row.voxel_s / row.ray_s;
            paper_rays = "*" + std::to_string(row.ray_variables) + "*";
            paper_voxels = "*" + std::to_string(row.voxel_variables) + "*";
          }
        const auto variables = [](const Record* r) { return r && r->variables > 0 ? std::to_string(r->variables) : "-"; };
        double apart = voxels && voxels->converged() ? 0 : kUnknown;
        for (const Method m : {Method::rays, Method::quadric})
          if (const Record* r = of(m); r && r->converged() && std::isfinite(apart))
            apart = std::max(apart, std::abs(voxels->objective / r->objective - 1));
        if (apart <= kEqualObjective && std::isfinite(paper)) {
          counted[mesh].rays.push_back(over(voxels, Method::rays));
          counted[mesh].quadric.push_back(over(voxels, Method::quadric));
          counted[mesh].paper.push_back(paper);
        }
        out_.row({mesh, std::to_string(n), variables(of(Method::rays)), paper_rays, variables(voxels), paper_voxels,
                  std::isfinite(paper) ? "*" + factor(paper) + "*" : "", factor(over(voxels, Method::rays_paper)),
                  factor(over(voxels, Method::rays)), factor(over(voxels, Method::octree)), factor(over(voxels, Method::quadric)),
                  factor(over(of(Method::rays), Method::quadric)),
                  std::isfinite(apart) ? significant(100 * apart, 2) + " %" : "-"});
      }
    const auto range = [](const std::vector<double>& factors) {
      const Spread s = spread(factors);
      return factor(s.smallest) + " to " + factor(s.largest);
    };
    for (const auto& [mesh, speedups] : counted) {
      out_.line("");
      out_.line(mesh + ", at the paper's resolutions where the objectives are equal (" + std::to_string(speedups.rays.size()) +
                "): rays over voxels " + range(speedups.rays) + " (*Wu et al.: " + range(speedups.paper) +
                "*), quadric over voxels " + range(speedups.quadric) + ".");
    }
    for (const std::string& mesh : meshes) {
      LogPlot time{mesh + ": seconds to solve", "N", "seconds", {}};
      for (const std::string& solver : distinct<std::string>(records, [](const Record& r) { return r.solver; }))
        time.curves.push_back(curve_of(
            solver, store_.where([&](const Record& r) { return r.table == "table2" && r.mesh == mesh && r.solver == solver; }),
            median_s));
      for (const bool voxels : {false, true}) {
        Curve paper{voxels ? "Wu et al., voxels" : "Wu et al., rays", {}, {}, true};
        for (const PaperRow& row : paper_table2())
          if (stands_for(mesh, row)) {
            paper.x.push_back(row.longest);
            paper.y.push_back(voxels ? row.voxel_s : row.ray_s);
          }
        if (!paper.x.empty()) time.curves.push_back(paper);
      }
      plot("time_" + std::filesystem::path(mesh).stem().string(), time);
    }
    out_.header(kSolveHeader);
    for (const std::string& mesh : meshes)
      for (const int n : distinct<int>(of_mesh(records, mesh), [](const Record& r) { return r.resolution; })) {
        for (const PaperRow& row : paper_table2())
          if (stands_for(mesh, row) && row.longest == n)
            for (const bool voxels : {false, true}) paper_row(out_, row, voxels);
        for (const Record* r : of_mesh(records, mesh))
          if (r->resolution == n) solve_row(out_, *r);
      }
  }

  void trace() {
    const Records records = store_.table("trace");
    if (records.empty()) return;
    out_.line("");
    out_.line("## Objective against time");
    out_.line("");
    out_.line(
        "One problem, each solver with its own knob from coarse to fine: where Ipopt's barrier stops (rays), the width of the "
        "voxels, the");
    out_.line("number of octree rounds. The gap is that of the objective to the exact optimum; below 1e-9 it is drawn at 1e-9.");
    LogPlot gaps{
        "Gap to the optimum against seconds, " + records.front()->mesh + ", N = " + std::to_string(records.front()->resolution),
        "seconds",
        "relative gap of the objective",
        {}};
    for (const Method m : {Method::quadric, Method::rays, Method::octree, Method::voxels}) {
      Curve curve{name(m), {}, {}};
      for (const Record* r : records)
        if (r->converged() && r->solver.rfind(name(m), 0) == 0) {
          curve.x.push_back(r->seconds.median);
          curve.y.push_back(m == Method::quadric ? 1e-9 : std::max(1e-9, std::abs(r->gap)));
        }
      gaps.curves.push_back(curve);
    }
    plot("objective", gaps);
    out_.header(kSolveHeader);
    for (const Record* r : records) solve_row(out_, *r);
  }

  void quality() {
    const Records records = store_.table("quality");
    if (records.empty()) return;
    out_.line("");
    out_.line("## Shapes and goals");
    out_.line("");
    out_.line(
        "Left: the same problem solved by Ipopt on rays with the paper's bounds, by Ipopt with complete bounds, and by the "
        "quadric");
    out_.line(
        "solver. For float and stand the paper's Eq. 11 leaves nothing out, so there is one column less. *Gap of rays*: to the "
        "quadric");
    out_.line(
        "solver. *Proven gap*: to the bound that no interior on these rays can pass, from the dual for float, from branch and "
        "bound");
    out_.line(
        "(`certify.h`) for spin and yo-yo. Right: the whole run of the command, and what `verify` finds in the file it delivers, "
        "re-read");
    out_.line("from disk.");
    out_.header({"shape", "goal", "N", "objective: paper's bounds", "rays", "quadric", "gap of rays", "proven gap", "iterations",
                 "evaluations", "s: paper's bounds", "s: rays", "s: quadric", "s: proof", "whole run, s", "passes", "verdict",
                 "residuals of the file"});
    Records refused;
    for (const Record* run : records) {
      if (run->solver != "whole run") continue;
      if (run->status == "refused") {
        refused.push_back(run);
        continue;
      }
      const auto of = [&](Method m) { return store_.one("quality", run->mesh, run->goal, run->resolution, name(m)); };
      const Record* paper = of(Method::rays_paper);
      const Record* rays = of(Method::rays);
      const Record* quadric = of(Method::quadric);
      const Record* proof = store_.one("quality", run->mesh, run->goal, run->resolution, kCertificate);
      const auto objective = [](const Record* r) { return r ? quality_text(*r, r->objective, 8) : "as left"; };
      const auto time = [](const Record* r) { return r ? significant(r->seconds.median, 3) : ""; };
      const Record* ipopt = rays ? rays : paper;
      const auto count = [](const Record* r) { return r && r->status != "capped" ? std::to_string(r->iterations) : "-"; };
      const std::string iterations = count(paper) + (rays ? ", " + count(rays) : "");
      std::string residuals;
      for (const char* criterion : {"mass_error", "offset", "centre", "axis_angle", "settled_tilt"})
        if (std::isfinite(run->extra(criterion)))
          residuals += (residuals.empty() ? "" : ", ") + std::string(criterion) + " " + significant(run->extra(criterion), 2);
      out_.row({run->mesh, run->goal, std::to_string(run->resolution), objective(paper), objective(rays),
                quadric ? quality_text(*quadric, quadric->objective, 8) : "-",
                ipopt && ipopt->converged() ? significant(ipopt->gap, 2) : "-",
                proof     ? quality_text(*proof, proof->gap, 2)
                : quadric ? significant(quadric->gap, 2)
                          : "-",
                iterations, count(quadric), time(paper), time(rays), time(quadric), time(proof),
                significant(run->seconds.median, 3), whole(run->extra("passes")),
                run->converged() ? "verified" : "**not verified**: " + run->note, residuals});
    }
    if (!refused.empty()) {
      out_.line("");
      out_.line("Refused, in the command's words:");
      out_.header({"shape", "goal", "N", "reason"});
      for (const Record* r : refused) out_.row({r->mesh, r->goal, std::to_string(r->resolution), r->note});
    }
  }

  void cavities() {
    const Records records = store_.table("cavities");
    if (records.empty()) return;
    out_.line("");
    out_.line("## Light and crisp cavities");
    out_.line("");
    out_.line(
        "Seconds of the whole run in memory. Triangles of the outside, of the cavity, over those of the outside, and at N = 200 "
        "over N = 100.");
    out_.line(
        "Distances of the corners of creases from the exact curve at which the offset surface meets q.phi = 0, in mm; smallest "
        "wall over");
    out_.line("the one that is set, at any point of any triangle; triangles of the cavity that cross others. Meshes that");
    out_.line("are not closed are left out.");
    out_.header({"shape", "goal", "N", "seconds", "outside", "cavity", "ratio", "growth", "passes", "as built", "crease rms", "p99",
                 "max", "wall", "crossing"});
    for (const Record* r : records) {
      const Record* coarse = r->resolution == 200 ? store_.one("cavities", r->mesh, r->goal, 100, r->solver) : nullptr;
      if (!r->converged()) {
        out_.row({r->mesh, r->goal, std::to_string(r->resolution), quality_text(*r, 0, 1)});
        continue;
      }
      const double cavity = r->extra("cavity");
      out_.row({r->mesh, r->goal, std::to_string(r->resolution), significant(r->seconds.median, 3), whole(r->extra("outside")),
                whole(cavity), significant(cavity / r->extra("outside"), 2),
                coarse ? significant(cavity / coarse->extra("cavity"), 3) : "", whole(r->extra("passes")),
                significant(r->extra("as built"), 2), significant(r->extra("crease rms"), 2),
                significant(r->extra("crease p99"), 2), significant(r->extra("crease max"), 2), significant(r->extra("wall"), 3),
                whole(r->extra("crossing"))});
    }
  }

  void overhang() {
    const Records records = store_.table("overhang");
    if (records.empty()) return;
    out_.line("");
    out_.line("## Roofs that print without supports");
    out_.line("");
    out_.line(
        "`--self-supporting 45`, pillars as thick as the wall, printed along three directions. Share of the cavity's surface that "
        "rises");
    out_.line(
        "less than 43 degrees; pieces that begin in mid-air; widest bridge in a layer of 0.2 mm; thinnest pillar; cones, and what "
        "of "
        "the room");
    out_.line("inside is left; by how much the objective could be lower without, as a share of its bound.");
    out_.header({"shape", "goal", "along", "share", "islands", "bridge, mm", "pillar, mm", "cones", "room left", "price",
                 "as built", "seconds", "verdict"});
    for (const Record* r : records) {
      if (!r->converged() && r->status != "judged to fail") {
        out_.row({r->mesh, r->goal, r->solver, quality_text(*r, 0, 1)});
        continue;
      }
      out_.row({r->mesh, r->goal, r->solver, significant(100 * r->extra("roof share"), 2) + " %", whole(r->extra("islands")),
                significant(r->extra("bridge_mm"), 2), significant(r->extra("pillar_mm"), 3), whole(r->extra("carriers")),
                significant(100 * r->extra("inner_domain_kept"), 3) + " %", significant(100 * r->extra("price"), 3) + " %",
                significant(r->extra("as built"), 2), significant(r->seconds.median, 3), r->converged() ? "VERIFIED" : r->status});
    }
  }

  void roofs() {
    const Records records = store_.table("roofs");
    if (records.empty()) return;
    out_.line("");
    out_.line("## Roofs with and without `--self-supporting`");
    out_.line("");
    out_.line(
        "N = 100; each cell without and with `--self-supporting` (45 degrees), both judged along the direction in which the latter "
        "is");
    out_.line(
        "printed. Share of the cavity's surface with roofs flatter than 45 degrees; widest bridge in a layer of 0.2 mm; pieces "
        "that "
        "begin");
    out_.line(
        "in mid-air; triangles of the cavity; seconds of making it; what the goal is about: metacentric height in mm (float), "
        "smallest");
    out_.line(
        "tipping angle in degrees (stand), axial over larger lateral moment (spin); what of the room inside is left. Every body in "
        "it "
        "is");
    out_.line("VERIFIED both ways but where it says otherwise.");
    out_.header({"shape", "goal", "roofs, %", "bridge, mm", "islands", "triangles", "seconds", "goal's figure", "cones",
                 "room left", "as built"});
    for (const Record* r : records) out_.row(roofs_of(*r));
  }

  static std::vector<std::string> roofs_of(const Record& r) {
    if (r.status == "refused") return {r.mesh, r.goal, quality_text(r, 0, 1)};
    const auto both = [&r](const std::string& name, const auto& shown) {
      const double after = r.extra("after " + name);
      return shown(r.extra("before " + name)) + " -> " + (std::isnan(after) ? std::string("-") : shown(after));
    };
    const auto three = [](double value) { return std::isnan(value) ? std::string("-") : significant(value, 3); };
    const auto two = [](double value) { return significant(value, 2); };
    std::vector<std::string> cells = {r.mesh,
                                      r.goal,
                                      both("share", [](double value) { return significant(100 * value, 2); }),
                                      both("bridge", two),
                                      both("islands", whole),
                                      both("triangles", whole),
                                      both("seconds", two),
                                      both("goal", three)};
    if (!r.note.empty())
      cells.push_back("refused: " + r.note);
    else
      cells.insert(cells.end(), {whole(r.extra("carriers")), significant(100 * r.extra("inner_domain_kept"), 3) + " %",
                                 significant(r.extra("after as built"), 2)});
    if (!r.converged()) cells.back() += " (" + r.status + ")";
    return cells;
  }

  void growth() {
    const Records records = store_.table("growth");
    if (records.empty()) return;
    out_.line("");
    out_.line("## Whole runs: growth with the resolution");
    out_.line("");
    out_.line(
        "`rayrep float SHAPE --resolution N`, waterline searched, mesh written and verified: seconds of the whole command, its "
        "stages, and its");
    out_.line("peak memory.");
    const std::array<const char*, 8> stages = {"check", "domain", "rays", "waterline", "solve", "mesh", "write", "verify"};
    std::vector<std::string> header = {"shape", "N", "seconds", "peak MB", "passes", "mass_error", "offset", "verdict"};
    for (const char* stage : stages) header.push_back(stage);
    out_.header(header);
    for (const Record* r : records) {
      std::vector<std::string> cells = {r->mesh,
                                        std::to_string(r->resolution),
                                        seconds_text(*r),
                                        whole(r->peak_memory_mb),
                                        whole(r->extra("passes")),
                                        significant(r->extra("mass_error"), 2),
                                        significant(r->extra("offset"), 2),
                                        r->converged() ? "verified" : r->status + ": " + r->note};
      for (const char* stage : stages) cells.push_back(significant(r->extra(std::string("stage ") + stage), 2));
      out_.row(cells);
    }
    LogPlot time{"Whole run: seconds against N", "N", "seconds", {}};
    LogPlot memory{"Whole run: peak memory against N", "N", "MB", {}};
    for (const std::string& mesh : distinct<std::string>(records, [](const Record& r) { return r.mesh; })) {
      const Records of = of_mesh(records, mesh);
      time.curves.push_back(curve_of(mesh, of, median_s));
      memory.curves.push_back(curve_of(mesh, of, [](const Record& r) { return r.peak_memory_mb; }));
      if (of.size() < 2 || !of.front()->converged() || !of.back()->converged()) continue;
      const auto between = [&](double first, double last) {
        return significant(fit_power_law({1.0 * of.front()->resolution, 1.0 * of.back()->resolution}, {first, last}).exponent, 3);
      };
      out_.line("");
      out_.line(mesh + ", between N = " + std::to_string(of.front()->resolution) + " and " + std::to_string(of.back()->resolution) +
                ": time grows as N^" + between(of.front()->seconds.median, of.back()->seconds.median) + ", peak memory as N^" +
                between(of.front()->peak_memory_mb, of.back()->peak_memory_mb) + ".");
    }
    plot("growth_time", time);
    plot("growth_memory", memory);
  }

  void teapot() {
    const Records records = store_.table("teapot");
    if (records.empty()) return;
    out_.line("");
    out_.line("## Spin-It's figures");
    out_.line("");
    out_.line(
        "Lowest speed above which the upright spin is stable, rpm, of the solid and of the hollowed file, for a tip that slides "
        "(Spin-It's Eq. 1)");
    out_.line(
        "and for one held by friction, and the factor between them. *Spin-It, Fig. 9, its teapot: 1.56 (inertia only), 1.60 "
        "(lowering), 1.68");
    out_.line("(lowering and mass)*; the paper gives neither weights nor size nor wall, so several weights are tried.");
    out_.header({"shape", "N", "objective", "sliding: before", "after", "factor", "fixed: before", "after", "factor",
                 "centre's height: before, mm", "after", "mass: before, g", "after", "verdict"});
    for (const Record* r : records) {
      if (r->goal != "spin") continue;
      std::vector<std::string> cells = {r->mesh, std::to_string(r->resolution), r->solver};
      for (const char* tip : {"stable_sliding", "stable_fixed"}) {
        const double before = r->extra(std::string(tip) + " before");
        const double after = r->extra(std::string(tip) + " after");
        cells.insert(cells.end(), {significant(before, 4), significant(after, 4), significant(before / after, 3)});
      }
      for (const char* name : {"height before", "height after", "mass before", "mass after"})
        cells.push_back(significant(r->extra(name), 4));
      cells.push_back(r->converged() ? "verified" : r->status + ": " + r->note);
      out_.row(cells);
    }
    out_.line("");
    out_.line(
        "Height of the centre of mass of standing shapes over that of the shape, and the smallest tipping angle. *Spin-It, Fig. "
        "12, its T-Rex: 42 %");
    out_.line("and 8 degrees; Prevost et al. 2013: 56 % and 1 degree.*");
    out_.header({"shape", "N", "height: before", "after", "tipping angle: before", "after", "verdict"});
    for (const Record* r : records) {
      if (r->goal != "stand") continue;
      const auto percent = [&](const char* name) { return significant(100 * r->extra(name) / r->extra("size"), 3) + " %"; };
      const auto degrees = [&](const char* name) { return significant(r->extra(name) * 180 / std::numbers::pi, 3) + " deg"; };
      out_.row({r->mesh, std::to_string(r->resolution), percent("height before"), percent("height after"),
                degrees("tipping before"), degrees("tipping after"), r->converged() ? "verified" : r->status + ": " + r->note});
    }
  }

  void sliced() {
    const Records records = store_.table("sliced");
    if (records.empty()) return;
    out_.line("");
    out_.line("## As printed");
    out_.line("");
    out_.line(
        "PrusaSlicer 2.5 with `benchmarks/everyday.ini` (0.2 mm layers, 2 perimeters, gyroid); inside a cavity, or infill in its "
        "place. Promised is the");
    out_.line(
        "mesh that meets the goal, open loop what is laid down for it, closed loop the print that `--slicer prusa-slicer` "
        "delivers. "
        "Offset: of the centre");
    out_.line(
        "of mass from where it shall be, over the diagonal. Lean: where it floats at rest; of the nearest principal axis from the "
        "spin axis. *Does*: waterline,");
    out_.line("mm; lowest speed at which it spins stably, rpm; smallest tipping angle, degrees.");
    const auto cells = [](const Record& r, const std::string& when) {
      const double g = r.extra(when + " mass_g");
      const double promised = r.extra("promised mass_g");
      const double lean = r.extra(when + " lean_rad") * 180 / std::numbers::pi;
      return std::vector<std::string>{
          significant(g, 5) + (when == "promised" ? "" : " (" + significant(100 * (g / promised - 1), 2) + " %)"),
          significant(r.extra(when + " offset"), 2), std::isfinite(lean) ? significant(lean, 2) : "-",
          significant(r.extra(when + " does"), 4)};
    };
    out_.header({"shape", "goal", "inside", "promised: g", "does", "open loop: g", "offset", "lean, deg", "does", "closed loop: g",
                 "offset", "lean, deg", "does", "slices", "seconds", "verdict"});
    for (const Record* r : records) {
      std::vector<std::string> row = {r->mesh, r->goal, r->solver};
      if (r->status == "refused" || r->status == "skipped") {
        row.resize(15, "-");
        row.push_back(r->status + ": " + r->note.substr(0, r->note.find_first_of(":.")));
      } else {
        const std::vector<std::string> promised = cells(*r, "promised");
        row.insert(row.end(), {promised[0], promised[3]});
        for (const char* when : {"open", "closed"})
          for (const std::string& cell : cells(*r, when)) row.push_back(cell);
        row.insert(row.end(), {significant(r->extra("slices"), 1), significant(r->seconds.median, 3),
                               (r->converged() ? "verified" : "fails " + r->status) +
                                   (r->extra("gave way") > 0 ? ", the waterline moved" : "")});
      }
      out_.row(row);
    }
  }

  void answers() {
    const Records records = store_.table("answers");
    if (records.empty()) return;
    out_.line("");
    out_.line("## Answers");
    out_.line("");
    out_.line("Every mesh, 80 mm long, z up, whether it was meant so or not, N = " + std::to_string(records.front()->resolution) +
              ": `rayrep GOAL MESH --size 80 --rigid --allow all`, a top with `--point com`. In a cell: yes");
    out_.line(
        "(as asked), the least change that does it, all of them made and judged, or why there is none; seconds of the whole run. "
        "What is "
        "not closed is refused with what is wrong.");
    const std::vector<std::string> goals = {"float", "spin", "yo-yo", "stand"};
    std::map<std::string, std::map<std::string, int>> counts;
    std::map<std::string, std::vector<std::string>> rows;
    std::vector<std::string> order;
    for (const Record* r : records) {
      if (!rows.contains(r->mesh)) order.push_back(r->mesh);
      const std::string kind = r->status == "not closed" ? "not closed"
                               : !r->converged()         ? "no answer"
                               : r->note.empty()         ? "as asked"
                                                         : "with a change";
      ++counts[kind][r->goal];
      const std::string cell = kind == "as asked"     ? "yes"
                               : kind == "not closed" ? kind
                               : kind == "no answer"  ? "**none**: " + r->note
                                                      : r->note;
      rows[r->mesh].push_back(cell + " (" + significant(r->seconds.median, 2) + " s)");
    }
    out_.header({"", "float", "top", "yo-yo", "stand"});
    for (const char* kind : {"as asked", "with a change", "no answer", "not closed"}) {
      std::vector<std::string> row = {kind};
      for (const std::string& goal : goals) row.push_back(std::to_string(counts[kind][goal]));
      out_.row(row);
    }
    out_.line("");
    out_.header({"mesh", "float", "top", "yo-yo", "stand"});
    for (const std::string& mesh : order) {
      std::vector<std::string> row = {mesh};
      row.insert(row.end(), rows[mesh].begin(), rows[mesh].end());
      out_.row(row);
    }
  }

  void micro_benchmarks(const std::filesystem::path& path) {
    std::ifstream file(path);
    if (!file) throw std::runtime_error("Cannot read '" + path.string() + "'.");
    const nlohmann::json json = nlohmann::json::parse(file);
    out_.line("");
    out_.line("## Parts");
    out_.line("");
    out_.line(
        "Google Benchmark on the tilted ellipsoid as a top. The bound for an evaluation of a quadric is a plain read of as many "
        "bytes with all");
    out_.line("cores.");
    out_.header({"part", "N", "ms", "throughput", "bandwidth", "over the plain read"});
    std::map<std::string, double> read_ms;
    for (const auto& b : json.at("benchmarks")) {
      if (b.contains("run_type") && b.at("run_type") != "iteration" && b.value("aggregate_name", "") != "median") continue;
      const std::string full = b.at("name");
      const std::string part = full.substr(0, full.find('/'));
      std::string n = full.substr(full.find("N:") + 2);
      n = n.substr(0, n.find('/'));
      const double ms = b.at("real_time");
      if (part.rfind("plain read", 0) == 0) read_ms[n] = ms;
      std::string rate;
      for (const char* what : {"rays", "intervals", "triangles"})
        if (b.contains(what)) rate = significant(b.at(what).get<double>() / 1e6, 3) + " M " + what + "/s";
      const bool reads = b.contains("bytes");
      out_.row({part, n, significant(ms, 3), rate, reads ? significant(b.at("bytes").get<double>() / 1e9, 3) + " GB/s" : "",
                reads && read_ms.contains(n) ? factor(ms / read_ms[n]) : ""});
    }
  }

  static Records of_mesh(const Records& records, const std::string& mesh) {
    Records found;
    for (const Record* r : records)
      if (r->mesh == mesh) found.push_back(r);
    return found;
  }

  const std::vector<Measurements>& runs_;
  Store store_;
  std::filesystem::path folder_;
  Markdown out_;
};

}  // namespace

void write_results(const std::vector<Measurements>& runs, const std::filesystem::path& micro, const std::filesystem::path& folder) {
  Report(runs, folder).write(micro);
}

}  // namespace rayrep::bench

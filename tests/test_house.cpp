// The rules of the house (docs/architecture.md), checked on the text of the sources: include directions, where third-party
// libraries may be seen, what the library never does. A new header or source belongs in kUnits below.

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;
using Problems = std::vector<std::string>;

/// One line of the layer table: a header and its source share a name. A unit may include lower layers and its `peers`.
struct Unit {
  int layer;
  std::vector<std::string> peers;
};

const std::map<std::string, Unit> kUnits = {
    // 0: values
    {"error", {0, {}}},
    {"progress", {0, {"error"}}},
    {"mesh", {0, {"union_find"}}},
    {"ray_rep", {0, {}}},
    {"block_field", {0, {}}},
    {"materials", {0, {"error"}}},
    {"mesh_edges", {0, {"mesh"}}},
    {"predicates", {0, {}}},
    {"text", {0, {}}},
    {"union_find", {0, {}}},
    // 1: files and physics of triangles
    {"mesh_io", {1, {"mesh_io_detail"}}},
    {"mesh_io_detail", {1, {"mesh_io"}}},
    {"mesh_io_3mf", {1, {"mesh_io_detail"}}},
    {"mesh_io_obj", {1, {"mesh_io_detail"}}},
    {"mesh_io_off", {1, {"mesh_io_detail"}}},
    {"mesh_io_ply", {1, {"mesh_io_detail"}}},
    {"mesh_io_polygon", {1, {"mesh_io_detail"}}},
    {"mesh_io_stl", {1, {"mesh_io_detail"}}},
    {"mesh_io_text", {1, {"mesh_io_detail"}}},
    {"close_pairs", {1, {}}},
    {"moments", {1, {}}},
    {"hydrostatics", {1, {"moments"}}},
    {"inertial", {1, {"moments"}}},
    {"spin", {1, {"moments"}}},
    {"spin_simulation", {1, {}}},
    {"support_polygon", {1, {}}},
    // 2: wrapped third-party geometry
    {"surface_query", {2, {}}},
    {"level_set", {2, {}}},
    // 3: what is solid, where material may go, what is wanted
    {"mesh_check", {3, {"ray_cast"}}},
    {"mesh_union", {3, {"mesh_check", "ray_cast"}}},
    {"ray_cast", {3, {}}},
    {"inner_domain", {3, {"ray_cast"}}},
    {"cavity", {3, {}}},
    {"interior", {3, {}}},
    {"ray_interior", {3, {"interior"}}},
    {"ray_integrals", {3, {"ray_interior"}}},
    {"voxel_interior", {3, {"interior", "ray_interior"}}},
    {"octree_interior", {3, {"voxel_interior", "ray_interior"}}},
    {"goals", {3, {}}},
    // 4: solvers
    {"nlp", {4, {}}},
    {"solve", {4, {"nlp"}}},
    {"solve_ipopt", {4, {"nlp", "solve"}}},
    {"solve_octree", {4, {"nlp", "solve"}}},
    {"quadric", {4, {}}},
    {"certify", {4, {"quadric"}}},
    // 5: the pipeline, its judge and its report
    {"verify", {5, {"verify_detail"}}},
    {"verify_detail", {5, {"verify"}}},
    {"verify_spin", {5, {"verify", "verify_detail"}}},
    {"verify_stand", {5, {"verify", "verify_detail"}}},
    {"verify_target", {5, {"verify", "verify_detail"}}},
    {"waterline", {5, {}}},
    {"interior_solver", {5, {}}},
    {"hollow_detail", {5, {"interior_solver", "hollow"}}},
    {"spin_search", {5, {"hollow_detail"}}},
    {"hollow_target", {5, {"hollow", "hollow_detail"}}},
    {"hollow", {5, {"hollow_detail", "spin_search", "waterline"}}},
    {"report", {5, {"hollow", "verify", "waterline"}}},
    // 6: the contents page
    {"rayrep", {6, {}}},
};

/// Seams that are narrower than the layers: the first never includes any of the second.
const std::map<std::string, std::set<std::string>> kStrangers = {
    {"goals", {"interior", "ray_interior", "ray_rep", "ray_cast", "inner_domain"}},
    {"interior", {"goals"}},
    {"ray_interior", {"goals"}},
    {"ray_integrals", {"goals", "interior"}},
    {"voxel_interior", {"goals"}},
    {"octree_interior", {"goals"}},
    {"quadric", {"interior", "ray_interior"}},
    {"nlp", {"ray_interior", "ray_rep", "voxel_interior", "octree_interior"}},
    {"verify",
     {"ray_rep", "ray_cast", "inner_domain", "cavity", "interior", "ray_interior", "goals", "nlp", "solve", "quadric", "waterline",
      "hollow"}},
    {"verify_detail",
     {"ray_rep", "ray_cast", "inner_domain", "cavity", "interior", "ray_interior", "goals", "nlp", "solve", "quadric", "waterline",
      "hollow"}},
    {"verify_spin",
     {"ray_rep", "ray_cast", "inner_domain", "cavity", "interior", "ray_interior", "goals", "nlp", "solve", "quadric", "waterline",
      "hollow"}},
    {"verify_target",
     {"ray_rep", "ray_cast", "inner_domain", "cavity", "interior", "ray_interior", "goals", "nlp", "solve", "quadric", "waterline",
      "hollow"}},
    {"verify_stand",
     {"ray_rep", "ray_cast", "inner_domain", "cavity", "interior", "ray_interior", "goals", "nlp", "solve", "quadric", "waterline",
      "hollow"}},
};

/// Third-party headers, by the beginning of their names, and the only sources that may include them; empty: any source.
const std::map<std::string, std::set<std::string>> kThirdParty = {
    {"Eigen/", {}},
    {"tbb/", {}},
    {"embree3/", {"surface_query"}},
    {"openvdb/", {"level_set"}},
    {"coin/", {"solve_ipopt"}},
    {"Ip", {"solve_ipopt"}},
    {"pugixml.hpp", {"mesh_io_3mf"}},
    {"zip.h", {"mesh_io_3mf"}},
    {"nlohmann/", {"report"}},
    {"boost/", {}},
};

/// What the library never does: it does not print, end the process, look at a clock or draw unseeded numbers.
const std::vector<std::string> kNeverInLibrary = {
    R"(\bstd::(cout|cerr|clog|wcout|wcerr|cin)\b)",
    R"(\b(printf|fprintf|vprintf|vfprintf|puts|fputs|putchar|perror)\s*\()",
    R"(\bstd::print(ln)?\b)",
    R"(\b(exit|_exit|_Exit|quick_exit|abort)\s*\()",
    R"(\bstd::terminate\b)",
    R"(\bstd::chrono\b)",
    R"(\b(clock|clock_gettime|gettimeofday)\s*\()",
    R"(\bstd::time\b)",
    R"(\b(rand|srand|random|drand48)\s*\()",
    R"(\brandom_device\b)",
    R"(\bgetenv\s*\()",
};

const std::vector<std::string> kNeverInPublicHeaders = {
    R"(\btbb::)",   R"(\bnlohmann\b)", R"(\bopenvdb\b)", R"(\bRTC[A-Z]\w*)",       R"(\bIpopt\b)",
    R"(\bboost::)", R"(\bpugi::)",     R"(\bzip_t\b)",   R"(\busing namespace\b)",
};

enum class Place { public_header, library_source };

/// The text with comments, and if asked the contents of string and character literals, turned into spaces. Keeps line breaks.
std::string blanked(const std::string& text, bool strings_too) {
  std::string out = text;
  const auto blank = [&out](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < std::min(end, out.size()); ++i)
      if (out[i] != '\n') out[i] = ' ';
  };
  std::size_t i = 0;
  while (i < text.size()) {
    const std::string two = text.substr(i, 2);
    std::size_t end = i + 1;
    if (two == "//") {
      end = std::min(text.find('\n', i), text.size());
      blank(i, end);
    } else if (two == "/*") {
      const std::size_t close = text.find("*/", i + 2);
      end = close == std::string::npos ? text.size() : close + 2;
      blank(i, end);
    } else if (two == "R\"") {
      const std::size_t open = std::min(text.find('(', i), text.size());
      const std::size_t close = text.find(")" + text.substr(i + 2, open - i - 2) + "\"", open);
      end = close == std::string::npos ? text.size() : close + open - i;
      if (strings_too) blank(i + 2, end - 1);
    } else if (text[i] == '"' || (text[i] == '\'' && (i == 0 || !std::isalnum(static_cast<unsigned char>(text[i - 1]))))) {
      while (end < text.size() && text[end] != text[i] && text[end] != '\n') end += text[end] == '\\' ? 2 : 1;
      if (strings_too) blank(i + 1, end);
      ++end;
    }
    i = end;
  }
  return out;
}

struct Include {
  std::string name;
  bool quoted;
};

std::vector<Include> includes_of(const std::string& text) {
  static const std::regex kInclude(R"re((^|\n)[ \t]*#[ \t]*include[ \t]*(["<])([^">\n]+)[">])re");
  const std::string code = blanked(text, false);
  std::vector<Include> found;
  for (std::sregex_iterator it(code.begin(), code.end(), kInclude), end; it != end; ++it)
    found.push_back({(*it)[3], (*it)[2] == "\""});
  return found;
}

void check_own_include(const std::string& unit, const std::string& included, Problems& problems) {
  const std::string target = fs::path(included).stem();
  if (target == unit) return;
  const auto to = kUnits.find(target);
  if (to == kUnits.end()) {
    problems.push_back("includes \"" + included +
                       "\", which is not in the layer table kUnits of tests/test_house.cpp: add it there");
    return;
  }
  const Unit& from = kUnits.at(unit);
  const bool peer = std::count(from.peers.begin(), from.peers.end(), target) > 0;
  if (to->second.layer > from.layer)
    problems.push_back("of layer " + std::to_string(from.layer) + " includes \"" + included + "\" of the higher layer " +
                       std::to_string(to->second.layer));
  else if (to->second.layer == from.layer && !peer)
    problems.push_back("includes \"" + included + "\" of its own layer " + std::to_string(from.layer) + ": not among its peers");
  const auto strangers = kStrangers.find(unit);
  if (strangers != kStrangers.end() && strangers->second.contains(target))
    problems.push_back("includes \"" + included + "\", which it must not know");
}

void check_foreign_include(const std::string& unit, const std::string& included, Place place, Problems& problems) {
  static const std::regex kStandard(R"([a-z_0-9]+)");
  static const std::regex kSystem(R"((sys/)?[a-z]+\.h)");
  for (const auto& [prefix, sources] : kThirdParty) {
    if (included.rfind(prefix, 0) != 0) continue;
    if (place == Place::public_header && prefix != "Eigen/")
      problems.push_back("includes <" + included + ">: public headers may show no third-party library but Eigen");
    else if (!sources.empty() && !sources.contains(unit))
      problems.push_back("includes <" + included + ">, which only " + *sources.begin() + ".cpp may see");
    return;
  }
  if (std::regex_match(included, kStandard)) return;
  if (place == Place::library_source && std::regex_match(included, kSystem)) return;
  problems.push_back("includes <" + included + ">, which is neither a standard header nor in kThirdParty of tests/test_house.cpp");
}

/// Everything in the text of one file that breaks a rule of the house.
Problems problems_of(const std::string& path, const std::string& text, Place place) {
  Problems problems;
  const std::string unit = fs::path(path).stem();
  if (!kUnits.contains(unit)) {
    problems.push_back(path + ": not in the layer table kUnits of tests/test_house.cpp: add it there, and to docs/architecture.md");
    return problems;
  }
  for (const Include& include : includes_of(text)) {
    if (include.quoted)
      check_own_include(unit, include.name, problems);
    else
      check_foreign_include(unit, include.name, place, problems);
  }

  static const std::vector<std::regex> kInLibrary(kNeverInLibrary.begin(), kNeverInLibrary.end());
  static const std::vector<std::regex> kInPublicHeaders(kNeverInPublicHeaders.begin(), kNeverInPublicHeaders.end());
  std::istringstream lines(blanked(text, true));
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    const auto search = [&](const std::vector<std::regex>& forbidden) {
      std::smatch match;
      for (const std::regex& pattern : forbidden)
        if (std::regex_search(line, match, pattern))
          problems.push_back("line " + std::to_string(number) + ": '" + match.str() + "' has no place here");
    };
    search(kInLibrary);
    if (place == Place::public_header) search(kInPublicHeaders);
  }
  if (fs::path(path).extension() == ".h" && text.find("#pragma once") == std::string::npos)
    problems.push_back("lacks #pragma once");

  for (std::string& problem : problems) problem = path + ": " + problem;
  return problems;
}

std::string read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::vector<fs::path> sources_below(const fs::path& folder) {
  std::vector<fs::path> found;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.path().extension() == ".h" || entry.path().extension() == ".cpp") found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  return found;
}

const fs::path kRoot = RAYREP_SOURCE_DIR;

TEST(House, PublicHeadersKeepTheRules) {
  const auto headers = sources_below(kRoot / "include/rayrep");
  ASSERT_GE(headers.size(), 15u);
  for (const fs::path& path : headers)
    for (const std::string& problem : problems_of(path.lexically_relative(kRoot), read(path), Place::public_header))
      ADD_FAILURE() << problem;
}

TEST(House, LibrarySourcesKeepTheRules) {
  const auto sources = sources_below(kRoot / "src");
  ASSERT_GE(sources.size(), 10u);
  for (const fs::path& path : sources)
    for (const std::string& problem : problems_of(path.lexically_relative(kRoot), read(path), Place::library_source))
      ADD_FAILURE() << problem;
}

/// The user-facing header is the contents page: it names every public header.
TEST(House, ContentsPageNamesEveryHeader) {
  std::set<std::string> unnamed;
  for (const fs::path& path : sources_below(kRoot / "include/rayrep")) unnamed.insert(path.filename());
  unnamed.erase("rayrep.h");
  for (const Include& include : includes_of(read(kRoot / "include/rayrep/rayrep.h")))
    unnamed.erase(fs::path(include.name).filename());
  EXPECT_EQ(unnamed, std::set<std::string>{}) << "add these to include/rayrep/rayrep.h";
}

TEST(House, TableNamesOnlyWhatExists) {
  std::set<std::string> present;
  for (const char* folder : {"include/rayrep", "src"})
    for (const fs::path& path : sources_below(kRoot / folder)) present.insert(path.stem());
  for (const auto& [name, unit] : kUnits) EXPECT_TRUE(present.contains(name)) << name << " is in kUnits but not in the tree";
}

// The checker itself, on texts that break each rule once.

std::string joined(const Problems& problems) {
  std::string all;
  for (const std::string& problem : problems) all += problem + "\n";
  return all;
}

struct Case {
  const char* path;
  Place place;
  const char* text;
  const char* complaint;  ///< part of the only problem expected; nullptr: none
};

void expect_verdicts(const std::vector<Case>& cases) {
  for (const Case& c : cases) {
    SCOPED_TRACE(c.text);
    const Problems problems = problems_of(c.path, c.text, c.place);
    if (c.complaint == nullptr)
      EXPECT_EQ(joined(problems), "");
    else if (problems.size() != 1)
      ADD_FAILURE() << "one problem expected: " << c.complaint << "\nfound:\n" << joined(problems);
    else
      EXPECT_NE(problems[0].find(c.complaint), std::string::npos) << problems[0];
  }
}

constexpr Place kHeader = Place::public_header;
constexpr Place kSource = Place::library_source;

TEST(HouseChecker, FindsBadIncludes) {
  expect_verdicts(
      {Case{"include/rayrep/new_thing.h", kHeader, "#pragma once\n", "add it there"},
       Case{"include/rayrep/mesh.h", kHeader, "#pragma once\n#include \"rayrep/new_thing.h\"\n", "add it there"},
       Case{"include/rayrep/mesh.h", kHeader, "#pragma once\n#include \"rayrep/verify.h\"\n", "higher layer"},
       Case{"src/moments.cpp", kSource, "#include \"rayrep/hydrostatics.h\"\n", "not among its peers"},
       Case{"src/hydrostatics.cpp", kSource, "#include \"rayrep/moments.h\"\n#include \"rayrep/mesh.h\"\n", nullptr},
       Case{"include/rayrep/verify.h", kHeader, "#pragma once\n#include \"rayrep/ray_cast.h\"\n", "must not know"},
       Case{"src/goals.cpp", kSource, "#include \"rayrep/ray_rep.h\"\n", "must not know"},
       Case{"src/mesh.cpp", kSource, " # include <embree3/rtcore.h>\n", "only surface_query.cpp"},
       Case{"src/mesh.cpp", kSource, "#include <openvdb/openvdb.h>\n", "only level_set.cpp"},
       Case{"src/solve.cpp", kSource, "#include <coin/IpTNLP.hpp>\n", "only solve_ipopt.cpp"},
       Case{"src/surface_query.cpp", kSource, "#include <embree3/rtcore.h>\n#include <vector>\n#include <sys/stat.h>\n", nullptr},
       Case{"src/mesh.cpp", kSource, "#include <CGAL/Surface_mesh.h>\n", "neither a standard header"},
       Case{"include/rayrep/mesh.h", kHeader, "#pragma once\n#include <tbb/blocked_range.h>\n", "no third-party"},
       Case{"include/rayrep/mesh.h", kHeader, "#pragma once\n#include <Eigen/Core>\n#include <vector>\n", nullptr},
       Case{"include/rayrep/mesh.h", kHeader, "#pragma once\n// #include \"rayrep/verify.h\"\n", nullptr},
       Case{"include/rayrep/mesh.h", kHeader, "#include <vector>\n", "pragma once"}});
}

TEST(HouseChecker, FindsBadWords) {
  expect_verdicts(
      {Case{"src/mesh.cpp", kSource, "int a;\nvoid f() { std::cout << 1; }\n", "line 2: 'std::cout'"},
       Case{"src/mesh.cpp", kSource, "void f() { std::cerr << 1; }", "std::cerr"},
       Case{"src/mesh.cpp", kSource, "void f() { printf (\"x\"); }", "printf"},
       Case{"src/mesh.cpp", kSource, "void f() { std::fprintf(stderr, \"x\"); }", "fprintf"},
       Case{"src/mesh.cpp", kSource, "void f() { std::snprintf(b, 9, \"printf(\"); }", nullptr},
       Case{"src/mesh.cpp", kSource, "void f() { ::exit(1); }", "exit("},
       Case{"src/mesh.cpp", kSource, "void f() { std::abort(); }", "abort("},
       Case{"src/mesh.cpp", kSource, "void f() { auto t = std::chrono::steady_clock::now(); }", "std::chrono"},
       Case{"src/mesh.cpp", kSource, "int f() { return rand(); }", "rand("},
       Case{"src/mesh.cpp", kSource, "std::random_device d;", "random_device"},
       Case{"src/mesh.cpp", kSource, "// std::cout\n/* exit(1)\n rand() */ const char* s = \"abort()\";", nullptr},
       Case{"src/mesh.cpp", kSource, "const char* s = R\"x(exit(1))x\"; void f() { exit(1); }", "exit("},
       Case{"src/mesh.cpp", kSource, "const char* s = \"\\\"\"; char q = '\"'; int n = 1'000; void f() { exit(1); }", "exit("},
       Case{"src/mesh.cpp", kSource, "void f() { brand(); on_exit_(); operand(1); }", nullptr},
       Case{"include/rayrep/mesh.h", kHeader, "#pragma once\ntbb::task_arena& arena();\n", "tbb::"},
       Case{"include/rayrep/mesh.h", kHeader, "#pragma once\nnlohmann::json f();\n", "nlohmann"},
       Case{"include/rayrep/mesh.h", kHeader, "#pragma once\nvoid f(RTCScene s);\n", "RTCScene"},
       Case{"include/rayrep/mesh.h", kHeader, "#pragma once\nvoid f(Ipopt::TNLP&);\n", "Ipopt"},
       Case{"include/rayrep/mesh.h", kHeader, "#pragma once\nboost::any f();\n", "boost::"},
       Case{"include/rayrep/mesh.h", kHeader, "#pragma once\n/// Like openvdb::Grid.\nint f();\n", nullptr}});
}

}  // namespace
